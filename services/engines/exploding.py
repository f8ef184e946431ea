"""Whether the energy of a rollout explodes, as no motor and no fall can make it: then its numbers are not physics."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from gaplab.services.core.arrays import FloatArray, frozen
from gaplab.services.core.kinematics import chain, clearances_m
from gaplab.services.core.world import World

CHECKED_S = 0.1
"""Interval of the checks: what shakes faster moves no robot."""

LEAST_PULL_M_S2 = 9.81
"""Smallest gravity by which a robot's own size counts as a fall."""

_TURNS = frozen(
    [[0, 0, 0, 1], [1, 0, 0, 0], *(np.array([[1, 0, 0, 1], [-1, 0, 0, 1], [0, 1, 0, 1], [0, -1, 0, 1]]) / 2**0.5)]
)
"""Rotations that turn each side of a body down."""


def checked_s(world: World, end_s: float) -> FloatArray:
    """Return the times `(c,)` of the checks in a rollout, whole time steps apart; none if the base is fixed."""
    times_s = np.arange(0.0, 0.0 if world.fixed else end_s, _interval_s(world))
    return times_s[times_s <= end_s]


def explodes(world: World, poses: FloatArray, angles_rad: FloatArray, gravity_m_s2: FloatArray) -> NDArray[np.bool_]:
    """Return `(...)`: whether the base has more energy than its fall and its joints can have given it.

    A robot pushes itself off at most as fast as its joints sweep its feet past the base, and may fall over its own
    size. Joints that only shake, since their motors are too strong for an engine, sweep nothing.

    Args:
        world: world as an engine built it, with any masses and motors.
        poses: `(..., c, ≥ 3)`: positions of the base at the checks, and more.
        angles_rad: `(..., c, joints)`, likewise.
        gravity_m_s2: `(..., 3)`.
    """
    levers_m, interval_s = _levers_m(world), _interval_s(world)
    with np.errstate(all="ignore"):  # physics that failed gives nan, or numbers without bounds
        speeds = np.linalg.norm(np.diff(poses[..., :3], axis=-2), axis=-1) / interval_s
        fallen = ((poses[..., 1:, :3] - poses[..., :1, :3]) @ gravity_m_s2[..., None])[..., 0]
        swept = (np.abs(np.diff(angles_rad, axis=-2)) @ levers_m[:, 1:].T).max(axis=-1) / interval_s
        pushed = np.maximum.accumulate(swept, axis=-1) ** 2 / 2
        pull = np.maximum(np.linalg.norm(gravity_m_s2, axis=-1), LEAST_PULL_M_S2)[..., None]
        return np.asarray((speeds**2 / 2 > fallen + pushed + pull * levers_m[:, 0].max()).any(axis=-1))


def _interval_s(world: World) -> float:
    return max(1, round(CHECKED_S / world.time_step_s)) * world.time_step_s


@lru_cache
def _levers_m(world: World) -> FloatArray:
    """Return `(bodies, 1 + joints)`: how far each body reaches, outstretched, from the base and from each joint.

    It is 0 from a joint that does not carry the body, and 1 from one that slides.
    """
    levers_m = np.zeros((len(world.bodies), 1 + len(world.joints)))
    for row, body in zip(levers_m, world.bodies, strict=True):
        length_m = -float(clearances_m(body, np.zeros((len(_TURNS), 3)), _TURNS).min()) if body.parts else 0.0
        for number in chain(world, body.name):
            joint = world.joints[number]
            row[1 + number] = 1.0 if joint.slides else length_m
            length_m += float(np.linalg.norm(joint.origin_m))
        row[0] = length_m
    return frozen(levers_m)
