"""Tunables of the ground, and of what touches it."""

from dataclasses import replace

from gaplab.services.world.tunables.base import IN_PLACE, MaterialTunable, Tunable
from gaplab.services.world.world import Material, World


class StaticFriction(MaterialTunable):
    """The tangential force that a contact at rest withstands, divided by the normal force."""

    name = "static_friction"
    source = "Paper, section 2"
    field = "material.static_friction"
    lower, upper = 0.0, 1.5
    least, greatest = 0.0, 10.0


class DynamicFriction(MaterialTunable):
    """The tangential force that resists a sliding contact, divided by the normal force."""

    name = "dynamic_friction"
    source = "Paper, section 2"
    field = "material.dynamic_friction"
    lower, upper = 0.0, 1.5
    least, greatest = 0.0, 10.0


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


class Restitution(MaterialTunable):
    """The speed after a bounce divided by the speed before; bounds stay below 1, where engines gain energy."""

    name = "restitution"
    source = "Paper, section 2"
    field = "material.restitution"
    lower, upper = 0.0, 0.6
    least, greatest = 0.0, 0.9


class Slope(Tunable):
    """Angle by which the ground rises along x."""

    name = "slope"
    order = IN_PLACE
    field = "slope_rad"
    unit = "rad"
    lower, upper = -0.1, 0.1
    least, greatest = -1.5, 1.5

    def read(self, world: World) -> float:
        """Return the angle."""
        return world.slope_rad

    def edit(self, world: World, value: float) -> World:
        """Return the world on another slope."""
        return world.edited(self.field, slope_rad=float(value))
