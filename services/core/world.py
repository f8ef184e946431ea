"""Engine-neutral description of what is simulated: immutable, edited by `dataclasses.replace`.

SI units throughout; z points up; the ground is the plane z = 0. Lengths of boxes are full edges, not halves.
"""

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TypeAlias

from gaplab.services.core.arrays import FloatArray

Vector: TypeAlias = tuple[float, float, float]


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
class Box:
    """A cuboid with edges `size_m`."""

    size_m: Vector


@dataclass(frozen=True)
class Sphere:
    """A ball."""

    radius_m: float


Shape: TypeAlias = Box | Sphere


@dataclass(frozen=True)
class Body:
    """A rigid body.

    Attributes:
        shape: shape for inertia, and for collisions if it collides.
        center_m: centre of the shape, in the frame of the body (that of its joint, or of the base).
        collides: true if the body collides with the ground; bodies of a robot never collide with each other.
    """

    name: str
    mass_kg: float
    shape: Shape
    center_m: Vector = (0.0, 0.0, 0.0)
    collides: bool = True


@dataclass(frozen=True)
class Motor:
    """A position servo: a velocity constraint that closes the share `position_gain` of the error in each step."""

    position_gain: float
    max_torque_nm: float
    max_speed_rad_s: float = 20.0


@dataclass(frozen=True)
class Joint:
    """A hinge that carries `child`.

    Attributes:
        parent: name of the parent body, in whose frame `origin_m` is.
        axis: unit vector in the parent's frame.
        motor: None leaves the hinge passive.
    """

    name: str
    parent: str
    child: str
    origin_m: Vector
    axis: Vector
    motor: Motor | None = None


@dataclass(frozen=True)
class World:
    """Everything that an engine needs except the motion.

    A world without bodies has only a material, for the formula of the analytic engine.

    Attributes:
        bodies: bodies; the first is the base, each other one is the child of exactly one joint.
        joints: joints; those with a motor are the actuators, in this order.
        start_height_m: height of the base's frame at time 0, at rest with all joints at zero.
    """

    bodies: tuple[Body, ...] = ()
    joints: tuple[Joint, ...] = ()
    material: Material = field(default_factory=Material)
    start_height_m: float = 0.0
    gravity_m_s2: float = 9.81
    time_step_s: float = 1 / 120
    solver_iterations: int = 15

    @property
    def actuators(self) -> tuple[Joint, ...]:
        """Return the joints that a motion drives."""
        return tuple(joint for joint in self.joints if joint.motor is not None)

    @cached_property
    def kind(self) -> "World":
        """The world in the default material: equal for worlds that differ only in their material."""
        return replace(self, material=Material())


@dataclass(frozen=True, eq=False)
class Motion:
    """Actuator targets over time, constant between changes.

    Attributes:
        times_s: `(k,)`, ascending from 0: times at which targets change.
        targets: `(k, a)`, rad for a hinge: targets from each time on.
        observe_s: `(t,)`, ascending: times of observation; the last one ends the rollout.
    """

    times_s: FloatArray
    targets: FloatArray
    observe_s: FloatArray


@dataclass(frozen=True, eq=False)
class Trajectory:
    """The observed motion of the base.

    Attributes:
        times_s: `(t,)`: the motion's `observe_s`.
        positions_m: `(..., t, 3)`: positions of the base's frame; leading axes are motions × worlds. All nan where the
            physics failed.
        orientations: `(..., t, 4)`: orientations of the base, as quaternions x, y, z, w.
    """

    times_s: FloatArray
    positions_m: FloatArray
    orientations: FloatArray


@dataclass(frozen=True, eq=False)
class Recording:
    """A rollout with additional observations and joint angles.

    Attributes:
        trajectory: trajectory, bit-equal to that of the plain rollout.
        times_s: `(k,)`: times of observation.
        poses: `(k, 7)`: positions and quaternions x, y, z, w of the base's frame; nan where the physics failed.
        angles_rad: `(k, joints)`, in the world's order; None if the engine does not provide them.
        torques_nm: `(k, joints)`: torques of the motors in the time step before; None if the engine does not provide
            them.
    """

    trajectory: Trajectory
    times_s: FloatArray
    poses: FloatArray
    angles_rad: FloatArray | None
    torques_nm: FloatArray | None = None
