"""What engines share that go on step by step: a motion in whole time steps, and scenes that are kept warm."""

from collections import OrderedDict
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from typing import Generic, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.world import Motion, Recording, Trajectory, World

WARM_SCENES = 4
"""Worlds that differ in more than their material are kept warm up to this number; the longest unused one goes."""

FARTHEST_M = 100.0
"""A base that is farther than this from where it started was thrown there by numbers, not by physics: it failed."""

DEEPEST_M = 1.0
"""So was one that is deeper than this in the ground."""


class Warm(Protocol):
    """A world in an engine, kept for the next rollout."""

    def close(self) -> None:
        """Give up what the engine holds for it."""


class Scene(Warm, Protocol):
    """A world that goes on step by step."""

    @property
    def world(self) -> World:
        """What it was built from."""

    def command(self, actuator: int, target: float) -> None:
        """A new target for an actuator, rad."""

    def pose(self) -> FloatArray:
        """`(7,)`: position and quaternion x, y, z, w of the base's frame."""

    def angles(self) -> FloatArray:
        """`(joints,)`, rad, in the world's order."""


S = TypeVar("S", bound=Warm)


class WarmScenes(Generic[S]):
    """The scenes of the latest worlds.

    Args:
        build: makes the scene of a world.
    """

    def __init__(self, build: Callable[[World], S]) -> None:
        self._build = build
        self._scenes: OrderedDict[World, S] = OrderedDict()

    def __getitem__(self, world: World) -> S:
        scene = self._scenes.pop(world, None) or self._build(world)
        self._scenes[world] = scene
        while len(self._scenes) > WARM_SCENES:
            self._scenes.popitem(last=False)[1].close()
        return scene

    def drop(self, world: World) -> None:
        """Give up a scene that was spoilt; the next one of its world is built anew."""
        self._scenes.pop(world).close()

    def close(self) -> None:
        """Give all scenes up."""
        while self._scenes:
            self._scenes.popitem()[1].close()


def watch(scene: Scene, advance: Callable[[int], None], motion: Motion) -> FloatArray:
    """`(t, 7)`: position and quaternion of the base at each observation of a motion; times in whole time steps.

    Args:
        scene: at time 0.
        advance: goes on by so many time steps.
        motion: its targets are commanded when they change, and only those that do.
    """
    return _watch(scene, advance, motion, scene.pose)


def record(
    scene: Scene, advance: Callable[[int], None], motion: Motion, times_s: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """What `watch` sees, `(t, 7)`, and base and joints at other times, `(k, 7 + joints)`.

    Args:
        scene: as of `watch`.
        advance: as of `watch`.
        motion: as of `watch`.
        times_s: `(k,)`, ascending, up to the last observation.
    """
    often = replace(motion, observe_s=np.union1d(motion.observe_s, times_s))
    seen = _watch(scene, advance, often, lambda: np.append(scene.pose(), scene.angles()))
    observed, looked = (np.searchsorted(often.observe_s, each) for each in (motion.observe_s, times_s))
    return seen[observed, :7], seen[looked]


def recording(motion: Motion, times_s: FloatArray, poses: FloatArray, seen: FloatArray) -> Recording:
    """What `record` returned, put together; nan throughout if no physics can have led to the poses."""
    if not plausible(poses):
        poses, seen = np.full_like(poses, np.nan), np.full_like(seen, np.nan)
    trajectory = Trajectory(motion.observe_s, poses[:, :3], poses[:, 3:])
    return Recording(trajectory, times_s, seen[:, :7], seen[:, 7:])


def _watch(scene: Scene, advance: Callable[[int], None], motion: Motion, look: Callable[[], FloatArray]) -> FloatArray:
    commands = _commands(motion, scene.world.time_step_s)
    observed = _steps(motion.observe_s, scene.world.time_step_s)
    poses: dict[int, FloatArray] = {}
    moments = [step for step in sorted({0, *commands, *observed}) if step <= observed[-1]]
    for now, then in pairwise([*moments, moments[-1]]):
        for actuator, target in commands.get(now, ()):
            scene.command(actuator, target)
        if now in observed:
            poses[now] = look()
        advance(then - now)
    return np.array([poses[step] for step in observed])


def plausible(poses: FloatArray) -> NDArray[np.bool_]:
    """`(...)`: whether physics can have led to all of the poses `(..., t, 7)`; nan is not plausible."""
    near = np.all(np.abs(poses[..., :3]) < FARTHEST_M, axis=(-2, -1))
    return np.asarray(near & np.all(poses[..., 2] > -DEEPEST_M, axis=-1))


def _commands(motion: Motion, time_step_s: float) -> dict[int, list[tuple[int, float]]]:
    """By time step: the actuators whose targets change then, with their new targets; at step 0, all of them."""
    changed = np.vstack([np.ones_like(motion.targets[:1], bool), motion.targets[1:] != motion.targets[:-1]])
    rows, actuators = np.nonzero(changed)
    steps, targets = _steps(motion.times_s[rows], time_step_s), motion.targets[rows, actuators].tolist()
    commands: dict[int, list[tuple[int, float]]] = {}
    for step, actuator, target in zip(steps, actuators.tolist(), targets, strict=True):
        commands.setdefault(step, []).append((actuator, target))
    return commands


def _steps(times_s: FloatArray, time_step_s: float) -> list[int]:
    steps: list[int] = np.rint(times_s / time_step_s).astype(int).tolist()
    return steps
