"""Restitution of robot and ground."""

from gaplab.services.core.tunables.base import MaterialTunable


class Restitution(MaterialTunable):
    """The speed after a bounce over the speed before it; engines gain energy near 1, so it stays below."""

    name = "restitution"
    source = "Paper, section 2"
    field = "material.restitution"
    lower, upper = 0.0, 0.6
    least, greatest = 0.0, 0.9
