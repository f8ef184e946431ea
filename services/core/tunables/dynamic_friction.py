"""Dynamic friction of robot and ground."""

from gaplab.services.core.tunables.base import MaterialTunable


class DynamicFriction(MaterialTunable):
    """The tangential force that resists a sliding contact, divided by the normal force."""

    name = "dynamic_friction"
    source = "Paper, section 2"
    field = "material.dynamic_friction"
    lower, upper = 0.0, 1.5
    least, greatest = 0.0, 10.0
