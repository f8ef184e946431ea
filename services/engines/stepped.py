"""Base of engines that advance a scene step by step."""

from abc import abstractmethod
from collections.abc import Callable
from dataclasses import replace
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from gaplab.schemas.base import Frozen
from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.motions import Motion, Recording, Trajectory
from gaplab.services.core.world import Material, World
from gaplab.services.engines.base import ALL_FIELDS, Engine
from gaplab.services.engines.stepping import SteppedScene, WarmScenes, plausible, recording, watch

Rows = NDArray[np.intp]
S = TypeVar("S", bound=SteppedScene)


class SteppedEngine(Engine, Generic[S]):
    """An engine with one cached scene for each kind of world; a scene whose poses were implausible is dropped.

    A subclass builds scenes and starts them.

    Attributes:
        failures: exceptions of the library that mean a numerical failure; such a rollout is nan.
    """

    honours = ALL_FIELDS
    repeatable = True
    failures: tuple[type[Exception], ...] = ()

    def __init__(self, options: Frozen | None = None) -> None:
        super().__init__(options)
        self._scenes = WarmScenes(self._build)

    @abstractmethod
    def _build(self, world: World) -> S:
        """Build the scene of a world."""

    @abstractmethod
    def _start(self, scene: S, material: Material) -> Callable[[int], None]:
        """Set a scene to time 0 in a material; return the function that advances it by a number of time steps."""

    @classmethod
    def runs(cls, world: World) -> bool:
        """Return whether the world has bodies."""
        return bool(world.bodies)

    def rollout(self, world: World, motion: Motion) -> Trajectory:
        """Return the trajectory of the base, `(t, 3)`; times are rounded to whole time steps."""
        poses = self._run(world, motion, slice(None), with_angles=False)
        return Trajectory(motion.observe_s, poses[:, :3], poses[:, 3:])

    def record(self, world: World, motion: Motion, times_s: FloatArray) -> Recording:
        """Return the same rollout with joint angles and torques."""
        often = replace(motion, observe_s=np.union1d(motion.observe_s, times_s))
        observed, recorded = (np.searchsorted(often.observe_s, times) for times in (motion.observe_s, times_s))
        seen = self._run(world, often, observed, with_angles=True)
        torques = seen[recorded, 7 + len(world.joints) :]
        torques[times_s == 0] = 0.0  # no step has ended yet
        base_and_joints = seen[recorded, : 7 + len(world.joints)]
        return recording(motion, times_s, seen[observed, :7], base_and_joints, torques)

    def close(self) -> None:
        """Close all scenes."""
        self._scenes.close()

    def _run(self, world: World, motion: Motion, checked: slice | Rows, *, with_angles: bool) -> FloatArray:
        """Return `(t, 7)`, or `(t, 7 + 2 · joints)` with angles and torques.

        All is nan if the poses of the checked rows are implausible.
        """
        scene = self._scenes[world.kind]
        look = (lambda: _joints_too(scene)) if with_angles else scene.pose
        try:
            seen = watch(scene, self._start(scene, world.material), motion, look)
        except self.failures:
            seen = np.full((len(motion.observe_s), 7 + with_angles * 2 * len(world.joints)), np.nan)
        if not plausible(seen[checked, :7]):
            self._scenes.drop(world.kind)  # nan persists in a PhysX scene; Bullet drops bodies that are too far away
            return np.full_like(seen, np.nan)
        return seen


def _joints_too(scene: SteppedScene) -> FloatArray:
    """Return pose, angles and torques of a scene, `(7 + 2 · joints,)`."""
    return np.concatenate([scene.pose(), scene.angles(), scene.torques()])
