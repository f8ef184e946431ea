"""Shared parts of engines that advance step by step: what is commanded in which step, rollouts, and a cache of scenes.

All times are whole time steps.
"""

from collections import OrderedDict
from collections.abc import Callable, Iterable, Sequence
from itertools import pairwise
from typing import Generic, Protocol, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from gaplab.services.core.arrays import FloatArray, frozen
from gaplab.services.core.errors import PluginBroken
from gaplab.services.world.controllers.parts import middles
from gaplab.services.world.motions import Loop, Motion, Recording, Trajectory
from gaplab.services.world.sensing import Bearing, observations
from gaplab.services.world.world import PDMotor, World

Commands: TypeAlias = list[tuple[int, float]]
"""Actuators, and their new targets."""


def steps_at(times_s: FloatArray, time_step_s: float) -> list[int]:
    """Return the time steps at which times `(k,)` are."""
    steps: list[int] = np.rint(times_s / time_step_s).astype(int).tolist()
    return steps


def check_targets(motion: Motion, world: World) -> None:
    """Refuse a motion without exactly one target for each actuator; a world without actuators ignores targets.

    Raises:
        PluginBroken: the motion is of another robot.
    """
    columns, names = motion.targets.shape[1], [joint.name for joint in world.actuators]
    if names and columns != len(names):
        msg = f"the motion has {columns} targets at a time, but the robot has {len(names)} actuators: "
        raise PluginBroken(f"{msg}{', '.join(names)}; give one target for each, in this order")


def delays(world: World) -> list[int]:
    """Return the time steps from a command until the motor follows it, of each actuator."""
    motors = [joint.motor for joint in world.actuators]
    delays_s = [motor.delay_s if isinstance(motor, PDMotor) else 0.0 for motor in motors]
    return steps_at(np.array(delays_s, dtype=float), world.time_step_s)


def tick_steps(loop: Loop, time_step_s: float) -> list[int]:
    """Return the time steps in which a loop's controller acts."""
    return steps_at(np.arange(loop.ticks, dtype=float) * loop.period_s, time_step_s)


def sensed_steps(loop: Loop, time_step_s: float) -> list[int]:
    """Return the time step of what the controller observes at each of its ticks: its latency before the tick."""
    late = round(loop.latency_s / time_step_s)
    return [max(0, step - late) for step in tick_steps(loop, time_step_s)]


class Acting:
    """Controllers of n loops that share their function and their times.

    Args:
        loops: n loops.
    """

    def __init__(self, loops: Sequence[Loop]) -> None:
        self._act = loops[0].act
        self._period_s = loops[0].period_s
        self._loops = loops
        self._genomes = np.array([loop.genome for loop in loops])
        self._memories = np.array([loop.memory for loop in loops])

    def targets(self, tick: int, observations: FloatArray) -> FloatArray:
        """Return the targets `(n, a)` of the next call of `act`, with noise.

        Args:
            tick: number of the call, from 0.
            observations: `(n, s)`, without noise.
        """
        noisy = _with(observations, [loop.observation_noise for loop in self._loops], tick)
        targets, self._memories = self._act(self._genomes, noisy, self._memories, tick * self._period_s)
        return _with(targets, [loop.target_noise for loop in self._loops], tick)


def _with(values: FloatArray, noises: Sequence[FloatArray], tick: int) -> FloatArray:
    """Return values `(n, v)` with the noises of one call of `act`."""
    if not any(noise.size for noise in noises):
        return values
    return np.array([row + noise[tick] if noise.size else row for row, noise in zip(values, noises, strict=True)])


class MotionAgenda:
    """The commands of a motion: a target is commanded only when it changes.

    Args:
        motion: motion.
        world: world that it runs in.

    Attributes:
        moments: the time steps, from 0, with commands.

    Raises:
        PluginBroken: its targets are not those of the world's actuators.
    """

    def __init__(self, motion: Motion, world: World) -> None:
        check_targets(motion, world)
        changed = np.vstack([np.ones_like(motion.targets[:1], bool), motion.targets[1:] != motion.targets[:-1]])
        rows, actuators = np.nonzero(changed)
        steps = steps_at(motion.times_s[rows], world.time_step_s)
        targets, late = motion.targets[rows, actuators].tolist(), delays(world)
        self._commands = _before(world, late)
        for step, actuator, target in zip(steps, actuators.tolist(), targets, strict=True):
            self._commands.setdefault(step + late[actuator], []).append((actuator, target))
        self.moments: Iterable[int] = self._commands

    def commands(self, step: int) -> Commands:
        """Return the targets that change at the start of a time step."""
        return self._commands.get(step, [])


class LoopAgenda:
    """The commands of a controller in a loop.

    Args:
        loop: loop.
        world: world that it runs in.
        observe: function that returns the observations `(s,)` of now.

    Attributes:
        moments: the time steps, from 0, in which `commands` must be called: once in each, ascending.
    """

    def __init__(self, loop: Loop, world: World, observe: Callable[[], FloatArray]) -> None:
        self._acting = Acting([loop])
        self._observe = observe
        self._late = delays(world)
        self._commands = _before(world, self._late)
        self._ticks: dict[int, list[tuple[int, int]]] = {}
        acts, senses = tick_steps(loop, world.time_step_s), sensed_steps(loop, world.time_step_s)
        for tick, (step, sensed) in enumerate(zip(acts, senses, strict=True)):
            self._ticks.setdefault(step, []).append((tick, sensed))
        self._seen: dict[int, FloatArray] = {}
        self._senses = frozenset(senses)
        arriving = {step + late for step in acts for late in self._late}
        self.moments: Iterable[int] = {*acts, *senses, *arriving}

    def commands(self, step: int) -> Commands:
        """Observe and act if it is time; return the targets that arrive in a time step."""
        if step in self._senses:
            self._seen[step] = self._observe()
        for tick, sensed in self._ticks.get(step, ()):
            targets = self._acting.targets(tick, self._seen[sensed][None])[0].tolist()
            for actuator, (target, late) in enumerate(zip(targets, self._late, strict=True)):
                self._commands.setdefault(step + late, []).append((actuator, target))
        return self._commands.pop(step, [])


def _before(world: World, late: Sequence[int]) -> dict[int, Commands]:
    """Return the commands in time step 0 of the actuators that follow their first command later."""
    first = [(actuator, target) for actuator, target in enumerate(middles(world).tolist()) if late[actuator]]
    return {0: first} if first else {}


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
