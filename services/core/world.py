"""What is simulated, in no engine's terms: immutable, edited by `dataclasses.replace`.

SI units throughout; z points up; the ground is the plane z = 0. Lengths of boxes are full edges, not halves.
"""

from dataclasses import dataclass, field
from typing import TypeAlias

from gaplab.services.core.arrays import FloatArray

Vector: TypeAlias = tuple[float, float, float]


@dataclass(frozen=True)
class Material:
    """The surface of the robot *and* of the ground: the paper gives both the same. Source: section 2.

    The coefficients are those of the contact between the two, so an engine that combines two surfaces must see to it
    that their combination is this. A static friction below the dynamic one acts as if it were equal to it.
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
        shape: gives the inertia, and the collision geometry if it collides.
        center_m: of the shape, in the frame of the body (the joint that carries it, or the base).
        collides: with the ground; bodies of one robot never collide with each other.
    """

    name: str
    mass_kg: float
    shape: Shape
    center_m: Vector = (0.0, 0.0, 0.0)
    collides: bool = True


@dataclass(frozen=True)
class Motor:
    """A position servo: a velocity constraint that closes `position_gain` of the error each step, within a torque."""

    position_gain: float
    max_torque_nm: float
    max_speed_rad_s: float = 20.0


@dataclass(frozen=True)
class Joint:
    """A hinge that carries `child`.

    Attributes:
        parent: name of a body; the joint's frame is at `origin_m` in the parent's frame.
        axis: unit vector in that frame.
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
    """Everything an engine needs to know but the motion.

    A world without bodies has only a material: the analytic engine's closed form is all its physics.

    Attributes:
        bodies: the first one is the base; each other one is the child of exactly one joint.
        joints: those with a motor are the actuators, in this order.
        start_height_m: of the base's frame at time 0, at rest, all joints at their zero.
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
        """The joints that a motion drives."""
        return tuple(joint for joint in self.joints if joint.motor is not None)


@dataclass(frozen=True, eq=False)
class Motion:
    """Actuator targets over time, constant between changes.

    Attributes:
        times_s: `(k,)`, ascending from 0: when the targets change.
        targets: `(k, a)`, rad for a hinge: the targets from that time on.
        observe_s: `(t,)`, ascending: when the trajectory is looked at; the last one ends the rollout.
    """

    times_s: FloatArray
    targets: FloatArray
    observe_s: FloatArray


@dataclass(frozen=True, eq=False)
class Trajectory:
    """Where the base was.

    Attributes:
        times_s: `(t,)`, the motion's `observe_s`.
        positions_m: `(..., t, 3)` of the base's frame; leading axes, if any, are motions × worlds. nan throughout where
            the physics failed.
        orientations: `(..., t, 4)` of the base, quaternions x, y, z, w.
    """

    times_s: FloatArray
    positions_m: FloatArray
    orientations: FloatArray


@dataclass(frozen=True, eq=False)
class Recording:
    """A rollout looked at more often than its fitness needs, and in all its joints.

    Attributes:
        trajectory: to the bit what the rollout gives that is not recorded.
        times_s: `(k,)`: when it was looked at.
        poses: `(k, 7)`: position and quaternion x, y, z, w of the base's frame then; nan where the physics failed.
        angles_rad: `(k, joints)`, in the world's order; None from an engine that does not tell them.
    """

    trajectory: Trajectory
    times_s: FloatArray
    poses: FloatArray
    angles_rad: FloatArray | None
