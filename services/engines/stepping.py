"""Shared parts of engines that advance step by step: rollouts in whole time steps, and a cache of scenes."""

from collections import OrderedDict
from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Generic, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from gaplab.services.core.arrays import FloatArray, frozen
from gaplab.services.core.motions import Loop, Motion, Recording, Trajectory
from gaplab.services.core.observations import Bearing, observations
from gaplab.services.core.world import World
from gaplab.services.engines.agenda import LoopAgenda, MotionAgenda, steps_at

WARM_SCENES = 4
"""Largest number of cached scenes. Worlds that differ only in material, or in what is set in place, share a scene."""

FARTHEST_M = 100.0
"""Largest plausible distance of the base from its start; beyond it, the rollout failed numerically."""

DEEPEST_M = 1.0
"""Largest plausible depth of the base in the ground."""

LOWEST, HIGHEST = frozen([-FARTHEST_M, -FARTHEST_M, -DEEPEST_M]), frozen([FARTHEST_M] * 3)
"""Open bounds of a plausible position."""


class Warm(Protocol):
    """A scene that is kept for the next rollout."""

    def close(self) -> None:
        """Release the engine's resources."""


class SteppedScene(Warm, Protocol):
    """A world that advances step by step."""

    @property
    def world(self) -> World:
        """Return the world that the scene is now: that of its last start."""

    def command(self, actuator: int, target: float) -> None:
        """Set a new target for an actuator, in its motor's unit."""

    def pose(self) -> FloatArray:
        """Return `(7,)`: position and quaternion x, y, z, w of the base's frame."""

    def angles(self) -> FloatArray:
        """Return the joint angles `(joints,)`, rad, or m for a joint that slides, in the world's order."""

    def speeds(self) -> FloatArray:
        """Return the joint speeds `(joints,)`, rad/s, or m/s, likewise."""

    def turning(self) -> FloatArray:
        """Return the angular velocity of the base, `(3,)`, rad/s, in its own frame."""

    def torques(self) -> FloatArray:
        """Return the torques of the motors in the last step, `(joints,)`, N·m."""


S = TypeVar("S", bound=Warm)


class WarmScenes(Generic[S]):
    """A cache of scenes by world.

    Args:
        build: function that builds the scene of a world.
    """

    def __init__(self, build: Callable[[World], S]) -> None:
        self._build = build
        self._scenes: OrderedDict[World, S] = OrderedDict()
        self._latest: tuple[World, S] | None = None

    def __getitem__(self, world: World) -> S:
        if self._latest is not None and self._latest[0] == world:  # a hash would take 25 µs
            return self._latest[1]
        scene = self._scenes.pop(world, None) or self._build(world)
        self._scenes[world] = scene
        while len(self._scenes) > WARM_SCENES:
            self._scenes.popitem(last=False)[1].close()
        self._latest = world, scene
        return scene

    def drop(self, world: World) -> None:
        """Drop a broken scene; the next call rebuilds it."""
        self._latest = None
        self._scenes.pop(world).close()

    def close(self) -> None:
        """Close all scenes."""
        self._latest = None
        while self._scenes:
            self._scenes.popitem()[1].close()


def recording(
    motion: Motion | Loop, times_s: FloatArray, poses: FloatArray, seen: FloatArray, torques_nm: FloatArray
) -> Recording:
    """Return a Recording of a rollout; poses, angles and torques are nan if the poses are.

    Args:
        motion: what was run.
        times_s: `(k,)`.
        poses: `(t, 7)`: the trajectory, as `rollout` returns it.
        seen: `(k, 7 + joints)`: base and joints.
        torques_nm: `(k, joints)`.
    """
    if np.isnan(poses).any():
        seen = np.full_like(seen, np.nan)
    trajectory = Trajectory(motion.observe_s, poses[:, :3], poses[:, 3:])
    return Recording(trajectory, times_s, seen[:, :7], seen[:, 7:], torques_nm)


def watch(
    scene: SteppedScene, advance: Callable[[int], None], motion: Motion | Loop, look: Callable[[], FloatArray]
) -> FloatArray:
    """Run a motion or a loop; return what `look` returns at each observation, `(t, ...)`, in whole time steps.

    Args:
        scene: scene at time 0.
        advance: function that advances the scene by a number of time steps.
        motion: what to run.
        look: function that returns the poses of the scene.
    """
    world = scene.world
    agenda = _loop_agenda(motion, scene) if isinstance(motion, Loop) else MotionAgenda(motion, world)
    observed = steps_at(motion.observe_s, world.time_step_s)
    poses: dict[int, FloatArray] = {}
    seen = set(observed)
    moments = [step for step in sorted({0, *agenda.moments, *seen}) if step <= observed[-1]]
    for now, then in pairwise([*moments, moments[-1]]):
        for actuator, target in agenda.commands(now):
            scene.command(actuator, target)
        if now in seen:
            poses[now] = look()
        advance(then - now)
    return np.array([poses[step] for step in observed])


def _loop_agenda(loop: Loop, scene: SteppedScene) -> LoopAgenda:
    def observe() -> FloatArray:
        pose, turning, angles, speeds = scene.pose(), scene.turning(), scene.angles(), scene.speeds()
        bearing = Bearing(pose[None], turning[None], angles[None], speeds[None])
        return np.asarray(observations(scene.world, loop.senses, bearing)[0])

    return LoopAgenda(loop, scene.world, observe)


def plausible(poses: FloatArray) -> NDArray[np.bool_]:
    """Return `(...)`: whether all poses `(..., t, 7)` are plausible; nan is not."""
    places = poses[..., :3]
    return np.asarray(((places > LOWEST) & (places < HIGHEST)).all(axis=(-2, -1)))


def consecutive(indices: Sequence[int]) -> slice | list[int]:
    """Return ascending indices, as a slice if each follows the one before: a slice copies nothing."""
    first, last = (indices[0], indices[-1]) if indices else (0, -1)
    return slice(first, last + 1) if list(indices) == list(range(first, last + 1)) else list(indices)
