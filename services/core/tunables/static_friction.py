"""Static friction of robot and ground."""

from gaplab.services.core.tunables.base import MaterialTunable


class StaticFriction(MaterialTunable):
    """The tangential force that a contact at rest withstands, divided by the normal force."""

    name = "static_friction"
    source = "Paper, section 2"
    field = "material.static_friction"
    lower, upper = 0.0, 1.5
    least, greatest = 0.0, 10.0
