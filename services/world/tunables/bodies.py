"""Tunables of bodies: mass, centre of mass and dimensions."""

from dataclasses import replace
from typing import Literal

import numpy as np
from pydantic import Field

from gaplab.schemas.base import Frozen
from gaplab.services.world.inertias import inertia_of
from gaplab.services.world.kinematics import lowest_m
from gaplab.services.world.tunables.base import (
    ALL,
    SHARES,
    BodyTunable,
    Limits,
    Pattern,
    ScaleOptions,
    Tunable,
    lacking,
    matching,
)
from gaplab.services.world.world import (
    Body,
    Box,
    Capsule,
    Cylinder,
    Hull,
    Inertia,
    Joint,
    Part,
    Shape,
    Sphere,
    Vector,
    World,
)


class Mass(BodyTunable):
    """Mass of bodies, as in `mass(trunk)`; a stated inertia grows with it, for shape and distribution stay."""

    name = "mass"
    field = "body.mass_kg"
    also = frozenset({"moments_kg_m2"})
    value_unit = "kg"
    Options = ScaleOptions
    scale = Limits(0.7, 1.3, 0.01, 100.0)
    value = Limits(0.1, 10.0, 1e-6, 1e6)
    from_the_mean = True

    def number(self, member: Body) -> float:
        """Return the mass of a body."""
        return member.mass_kg

    def with_number(self, member: Body, number: float) -> Body:
        """Return a body of another mass."""
        if member.inertia is None or not member.mass_kg:
            return replace(member, mass_kg=number)
        if number == member.mass_kg:
            return member  # moments, multiplied and divided, could differ by a rounding
        x, y, z = (moment * number / member.mass_kg for moment in member.inertia.moments_kg_m2)
        return replace(member, mass_kg=number, inertia=Inertia((x, y, z), member.inertia.turn))

    def _in_world(self, world: World, members: tuple[Body, ...]) -> World:
        edited = super()._in_world(world, members)
        stated = any(body.inertia is not None for body in self._group(world))
        return edited.edited("body.inertia") if stated else edited


class OfBodies(Tunable):
    """A tunable of the bodies whose names match a pattern."""

    options: "CenterOptions | LengthOptions"

    def lack(self, world: World) -> tuple[str, tuple[str, ...]] | None:
        """Return, if the robot has no such body, a sentence and the names of its bodies."""
        return lacking("body", self.options.of, [body.name for body in world.bodies])

    def _chosen(self, world: World) -> tuple[str, ...]:
        return matching(self.options.of, [body.name for body in world.bodies])


class CenterOptions(Frozen):
    """Options of the tunable `center_of_mass`."""

    of: Pattern = Field(default="*", description=ALL)
    along: Literal["x", "y", "z"] = Field(default="x", description="axis of the body's frame")


class CenterOfMass(OfBodies):
    """Shift of the centre of mass of bodies along an axis of their frame; shape and inertia about the centre stay."""

    name = "center_of_mass"
    field = "body.center_m"
    also = frozenset({"shape", "inertia"})
    unit = "m"
    lower, upper = -0.05, 0.05
    least, greatest = -10.0, 10.0
    relative = True
    order = SHARES
    Options = CenterOptions
    options: CenterOptions

    def read(self, world: World) -> float:  # noqa: ARG002 - a shift is from what is there
        """Return 0."""
        return 0.0

    def edit(self, world: World, value: float) -> World:
        """Return the world with shifted centres of mass."""
        if not value:
            return world
        chosen = self._chosen(world)
        axis = "xyz".index(self.options.along)

        def shifted(body: Body) -> Body:
            if body.name not in chosen:
                return body
            place = list(body.center_m)
            place[axis] += float(value)
            return replace(body, center_m=(place[0], place[1], place[2]))

        parted = _parted(world, chosen)
        return parted.edited(self.field, bodies=tuple(map(shifted, parted.bodies)))


def _parted(world: World, chosen: tuple[str, ...]) -> World:
    """Return the world in which the shapes of bodies do not move with their centres of mass.

    All shifts share it, so that engines build it once.
    """
    if all(isinstance(body.shape, tuple) for body in world.bodies if body.name in chosen):
        return world
    bodies = tuple(
        replace(body, shape=body.parts, inertia=inertia_of(body)) if body.name in chosen else body
        for body in world.bodies
    )
    return replace(world, bodies=bodies, origin=None, edits=frozenset())


class LengthOptions(Frozen):
    """Options of the tunable `length_scale`."""

    of: Pattern = Field(default="*", description=ALL)
    what: Literal["all", "places", "shapes"] = Field(
        default="all",
        description="`places`: of shapes, joints and the centre of mass in the body, like the length of a shin; "
        "`shapes`: their sizes, like the radius of a foot; `all`: both",
    )


class LengthScale(OfBodies):
    """Factor of the dimensions of bodies at the same mass; the robot starts as high above the ground as before.

    A stated inertia grows with the square of the factor, unless only places or shapes are scaled. An engine builds a
    new robot for each value.
    """

    name = "length_scale"
    field = "body.shape"
    also = frozenset({"center_m", "origin_m", "moments_kg_m2", "start_height_m"})
    unit = "1"
    lower, upper = 0.9, 1.1
    least, greatest = 0.05, 20.0
    relative = True
    Options = LengthOptions
    options: LengthOptions

    def read(self, world: World) -> float:  # noqa: ARG002 - a factor is of what is there
        """Return 1."""
        return 1.0

    def edit(self, world: World, value: float) -> World:
        """Return the world with bodies of other dimensions."""
        chosen = self._chosen(world)
        if value == 1.0 or not chosen:
            return world
        factor = float(value)
        bodies = tuple(self._scaled(body, factor) if body.name in chosen else body for body in world.bodies)
        joints = tuple(self._moved(joint, factor) if joint.parent in chosen else joint for joint in world.joints)
        edited = replace(world, bodies=bodies, joints=joints, origin=None, edits=frozenset())
        if world.fixed:
            return edited
        turn = np.array(world.start_turn)
        return replace(edited, start_height_m=world.start_height_m + lowest_m(world, turn) - lowest_m(edited, turn))

    def _scaled(self, body: Body, factor: float) -> Body:
        place = 1.0 if self.options.what == "shapes" else factor
        size = 1.0 if self.options.what == "places" else factor
        shape: Shape | tuple[Part, ...]
        if isinstance(body.shape, tuple):
            shape = tuple(
                replace(part, shape=_sized(part.shape, size), center_m=_times(part.center_m, place))
                for part in body.shape
            )
        else:
            shape = _sized(body.shape, size)
        inertia = body.inertia
        if inertia is not None and self.options.what == "all":
            inertia = Inertia(_times(inertia.moments_kg_m2, factor * factor), inertia.turn)
        return replace(body, shape=shape, center_m=_times(body.center_m, place), inertia=inertia)

    def _moved(self, joint: Joint, factor: float) -> Joint:
        return joint if self.options.what == "shapes" else replace(joint, origin_m=_times(joint.origin_m, factor))


def _times(vector: Vector, factor: float) -> Vector:
    return (vector[0] * factor, vector[1] * factor, vector[2] * factor)


def _sized(shape: Shape, factor: float) -> Shape:
    match shape:
        case Box(size_m=size):
            return Box(_times(size, factor))
        case Sphere(radius_m=radius):
            return Sphere(radius * factor)
        case Capsule(radius_m=radius, length_m=length):
            return Capsule(radius * factor, length * factor)
        case Cylinder(radius_m=radius, length_m=length):
            return Cylinder(radius * factor, length * factor)
        case Hull(points_m=points):
            return Hull(tuple(_times(point, factor) for point in points))
