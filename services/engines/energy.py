"""Which rollouts are not physics: no motor and no fall can make their energy explode."""

from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from gaplab.services.core.arrays import FloatArray, frozen
from gaplab.services.world.kinematics import chain, clearances_m, placed
from gaplab.services.world.motions import Loop, Motion
from gaplab.services.world.world import World

CHECKED_S = 0.1
"""Interval of the checks: what shakes faster moves no robot."""

LEAST_PULL_M_S2 = 9.81
"""Smallest gravity by which a robot's own size counts as a fall."""

_TURNS = frozen(
    [[0, 0, 0, 1], [1, 0, 0, 0], *(np.array([[1, 0, 0, 1], [-1, 0, 0, 1], [0, 1, 0, 1], [0, -1, 0, 1]]) / 2**0.5)]
)
"""Rotations that turn each side of a body down."""


class Energy:
    """The energy that the base of a robot can have, in worlds that are built alike, with any masses and motors."""

    def __init__(self, world: World) -> None:
        self._world = world
        self._interval_s = max(1, round(CHECKED_S / world.time_step_s)) * world.time_step_s

    def checks_s(self, end_s: float) -> FloatArray:
        """Return the times `(c,)` of the checks in a rollout, whole time steps apart; none if the base is fixed."""
        times_s = np.arange(0.0, 0.0 if self._world.fixed else end_s, self._interval_s)
        return times_s[times_s <= end_s]

    def thrown(self, motion: Motion | Loop) -> float:
        """Return the energy when a motion begins, by the mass, m²/s²: all of it may become the base's."""
        begun = None if motion.start is None else placed(self._world, motion)
        if begun is None:
            return 0.0
        swept = (np.abs(begun.speeds_rad_s) @ self.levers_m[:, 1:].T).max()
        turned = np.linalg.norm(begun.turning_rad_s) * self.levers_m[:, 0].max()
        return float(np.linalg.norm(begun.velocity_m_s) + turned + swept) ** 2 / 2

    def explodes(
        self,
        poses: FloatArray,
        angles_rad: FloatArray,
        gravity_m_s2: FloatArray,
        thrown_m2_s2: FloatArray | float = 0.0,
    ) -> NDArray[np.bool_]:
        """Return `(...)`: whether the base has more energy than its start, its fall and its joints can have given it.

        A robot pushes itself off at most as fast as its joints sweep its feet past the base, and may fall over its own
        size. Joints that only shake, since their motors are too strong for an engine, sweep nothing.

        Args:
            poses: `(..., c, ≥ 3)`: positions of the base at the checks, and more.
            angles_rad: `(..., c, joints)`, likewise.
            gravity_m_s2: `(..., 3)`.
            thrown_m2_s2: `(...)`: energy at the start, by mass: see `thrown`.
        """
        levers_m, interval_s = self.levers_m, self._interval_s
        with np.errstate(all="ignore"):  # physics that failed gives nan, or numbers without bounds
            speeds = np.linalg.norm(np.diff(poses[..., :3], axis=-2), axis=-1) / interval_s
            fallen = ((poses[..., 1:, :3] - poses[..., :1, :3]) @ gravity_m_s2[..., None])[..., 0]
            swept = (np.abs(np.diff(angles_rad, axis=-2)) @ levers_m[:, 1:].T).max(axis=-1) / interval_s
            pushed = np.maximum.accumulate(swept, axis=-1) ** 2 / 2
            pull = np.maximum(np.linalg.norm(gravity_m_s2, axis=-1), LEAST_PULL_M_S2)[..., None]
            given = pull * levers_m[:, 0].max() + np.asarray(thrown_m2_s2)[..., None]
            return np.asarray((speeds**2 / 2 > fallen + pushed + given).any(axis=-1))

    @cached_property
    def levers_m(self) -> FloatArray:
        """How far each body reaches, outstretched, from the base and from each joint: `(bodies, 1 + joints)`.

        It is 0 from a joint that does not carry the body, and 1 from one that slides.
        """
        world = self._world
        levers_m = np.zeros((len(world.bodies), 1 + len(world.joints)))
        for row, body in zip(levers_m, world.bodies, strict=True):
            length_m = -float(clearances_m(body, np.zeros((len(_TURNS), 3)), _TURNS).min()) if body.parts else 0.0
            for number in chain(world, body.name):
                joint = world.joints[number]
                row[1 + number] = 1.0 if joint.slides else length_m
                length_m += float(np.linalg.norm(joint.origin_m))
            row[0] = length_m
        return frozen(levers_m)


energy_of = lru_cache(Energy)
"""The energy of a world, kept: a hash takes less time than `levers_m`."""
