"""Dimensions of bodies."""

from dataclasses import replace
from typing import Literal

import numpy as np
from pydantic import Field

from gaplab.schemas.base import Frozen
from gaplab.services.core.kinematics import lowest_m
from gaplab.services.core.shapes import Box, Capsule, Cylinder, Hull, Part, Shape, Sphere, Vector
from gaplab.services.core.tunables.base import Tunable, lacking, matching
from gaplab.services.core.tunables.groups import ALL, Pattern
from gaplab.services.core.world import Body, Inertia, Joint, World


class LengthOptions(Frozen):
    """Options of `length_scale`."""

    of: Pattern = Field(default="*", description=ALL)
    what: Literal["all", "places", "shapes"] = Field(
        default="all",
        description="`places`: of shapes, joints and the centre of mass in the body, like the length of a shin; "
        "`shapes`: their sizes, like the radius of a foot; `all`: both",
    )


class LengthScale(Tunable):
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
        chosen = matching(self.options.of, [body.name for body in world.bodies])
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

    def lack(self, world: World) -> tuple[str, tuple[str, ...]] | None:
        """Return that the robot has no such body."""
        return lacking("body", self.options.of, [body.name for body in world.bodies])

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
