"""Friction as one coefficient, as MuJoCo has it."""

from dataclasses import replace

from gaplab.services.core.tunables.base import MaterialTunable
from gaplab.services.core.world import Material, World


class Friction(MaterialTunable):
    """A factor of static and dynamic friction: where they are equal, as in an MJCF, they stay so."""

    name = "friction"
    source = "gaplab"
    field = "material.static_friction"
    also = frozenset({"dynamic_friction"})
    relative = True
    lower, upper = 0.3, 1.5
    least, greatest = 0.0, 10.0

    def read(self, world: World) -> float:  # noqa: ARG002
        """Return 1, which changes nothing."""
        return 1.0

    def changed(self, material: Material, value: float) -> Material:
        """Return a material with both coefficients scaled."""
        both = {name: getattr(material, name) * value for name in ("static_friction", "dynamic_friction")}
        return replace(material, **both)
