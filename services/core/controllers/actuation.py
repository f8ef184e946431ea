"""What controllers share: the range of each actuator, and where it is on the robot."""

from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from gaplab.services.core.arrays import FloatArray, frozen
from gaplab.services.core.kinematics import body_poses, chain, rotated
from gaplab.services.core.motions import Motion
from gaplab.services.core.world import Joint, PDMotor, World

Gait: TypeAlias = Literal["trot", "pace", "bound", "walk"]

LEAST_APART_M = 1e-6
"""Places that are closer than this, along an axis, are in the same row."""


def follows_angle(joint: Joint) -> bool:
    """Return whether the targets of a joint's motor are angles, not speeds or torques."""
    return not isinstance(joint.motor, PDMotor) or joint.motor.follows == "position"


def middles(world: World) -> FloatArray:
    """Return `(a,)`: the target at which each actuator rests: the start of its joint, or no speed, or no torque."""
    return frozen([joint.start if follows_angle(joint) else 0.0 for joint in world.actuators])


def swings(world: World, amplitude: float = 1.0) -> FloatArray:
    """Return `(a,)`: how far each target usually moves to each side, times an amplitude."""
    return frozen([joint.swing * amplitude for joint in world.actuators])


def sampled(targets: FloatArray, times_s: FloatArray, observe_s: FloatArray) -> Motion:
    """Return the motion of targets `(k, a)` that were sampled at times `(k,)`."""
    targets.setflags(write=False)
    return Motion(times_s, targets, observe_s, every_s=float(times_s[1] if len(times_s) > 1 else observe_s[-1]))


def sampling_times_s(observe_s: FloatArray, every_s: float) -> FloatArray:
    """Return the times from 0, at equal intervals, that are before the last observation, `(k,)`."""
    return frozen(np.arange(np.ceil(observe_s[-1] / every_s - 1e-9)) * every_s)


@dataclass(frozen=True, eq=False)
class Limbs:
    """The limbs of a robot: the chains of joints that begin at its base.

    Attributes:
        limb: `(a,)`: number of the limb of each actuator.
        depth: `(a,)`: number of actuators of the same limb between it and the base.
        places_m: `(limbs, 3)`: place of the first joint of each limb at the start, from the base, along the axes of the
            world.
        upward: `(a,)`: vertical component of the axis of each actuator at the start.
    """

    limb: NDArray[np.int_]
    depth: NDArray[np.int_]
    places_m: FloatArray
    upward: FloatArray

    @classmethod
    def of(cls, world: World) -> "Limbs":
        """Return the limbs of a robot."""
        starts = np.array([[joint.start for joint in world.joints]])
        positions, turns = body_poses(world, np.array([[0.0, 0, 0, *world.start_turn]]), starts)
        places = {body.name: place for place, body in enumerate(world.bodies)}
        roots: list[str] = []
        limb, depth, upward = [], [], []
        for actuator in world.actuators:
            carrying = [world.joints[number] for number in chain(world, actuator.child)]
            root = carrying[-1].child
            roots += [] if root in roots else [root]
            limb.append(roots.index(root))
            depth.append(sum(joint.motor is not None for joint in carrying[1:]))
            upward.append(float(rotated(turns[0, places[actuator.child]], np.array(actuator.axis))[2]))
        at_m = np.array([positions[0, places[root]] for root in roots]).reshape(-1, 3)
        return cls(np.array(limb, dtype=int), np.array(depth, dtype=int), at_m, frozen(upward))

    def phases(self, gait: Gait) -> FloatArray:
        """Return `(limbs,)`: the phase of each limb in a gait, in periods.

        Limbs are in rows from the rear to the front, x, and on the left or the right, y.

        - trot: neighbours are half a period apart: diagonal legs move together, three legs of six,
        - pace: the left and the right side are half a period apart,
        - bound: neighbouring rows are half a period apart,
        - walk: a wave runs from the rear to the front on each side, half a period apart.
        """
        along = np.round(self.places_m[:, 0] / LEAST_APART_M)
        rows, row = np.unique(along, return_inverse=True)
        right = (self.places_m[:, 1] < -LEAST_APART_M).astype(float)
        match gait:
            case "trot":
                return frozen((row + right) % 2 / 2)
            case "pace":
                return frozen(right / 2)
            case "bound":
                return frozen(row % 2 / 2)
            case "walk":
                return frozen(right / 2 + row / (2 * max(len(rows), 1)))
