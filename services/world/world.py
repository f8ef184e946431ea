"""Engine-neutral description of what is simulated: immutable, edited by `dataclasses.replace` and `World.edited`.

SI units throughout; lengths of boxes are full edges, not halves; z points up; the ground is the plane z = 0, or
at the height `ground_m` of a world.
"""

from dataclasses import dataclass, field, replace
from functools import cached_property
from math import exp
from typing import Annotated, Any, Literal, NamedTuple, TypeAlias

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
    """A shape on a body: place and rotation of its frame in that of the body, and whether it touches the ground."""

    shape: Shape
    center_m: Vector = ORIGIN
    turn: Quaternion = UNTURNED
    collides: bool = True


MOST_PARTS = 64
"""Largest number of parts of a body."""


@dataclass(frozen=True)
class Material:
    """The material of the robot *and* of the ground, as in the paper. Source: section 2.

    The coefficients are those of the contact. An engine that combines two surfaces must ensure that the result has
    these coefficients. A static friction below the dynamic one acts as if equal to it.
    """

    static_friction: float = 1.0
    dynamic_friction: float = 0.8
    restitution: float = 0.0


@dataclass(frozen=True)
class Inertia:
    """The inertia of a body about its centre of mass: principal moments, and the rotation of their axes in the body."""

    moments_kg_m2: Vector
    turn: Quaternion = UNTURNED


@dataclass(frozen=True)
class Body:
    """A rigid body.

    Attributes:
        shape: one solid shape, whose centre is the centre of mass, or parts, each with its own place.
        center_m: centre of mass, in the frame of the body (that of its joint, or of the base).
        collides: true if the solid shape collides with the ground; each part says so itself. Bodies of a robot never
            collide with each other.
        inertia: inertia; None for that of the solid shape at uniform density.
        surface: name of its surface, if its material is not that of the ground.
    """

    name: str
    mass_kg: float
    shape: Shape | Annotated[tuple[Part, ...], Field(max_length=MOST_PARTS, fail_fast=True)]
    center_m: Vector = ORIGIN
    collides: bool = True
    inertia: Inertia | None = None
    surface: str = ""

    def __post_init__(self) -> None:
        if isinstance(self.shape, tuple) and self.inertia is None:
            raise ValueError(f"the body {self.name!r} consists of parts, so it needs an inertia")

    @cached_property
    def parts(self) -> tuple[Part, ...]:
        """The shapes of the body."""
        if isinstance(self.shape, tuple):
            return self.shape
        return (Part(self.shape, self.center_m, collides=self.collides),)

    @cached_property
    def touches(self) -> bool:
        """Whether any of its shapes collides with the ground."""
        return any(part.collides for part in self.parts)


@dataclass(frozen=True)
class Motor:
    """A position servo: a velocity constraint that closes the share `position_gain` of the error in each step."""

    position_gain: float
    max_torque_nm: float
    max_speed_rad_s: float = 20.0


@dataclass(frozen=True)
class PDMotor:
    """A motor whose torque follows from its target; for a joint that slides, N in place of N·m and m in place of rad.

    With target u, and the angle q and the speed v that the joint has at the end of a time step, its torque is

    - position: kp (u - q) - kd v,
    - velocity: kd (u - v),
    - torque: u,

    each limited to ± `max_torque_nm`. Engines solve for the end of the step as far as they can: such a motor is stable
    at any strength, and gives way by load / kp. Source: gaplab; a linearly implicit Euler step.

    Attributes:
        follows: what its target is.
        kp: N·m/rad.
        kd: N·m·s/rad.
        max_torque_nm: largest torque.
        delay_s: time from a command until the motor follows it, rounded to whole time steps; before, its target is the
            joint's start, or 0 for a velocity or a torque.
    """

    follows: Literal["position", "velocity", "torque"]
    max_torque_nm: float
    kp: float = 0.0
    kd: float = 0.0
    delay_s: float = 0.0


@dataclass(frozen=True)
class Joint:
    """A hinge, or a slide, that carries `child`; a slide has m for rad, N for N·m, and kg for kg m².

    Attributes:
        parent: name of the parent body, in whose frame `origin_m` is.
        axis: unit vector in the child's frame.
        motor: None leaves the joint passive.
        turn: rotation of the child's frame in the parent's frame, with the joint at zero.
        slides: true if the child moves along the axis, false if it turns about it.
        limits: smallest and largest angle, rad; None if it has none.
        damping: torque by speed, N·m·s/rad.
        dry_friction: torque that the joint withstands at rest, and that brakes it in motion, N·m.
        static_friction: torque that it withstands at rest beyond the dry friction, N·m: it sticks.
        stribeck_speed: speed at which a share 1/e of the static friction is left, rad/s.
        armature: inertia of what turns with the joint, seen from the joint, kg m².
        start: angle at time 0, rad.
        swing: how far its motor usually moves it to each side of the start, in the unit of the motor's targets; it is
            for controllers, and physics does not depend on it.
    """

    name: str
    parent: str
    child: str
    origin_m: Vector
    axis: Vector
    motor: Motor | PDMotor | None = None
    turn: Quaternion = UNTURNED
    slides: bool = False
    limits: tuple[float, float] | None = None
    damping: float = 0.0
    dry_friction: float = 0.0
    armature: float = 0.0
    start: float = 0.0
    swing: float = 0.5
    static_friction: float = 0.0
    stribeck_speed: float = 0.1

    @property
    def follows(self) -> Literal["position", "velocity", "torque"]:
        """What the targets of its motor are."""
        return self.motor.follows if isinstance(self.motor, PDMotor) else "position"


@dataclass(frozen=True)
class Noise:
    """Noise and latency of a robot's commands and of what its controller observes.

    Attributes:
        target: standard deviation of each target, in its unit.
        angle_rad: of a joint's angle.
        speed_rad_s: of a joint's speed.
        tilt: of each component of the direction of gravity, of length 1.
        turning_rad_s: of each component of the base's angular velocity.
        start_tilt_rad: of the tilt of the base at time 0, about x and about y.
        latency_s: age of what a controller observes, rounded to whole time steps.
    """

    target: float = 0.0
    angle_rad: float = 0.0
    speed_rad_s: float = 0.0
    tilt: float = 0.0
    turning_rad_s: float = 0.0
    start_tilt_rad: float = 0.0
    latency_s: float = 0.0


Surfaces: TypeAlias = Annotated[tuple[tuple[str, Material], ...], Field(fail_fast=True)]
Biases: TypeAlias = Annotated[tuple[tuple[str, float], ...], Field(fail_fast=True)]


@dataclass(frozen=True)
class World:
    """Everything that an engine needs except the motion.

    A world without bodies has only a material, for the formula of the analytic engine.

    Attributes:
        bodies: bodies; the first is the base, each other one is the child of exactly one joint.
        joints: joints; those with a motor are the actuators, in this order.
        material: material of the ground, and of all bodies without a surface of their own.
        start_height_m: height of the base's frame at time 0, at rest with all joints at their starts.
        start_turn: rotation of the base at time 0.
        fixed: true if the base never moves.
        surfaces: material of each named surface, in contact with the ground.
        slope_rad: angle by which the ground rises along x. The ground stays level; gravity turns.
        noise: noise of commands and observations.
        observed: name of the body whose motion is the trajectory; "" for the base.
        ground_m: height of the ground, in the frame in which sensors tell positions.
        gravity_tilt_rad: rotation of gravity about x and y, besides the slope's: how far that frame is from upright.
        time_offset_s: by how much later than the sensors' clock says the commands of a motion begin; may be negative.
        biases: what is added to the readings of sensors, by name, like `angle NAME` of a joint, in their units.
        origin: world that this one was edited from, in fields that most engines set in place; None if it is as built.
        edits: names of these fields, as in the `honours` of engines.
    """

    bodies: tuple[Body, ...] = ()
    joints: tuple[Joint, ...] = ()
    material: Material = field(default_factory=Material)
    start_height_m: float = 0.0
    gravity_m_s2: float = 9.81
    time_step_s: float = 1 / 120
    solver_iterations: int = 15
    start_turn: Quaternion = UNTURNED
    fixed: bool = False
    surfaces: Surfaces = ()
    slope_rad: float = 0.0
    noise: Noise = Noise()
    observed: str = ""
    ground_m: float = 0.0
    gravity_tilt_rad: tuple[float, float] = (0.0, 0.0)
    time_offset_s: float = 0.0
    biases: Biases = ()
    origin: "World | None" = field(default=None, compare=False, repr=False)
    edits: frozenset[str] = field(default=frozenset(), compare=False, repr=False)

    @property
    def actuators(self) -> tuple[Joint, ...]:
        """Return the joints that a motion drives."""
        return tuple(joint for joint in self.joints if joint.motor is not None)

    @cached_property
    def kind(self) -> "World":
        """The world in the default material: equal for worlds that differ only in their material."""
        return replace(self, material=Material())

    def edited(self, name: str, **changes: Any) -> "World":  # noqa: ANN401 - values of fields
        """Return the world with other values of its fields, which engines may set in place.

        The name is that of the edited field, like `body.mass_kg`.
        """
        return replace(self, **changes, origin=self.origin or self, edits=self.edits | {name})

    def built(self, in_place: frozenset[str]) -> "World":
        """Return the world that an engine builds, in the default material, before it sets the fields in place."""
        if self.origin is None:
            return self.kind
        return self.origin.kind if self.edits <= in_place else self._as_built

    @cached_property
    def _as_built(self) -> "World":
        return replace(self.kind, origin=None, edits=frozenset())


def friction_nm(dry: float, static: float, stribeck_speed: float, speed: float) -> float:
    """Return the largest torque of a joint's friction at a speed: dry + static · exp(-(speed / stribeck_speed)²).

    Source: Armstrong-Hélouvry, Dupont and Canudas de Wit 1994, of the Stribeck effect, with an exponent of 2.
    """
    return dry + static * exp(-((speed / stribeck_speed) ** 2)) if static > 0.0 else dry


STIFFNESS, DAMPING, FEED, STRONGEST = 0, 1, 2, 3
"""Indices into a PDLaw, for compiled code that has its constants in an array."""


class PDLaw(NamedTuple):
    """The torque of a PDMotor: stiffness (u - q) - damping c + feed u, limited to ± strongest; PDLaw() gives none.

    Units are N·m and rad; N and m for a joint that slides.
    """

    stiffness: float = 0.0
    damping: float = 0.0
    feed: float = 0.0
    strongest_nm: float = 0.0


def pd_law(motor: PDMotor, inverse_inertia: float, step_s: float) -> PDLaw:
    """Return the law of a motor of a joint with this inverse inertia, 1/(kg m²): see `inverse_inertias`."""
    kp, kd, strongest = motor.kp, motor.kd, motor.max_torque_nm
    if motor.follows == "torque":
        return PDLaw(0.0, 0.0, 1.0, strongest)
    if motor.follows == "velocity":
        damping = kd / (1.0 + step_s * kd * inverse_inertia)
        return PDLaw(0.0, damping, damping, strongest)
    divisor = 1.0 + step_s * (kd + step_s * kp) * inverse_inertia
    return PDLaw(kp / divisor, (kd + step_s * kp) / divisor, 0.0, strongest)


def pd_torque(target: float, angle: float, coasting: float, law: PDLaw) -> float:
    """Return the torque of a motor in a step, given target and angle at its start; nan if any number is nan.

    Coasting is the speed of the joint at the end of the step without the motor. If all else that moves the joint is
    unknown, it is the speed at the start: then the motor gives way by more than load / kp.
    """
    asked = law.stiffness * (target - angle) - law.damping * coasting + law.feed * target
    if asked > law.strongest_nm:
        return law.strongest_nm
    if asked < -law.strongest_nm:
        return -law.strongest_nm
    return asked
