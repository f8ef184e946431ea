"""Restitution of robot and ground."""

from gaplab.services.core.tunables.base import MaterialTunable


class Restitution(MaterialTunable):
    """The speed after a bounce divided by the speed before; bounds stay below 1, where engines gain energy."""

    name = "restitution"
    source = "Paper, section 2"
    field = "material.restitution"
    lower, upper = 0.0, 0.6
    least, greatest = 0.0, 0.9
