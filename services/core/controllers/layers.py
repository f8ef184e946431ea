"""What controllers in a loop share: clocks, scales of observations, and sums whose bits do not depend on other rows."""

from collections.abc import Sequence
from math import cos, pi, sin
from typing import Annotated, TypeAlias

import numpy as np
from pydantic import AfterValidator, BeforeValidator, Field

from gaplab.services.core.arrays import FloatArray, frozen
from gaplab.services.core.controllers.actuation import follows_angle
from gaplab.services.core.observations import GROUPS, names
from gaplab.services.core.world import World

SPEED_SCALE, TURNING_SCALE = 10.0, 5.0
"""Speed of a joint, and of the base, in rad/s, that counts as 1: gaplab's choice."""


def _listed(value: object) -> object:
    return [name.strip() for name in value.split(",") if name.strip()] if isinstance(value, str) else value


def _ordered(value: tuple[str, ...]) -> tuple[str, ...]:
    unknown = [name for name in value if name not in GROUPS]
    if unknown:
        raise ValueError(f"unknown group of observations {unknown[0]!r}; permitted: {', '.join(GROUPS)}")
    return tuple(name for name in GROUPS if name in value)


Senses: TypeAlias = Annotated[
    tuple[str, ...], BeforeValidator(_listed), AfterValidator(_ordered), Field(max_length=len(GROUPS))
]
"""An option: groups of observations, separated by commas; they are put into the order of `GROUPS`."""


class Scaling:
    """The scale of observations for a network: about 1 in usual motion.

    Angles count from the joint's start in units of its swing, speeds in 10 rad/s, turning in 5 rad/s.
    """

    def __init__(self, world: World, senses: Sequence[str]) -> None:
        actuators = world.actuators
        angles = [(joint.start, joint.swing if follows_angle(joint) and joint.swing else 1.0) for joint in actuators]
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
