"""Tunables of the ground, of what touches it, and of the frame in which sensors see it."""

from dataclasses import replace
from typing import Literal

from pydantic import Field

from gaplab.schemas.base import Frozen
from gaplab.services.world.tunables.base import IN_PLACE, MaterialTunable, Tunable, WorldTunable
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


class Slope(WorldTunable):
    """Angle by which the ground rises along x."""

    name = "slope"
    field = "slope_rad"
    unit = "rad"
    lower, upper = -0.1, 0.1
    least, greatest = -1.5, 1.5


class GroundHeight(WorldTunable):
    """Height of the ground in the frame of the sensors, like that of a camera that was not quite level with it."""

    name = "ground_height"
    field = "ground_m"
    unit = "m"
    lower, upper = -0.02, 0.02
    least, greatest = -1.0, 1.0


class TiltOptions(Frozen):
    """Options of the tunable `gravity_tilt`."""

    of: Literal["x", "y"] = Field(default="x", description="axis of the world that gravity is turned about")


class GravityTilt(Tunable):
    """Angle by which gravity is turned about an axis of the frame of the sensors, which is not quite upright."""

    name = "gravity_tilt"
    order = IN_PLACE
    field = "gravity_tilt_rad"
    unit = "rad"
    lower, upper = -0.05, 0.05
    least, greatest = -0.7, 0.7
    Options = TiltOptions
    options: TiltOptions

    def read(self, world: World) -> float:
        """Return the angle."""
        return world.gravity_tilt_rad["xy".index(self.options.of)]

    def edit(self, world: World, value: float) -> World:
        """Return the world whose gravity is turned by another angle about the axis."""
        about_x, about_y = world.gravity_tilt_rad
        tilt = (float(value), about_y) if self.options.of == "x" else (about_x, float(value))
        return world.edited(self.field, gravity_tilt_rad=tilt)
