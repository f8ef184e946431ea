"""Shapes of bodies, and their places. SI units; lengths of boxes are full edges, not halves."""

from dataclasses import dataclass, field
from typing import Annotated, Literal, TypeAlias

from pydantic import Field

Vector: TypeAlias = tuple[float, float, float]

Quaternion: TypeAlias = tuple[float, float, float, float]
"""A rotation as x, y, z, w, of length 1."""

ORIGIN: Vector = (0.0, 0.0, 0.0)
UNTURNED: Quaternion = (0.0, 0.0, 0.0, 1.0)

MOST_VERTICES = 64
"""Largest number of vertices of a hull, that all engines accept."""


@dataclass(frozen=True)
class Box:
    """A cuboid with edges `size_m`."""

    size_m: Vector
    kind: Literal["box"] = field(default="box", kw_only=True, repr=False)


@dataclass(frozen=True)
class Sphere:
    """A ball."""

    radius_m: float
    kind: Literal["sphere"] = field(default="sphere", kw_only=True, repr=False)


@dataclass(frozen=True)
class Capsule:
    """A cylinder along z with half a ball at each end; `length_m` is the cylinder's."""

    radius_m: float
    length_m: float
    kind: Literal["capsule"] = field(default="capsule", kw_only=True, repr=False)


@dataclass(frozen=True)
class Cylinder:
    """A cylinder along z."""

    radius_m: float
    length_m: float
    kind: Literal["cylinder"] = field(default="cylinder", kw_only=True, repr=False)


@dataclass(frozen=True)
class Hull:
    """The convex hull of points, of which there are at most `MOST_VERTICES`."""

    points_m: Annotated[tuple[Vector, ...], Field(max_length=MOST_VERTICES, fail_fast=True)]
    kind: Literal["hull"] = field(default="hull", kw_only=True, repr=False)


Shape: TypeAlias = Annotated[Box | Sphere | Capsule | Cylinder | Hull, Field(discriminator="kind")]
"""A solid shape; its `kind` says in a robot file which it is."""


@dataclass(frozen=True)
class Part:
    """A shape on a body.

    Attributes:
        center_m: place of the shape's frame, in the frame of the body.
        turn: rotation of the shape's frame.
        collides: true if it collides with the ground.
    """

    shape: Shape
    center_m: Vector = ORIGIN
    turn: Quaternion = UNTURNED
    collides: bool = True
