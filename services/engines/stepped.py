"""Base of engines that advance a scene step by step, and the check that no energy explodes in them.

No motor and no fall can make a rollout's energy explode: its numbers are then not physics.
"""

from abc import abstractmethod
from collections.abc import Callable
from functools import lru_cache
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from gaplab.schemas.base import Frozen
from gaplab.services.core.arrays import FloatArray, frozen
from gaplab.services.engines.base import ALL_FIELDS, Engine
from gaplab.services.engines.stepping import SteppedScene, WarmScenes, plausible, recording, watch
from gaplab.services.world.kinematics import chain, clearances_m, observed_poses
from gaplab.services.world.motions import Loop, Motion, Recording, Tilt, Trajectory
from gaplab.services.world.sensing import gravity_m_s2
from gaplab.services.world.world import World

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


Rows = NDArray[np.intp]
S = TypeVar("S", bound=SteppedScene)


class SteppedEngine(Engine, Generic[S]):
    """An engine with one cached scene for all worlds that are built alike; one that failed is dropped.

    A subclass builds scenes and starts them.

    Attributes:
        failures: exceptions of the library that mean a numerical failure; such a rollout is nan.
    """

    honours = ALL_FIELDS
    repeatable = True
    closes_loops = True
    failures: tuple[type[Exception], ...] = ()

    def __init__(self, options: Frozen | None = None) -> None:
        super().__init__(options)
        self._scenes = WarmScenes(self._build)

    @abstractmethod
    def _build(self, world: World) -> S:
        """Build the scene of a world."""

    @abstractmethod
    def _start(self, scene: S, world: World, tilt_rad: Tilt) -> Callable[[int], None]:
        """Set a scene to time 0 of a world; return the function that advances it by a number of time steps.

        Args:
            scene: scene that was built from `world.built(in_place)`.
            world: the world, which `scene.world` is from now on.
            tilt_rad: rotation of the base, about x and y of the world.
        """

    @classmethod
    def runs(cls, world: World) -> bool:
        """Return whether the world has bodies, and exceeds no limit of the engine."""
        return bool(world.bodies) and cls.exceeded(world) is None

    def rollout(self, world: World, motion: Motion | Loop) -> Trajectory:
        """Return the trajectory of the observed body, `(t, 3)`; times are rounded to whole time steps."""
        seen = self._run(world, motion, slice(None))
        poses = _observed(world, seen)
        return Trajectory(motion.observe_s, poses[:, :3], poses[:, 3:])

    def record(self, world: World, motion: Motion | Loop, times_s: FloatArray) -> Recording:
        """Return the same rollout with joint angles and torques."""
        often = motion.observed_at(np.union1d(motion.observe_s, times_s))
        observed, recorded = (np.searchsorted(often.observe_s, times) for times in (motion.observe_s, times_s))
        seen = self._run(world, often, observed, with_torques=True)
        torques = seen[recorded, 7 + len(world.joints) :]
        torques[times_s == 0] = 0.0  # no step has ended yet
        base_and_joints = seen[recorded, : 7 + len(world.joints)]
        return recording(motion, times_s, _observed(world, seen[observed]), base_and_joints, torques)

    def close(self) -> None:
        """Close all scenes."""
        self._scenes.close()

    def _run(
        self, world: World, motion: Motion | Loop, checked: slice | Rows, *, with_torques: bool = False
    ) -> FloatArray:
        """Return poses and angles `(t, 7 + joints)`, or `(t, 7 + 2 · joints)` with torques.

        All is nan if the poses of the checked rows are implausible, or the energy explodes.
        """
        built = world.built(self.in_place)
        scene, checks_s = self._scenes[built], checked_s(world, float(motion.observe_s[-1]))
        often = motion.observed_at(np.union1d(motion.observe_s, checks_s))
        asked, checks = (np.searchsorted(often.observe_s, times) for times in (motion.observe_s, checks_s))
        looks = (scene.pose, scene.angles, scene.torques)[: 2 + with_torques]
        try:
            advance = self._start(scene, world, motion.start_tilt_rad)
            watched = watch(scene, advance, often, lambda: np.concatenate([look() for look in looks]))
        except self.failures:
            watched = np.full((len(often.observe_s), 7 + (1 + with_torques) * len(world.joints)), np.nan)
        seen, energetic = watched[asked], watched[checks]
        is_plausible = plausible(seen[checked, :7]) and plausible(_observed(world, seen[checked]))
        if not is_plausible or explodes(built, energetic, _angles(world, energetic), gravity_m_s2(world)):
            self._scenes.drop(built)  # nan persists in a PhysX scene; Bullet drops bodies that are too far away
            return np.full_like(seen, np.nan)
        return seen


def _angles(world: World, seen: FloatArray) -> FloatArray:
    return seen[:, 7 : 7 + len(world.joints)]


def _observed(world: World, seen: FloatArray) -> FloatArray:
    """Return `(t, 7)`: poses of the observed body, of rows with base and joints."""
    return observed_poses(world, seen[:, :7], _angles(world, seen))
