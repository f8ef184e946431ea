"""What controllers share: the range of each actuator, and where it is on the robot; and what those in a loop share.

These are clocks, scales of observations, and sums whose bits do not depend on other rows.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, pi, sin
from typing import Annotated, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, BeforeValidator, Field

from gaplab.services.core.arrays import FloatArray, frozen
from gaplab.services.core.registry import listed
from gaplab.services.world.kinematics import body_poses, chain, rotated
from gaplab.services.world.motions import Motion
from gaplab.services.world.sensing import GROUPS, in_order, names
from gaplab.services.world.world import World

Gait: TypeAlias = Literal["trot", "pace", "bound", "walk"]

LEAST_APART_M = 1e-6
"""Places that are closer than this, along an axis, are in the same row."""


def middles(world: World) -> FloatArray:
    """Return `(a,)`: the target at which each actuator rests: the start of its joint, or no speed, or no torque."""
    return frozen([joint.start if joint.follows == "position" else 0.0 for joint in world.actuators])


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


SPEED_SCALE, TURNING_SCALE = 10.0, 5.0
"""Speed of a joint, and of the base, in rad/s, that counts as 1: gaplab's choice."""


Senses: TypeAlias = Annotated[
    tuple[str, ...],
    BeforeValidator(listed),
    AfterValidator(lambda each: in_order(each, GROUPS, "observations")),
    Field(max_length=len(GROUPS)),
]
"""An option: groups of observations, separated by commas; they are put into the order of `GROUPS`."""


class Scaling:
    """The scale of observations for a network: about 1 in usual motion.

    Angles count from the joint's start in units of its swing, speeds in 10 rad/s, turning in 5 rad/s.
    """

    def __init__(self, world: World, senses: Sequence[str]) -> None:
        actuators = world.actuators
        angles = [(each.start, each.swing if each.follows == "position" and each.swing else 1.0) for each in actuators]
        of_group = {
            "angles": angles,
            "speeds": [(0.0, SPEED_SCALE)] * len(actuators),
            "turning": [(0.0, TURNING_SCALE)] * 3,
        }
        pairs = [pair for sense in senses for pair in of_group.get(sense, [(0.0, 1.0)] * len(names(world, [sense])))]
        self.size = len(pairs)
        self._middles, self._scales = frozen([pair[0] for pair in pairs]), frozen([pair[1] for pair in pairs])

    def __call__(self, observations: FloatArray) -> FloatArray:
        """Return observations `(n, s)` in units of their scales."""
        return (observations - self._middles) / self._scales


def clock(time_s: float, period_s: float) -> tuple[float, ...]:
    """Return sine and cosine of the time; nothing if the period is 0."""
    angle = 2 * pi * time_s / period_s if period_s else 0.0
    return (sin(angle), cos(angle)) if period_s else ()


def with_constants(values: FloatArray, constants: Sequence[float]) -> FloatArray:
    """Return values `(n, v)` with the same numbers at the end of each row."""
    return np.hstack([values, np.broadcast_to(np.array(constants, dtype=float), (len(values), len(constants)))])


def weighted(weights: FloatArray, values: FloatArray) -> FloatArray:
    """Return `(n, o)`: the sums of values `(n, i)` times weights `(n, o, i)`.

    Unlike a product of matrices, a row has the same bits whatever n is: each sum runs over adjacent numbers.
    """
    return np.asarray(np.multiply(weights, values[:, None, :], order="C").sum(axis=2))
