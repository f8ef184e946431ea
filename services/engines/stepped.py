"""Base of engines that advance a scene step by step."""

from abc import abstractmethod
from collections.abc import Callable
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from gaplab.schemas.base import Frozen
from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.kinematics import observed_poses
from gaplab.services.core.motions import Loop, Motion, Recording, Tilt, Trajectory
from gaplab.services.core.observations import gravity_m_s2
from gaplab.services.core.world import World
from gaplab.services.engines.base import ALL_FIELDS, Engine
from gaplab.services.engines.exploding import checked_s, explodes
from gaplab.services.engines.stepping import SteppedScene, WarmScenes, plausible, recording, watch

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
