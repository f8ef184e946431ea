"""A controller's motion as it can be drawn: shapes, where they are over time, and what touches the ground."""

from enum import StrEnum
from typing import Literal

from pydantic import Field

from gaplab.schemas.base import EngineName, Frozen, Id, RobotName, Statistic, Unit

Position = tuple[float, float, float]
Orientation = tuple[float, float, float, float]
Interval = tuple[float, float]


class ControllerKind(StrEnum):
    """Whence a controller comes: selected to be a sample, or evolved in the best simulator and transferred."""

    SAMPLE = "sample"
    TRANSFER = "transfer"


class Shape(Frozen):
    """A part of the robot, or the ground, in the frame of the body that carries it.

    Sizes in metres: of a box its three edges; of a sphere its radius; of a capsule, which lies along its own z, its
    radius and the distance between the centres of its ends; of a plane, whose normal is its own z, nothing.
    """

    kind: Literal["box", "sphere", "capsule", "plane"]
    size_m: tuple[float, ...] = Field(examples=[(0.3, 0.2, 0.06)])
    position_m: Position = Field(default=(0.0, 0.0, 0.0), description="of its centre")
    orientation: Orientation = Field(default=(0.0, 0.0, 0.0, 1.0), description="a quaternion x, y, z, w")
    role: Literal["trunk", "limb", "foot", "ground"] = Field(description="by which it is coloured")
    body: int | None = Field(default=None, description="place of the body in `bodies`; null: it does not move")


class ReplayWorld(Frozen):
    """The motion in one world. Of a motion whose physics failed there is nothing, and its fitness is null."""

    engine: EngineName
    shapes: tuple[Shape, ...]
    fitness: Statistic = Field(description="of this replay")
    recorded: Statistic = Field(description="of the same as it was stored; null: it was not computed, or failed")
    positions_m: tuple[tuple[float, ...], ...] = Field(
        default=(), description="by frame: x, y, z of each body's frame in turn"
    )
    orientations: tuple[tuple[float, ...], ...] = Field(
        default=(), description="by frame: x, y, z, w of each body in turn"
    )
    heights_m: tuple[float, ...] = Field(default=(), description="by frame, of the base")
    speeds_m_s: tuple[float, ...] = Field(
        default=(),
        description="by frame, of the base, towards where it is at the end, over 0.2 s around the frame",
    )
    contacts: tuple[tuple[Interval, ...], ...] = Field(
        default=(), description="by foot: from when to when, in s, it was less than 2 mm above the ground"
    )


class Replay(Frozen):
    """One controller in its simulator and in reality, from the same start."""

    experiment: Id
    repetition: int
    iteration: int
    kind: ControllerKind
    simulator: int | None = Field(description="iteration whose best simulator it is in; null: there is none")
    robot: RobotName
    unit: Unit = Field(description="of fitness")
    bodies: tuple[str, ...] = Field(description="the base first", examples=[("trunk", "front_left_shin")])
    feet: tuple[str, ...] = Field(
        description="the bodies, but for the base, that collide with the ground", examples=[("front left",)]
    )
    times_s: tuple[float, ...] = Field(
        description="of the frames; of a long motion, its first 20 s", examples=[(0.0, 0.02)]
    )
    counted_s: Interval = Field(
        description="from when to when the movement counts for the fitness", examples=[(0.5, 3.0)]
    )
    simulation: ReplayWorld | None = Field(description="null: the controller evolved in reality itself")
    reality: ReplayWorld | None = Field(description="null: reality's parameters are not known here")
