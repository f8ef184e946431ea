"""Base of engines that advance a scene step by step."""

from abc import abstractmethod
from collections.abc import Callable
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from gaplab.schemas.base import Frozen
from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.kinematics import observed_poses, observes_base
from gaplab.services.core.motions import Loop, Motion, Recording, Tilt, Trajectory
from gaplab.services.core.world import World
from gaplab.services.engines.base import ALL_FIELDS, Engine
from gaplab.services.engines.stepping import SteppedScene, WarmScenes, plausible, recording, watch

Rows = NDArray[np.intp]
S = TypeVar("S", bound=SteppedScene)


class SteppedEngine(Engine, Generic[S]):
    """An engine with one cached scene for all worlds that are built alike; one with implausible poses is dropped.

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
        """Return whether the world has bodies."""
        return bool(world.bodies)

    def rollout(self, world: World, motion: Motion | Loop) -> Trajectory:
        """Return the trajectory of the observed body, `(t, 3)`; times are rounded to whole time steps."""
        seen = self._run(world, motion, slice(None), with_joints=not observes_base(world))
        poses = _observed(world, seen)
        return Trajectory(motion.observe_s, poses[:, :3], poses[:, 3:])

    def record(self, world: World, motion: Motion | Loop, times_s: FloatArray) -> Recording:
        """Return the same rollout with joint angles and torques."""
        often = motion.observed_at(np.union1d(motion.observe_s, times_s))
        observed, recorded = (np.searchsorted(often.observe_s, times) for times in (motion.observe_s, times_s))
        seen = self._run(world, often, observed, with_joints=True)
        torques = seen[recorded, 7 + len(world.joints) :]
        torques[times_s == 0] = 0.0  # no step has ended yet
        base_and_joints = seen[recorded, : 7 + len(world.joints)]
        return recording(motion, times_s, _observed(world, seen[observed]), base_and_joints, torques)

    def close(self) -> None:
        """Close all scenes."""
        self._scenes.close()

    def _run(self, world: World, motion: Motion | Loop, checked: slice | Rows, *, with_joints: bool) -> FloatArray:
        """Return `(t, 7)`, or `(t, 7 + 2 · joints)` with angles and torques.

        All is nan if the poses of the checked rows are implausible.
        """
        built = world.built(self.in_place)
        scene = self._scenes[built]
        look = (lambda: _joints_too(scene)) if with_joints else scene.pose
        try:
            seen = watch(scene, self._start(scene, world, motion.start_tilt_rad), motion, look)
        except self.failures:
            seen = np.full((len(motion.observe_s), 7 + with_joints * 2 * len(world.joints)), np.nan)
        if not (plausible(seen[checked, :7]) and plausible(_observed(world, seen[checked]))):
            self._scenes.drop(built)  # nan persists in a PhysX scene; Bullet drops bodies that are too far away
            return np.full_like(seen, np.nan)
        return seen


def _joints_too(scene: SteppedScene) -> FloatArray:
    """Return pose, angles and torques of a scene, `(7 + 2 · joints,)`."""
    return np.concatenate([scene.pose(), scene.angles(), scene.torques()])


def _observed(world: World, seen: FloatArray) -> FloatArray:
    """Return `(t, 7)`: poses of the observed body, of rows with base and joints."""
    return observed_poses(world, seen[:, :7], seen[:, 7 : 7 + len(world.joints)])
