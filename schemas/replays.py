"""Replays: the motion of a controller as shapes, positions over time and contacts; and the toy function of Fig. 3."""

from enum import StrEnum
from typing import Literal

from pydantic import Field

from gaplab.schemas.base import EngineName, Frozen, Id, Read, RobotName, Statistic, Unit

Position = tuple[float, float, float]
Orientation = tuple[float, float, float, float]
Interval = tuple[float, float]
ShapeKind = Literal["box", "sphere", "capsule", "cylinder", "hull", "plane"]
ShapeRole = Literal["trunk", "limb", "foot", "ground"]


class ControllerKind(StrEnum):
    """Origin of a controller: selected as a sample, or evolved in the best simulator and transferred."""

    SAMPLE = "sample"
    TRANSFER = "transfer"


class Shape(Frozen):
    """A part of the robot, or the ground, in the frame of the body that carries it.

    Sizes are in metres. A box has its three edges. A sphere has its radius. A capsule along z has its radius and the
    distance between the centres of its ends, and a cylinder along z its radius and its length. A convex hull, which has
    vertices and faces, and a plane, with normal z, have none.
    """

    kind: ShapeKind
    size_m: tuple[float, ...] = Field(examples=[(0.3, 0.2, 0.06)])
    position_m: Position = Field((0.0, 0.0, 0.0), description="position of the centre")
    orientation: Orientation = Field((0.0, 0.0, 0.0, 1.0), description="quaternion x, y, z, w")
    role: ShapeRole = Field(
        description="role, which determines the colour; the trunk is the body whose motion fitness rates"
    )
    body: int | None = Field(None, description="index of the body in `bodies`; null: fixed")
    vertices_m: tuple[Position, ...] = Field((), description="vertices of a hull, in its own frame")
    faces: tuple[tuple[int, ...], ...] = Field(
        (),
        description="faces of a hull: indices of `vertices_m`, anticlockwise as seen from outside",
        examples=[((0, 1, 2),)],
    )


class Shown(Frozen):
    """Shapes on their ground, and where they are."""

    shapes: tuple[Shape, ...]
    positions_m: tuple[tuple[float, ...], ...] = Field((), description="by frame: x, y, z of each body in turn")
    orientations: tuple[tuple[float, ...], ...] = Field((), description="by frame: x, y, z, w of each body in turn")
    slope_rad: float = Field(
        0.0, description="angle by which the ground, the plane z = 0, rises along x: gravity is turned by it"
    )
    contacts: tuple[tuple[Interval, ...], ...] = Field(
        (),
        description="by foot: intervals in s during which it is less than 2 mm above the ground; empty: unknown, "
        "as the engine tells no joint angles",
    )


class RobotShapes(Shown):
    """A robot as it stands at the start: a single frame, at 0 s."""

    scale: float = Field(description="its diagonal relative to 0.75 m, for the camera's distance", examples=[0.8])
    middle_m: Position = Field(
        description="the middle of the robot, which the camera looks at", examples=[(0.0, 0.0, 0.1)]
    )


class ReplayWorld(Shown):
    """The motion in one world. If the physics failed, it is empty and its fitness is null."""

    engine: EngineName
    fitness: Statistic = Field(description="fitness in this replay")
    recorded: Statistic = Field(description="stored fitness of the same controller; null: not computed, or failed")
    heights_m: tuple[float, ...] = Field((), description="height of the observed body, by frame")
    speeds_m_s: tuple[float, ...] = Field(
        (), description="speed of the observed body towards its final position, by frame, averaged over 0.2 s"
    )


class ReplayReadings(Frozen):
    """What the sensors of a robot say during one rollout, in simulation and in reality."""

    sensors: tuple[str, ...] = Field(description="names", examples=[("roll", "pitch")])
    units: tuple[str, ...] = Field(examples=[("rad", "rad")])
    noises: tuple[float, ...] = Field(
        description="standard deviation of each sensor's noise, in its unit", examples=[(0.02, 0.02)]
    )
    times_s: tuple[float, ...] = Field(description="times at which all sensors are read", examples=[(0.75, 1.0)])
    simulation: tuple[tuple[Statistic, ...], ...] | None = Field(
        description="values of each sensor, a row each; null: no simulator, or its physics failed",
        examples=[((0.01, 0.03), (0.0, -0.02))],
    )
    reality: tuple[tuple[Statistic, ...], ...] | None = Field(
        description="the measured values, a row each, with null where a sensor failed; null: none were stored",
        examples=[((0.02, 0.05), (0.01, None))],
    )


class Framing(Frozen):
    """How a robot is seen, so that a large one and a small one fill a picture alike."""

    scale: float = Field(
        1.0, description="lengths in the picture, like the camera's distance, relative to those of the quadruped"
    )
    height_m: float = Field(0.12, description="height that the camera looks at")


class Replay(Read):
    """One controller in its simulator and in reality, from the same start."""

    experiment: Id
    repetition: int
    iteration: int
    kind: ControllerKind
    simulator: int | None = Field(description="iteration whose best simulator was used; null: no simulator")
    robot: RobotName
    unit: Unit = Field(description="unit of fitness")
    bodies: tuple[str, ...] = Field(
        description="names of the bodies, the base first", examples=[("trunk", "front_left_shin")]
    )
    feet: tuple[str, ...] = Field(
        description="up to eight outer bodies that collide with the ground; the base is not one",
        examples=[("front left",)],
    )
    observed: int = Field(0, description="index in `bodies` of the body whose motion fitness rates")
    framing: Framing = Framing()
    times_s: tuple[float, ...] = Field(description="times of the frames, up to 20 s", examples=[(0.0, 0.02)])
    counted_s: Interval = Field(description="interval in which movement counts for fitness", examples=[(0.5, 3.0)])
    simulation: ReplayWorld | None = Field(description="null: the controller evolved in reality itself")
    reality: ReplayWorld | None = Field(
        description="null: reality's parameters are unknown here, or reality is hardware, which no replay moves"
    )
    readings: ReplayReadings | None = Field(None, description="null: the robot has no sensors")


class Prediction(Read):
    """Fitness of one sample in the simulators before and after it; null where the physics failed."""

    repetition: int
    iteration: int = Field(description="iteration in which the sample was measured; 0: before the experiment")
    simulated_before: Statistic = Field(
        description="fitness in the best simulator before the measurement; null in iteration 0"
    )
    simulated_after: Statistic = Field(
        description="fitness in the best simulator tuned on this sample and all before it"
    )
    fitness: Statistic = Field(description="fitness in reality; null: the measurement failed")


class Predictions(Read):
    """Predictions of an experiment by repetition and iteration, as far as they are computed.

    Each request computes more: repeat it while some are pending. Held-out samples, which no tuning sees, have none.
    """

    experiment: Id
    unit: Unit
    items: tuple[Prediction, ...]
    pending: int = Field(description="number of samples whose predictions are not computed yet")
    left_out: int = Field(
        0,
        description="number of samples of the last repetitions that are never predicted, because the memory is limited",
    )


class ToySample(Frozen):
    """A gene that was measured in reality."""

    iteration: int
    gene: float
    fitness: float | None = Field(description="null: the measurement failed")


class ToyTransfer(Frozen):
    """The fittest gene in the best simulator, with its fitness in simulation and reality."""

    gene: float
    simulated: float | None
    real: float | None = Field(description="null: not measured yet, or failed")


class ToyIteration(Frozen):
    """The toy function of the paper's Fig. 3 in one iteration of one repetition."""

    experiment: str
    name: str
    repetition: int
    iteration: int
    unit: str = Field(description="unit of fitness")
    genes: tuple[float, ...] = Field(description="genes at which the functions are evaluated")
    truth: tuple[float | None, ...] | None = Field(description="the true function; null while it is hidden")
    approximations: tuple[tuple[float | None, ...], ...] = Field(
        description="the simulators of the iteration, best first"
    )
    squared_error: float | None = Field(description="what tuning minimised, of the best simulator; null: no samples")
    squares: bool = Field(description="whether that is a sum of squares")
    error: float | None = Field(description="error per sample that tuning saw, of the best simulator; null: none")
    samples: tuple[ToySample, ...] = Field(description="samples up to this iteration")
    transfer: ToyTransfer | None
    limits: tuple[float, float] = Field(
        description="range of all fitnesses of the repetition, for the axis of a figure"
    )
