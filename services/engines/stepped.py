"""The base of engines that advance a scene step by step, what is commanded in which step, and checks of rollouts.

All times are whole time steps. A rollout whose numbers are not physics is nan.
"""

from abc import abstractmethod
from collections.abc import Callable, Iterable, Sequence
from itertools import pairwise
from typing import Protocol, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from gaplab.services.core.arrays import FloatArray, frozen
from gaplab.services.core.errors import PluginBroken
from gaplab.services.engines.base import SceneEngine, Warm
from gaplab.services.engines.energy import energy_of
from gaplab.services.world.controllers.parts import middles
from gaplab.services.world.kinematics import (
    Placed,
    inverse,
    observed_poses,
    placed,
    rotated,
    started,
)
from gaplab.services.world.motions import Loop, Motion, Recording, Trajectory
from gaplab.services.world.sensing import Bearing, gravity_m_s2, observations
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


class Acting:
    """The controllers of n loops, which share their function and their times."""

    def __init__(self, loops: Sequence[Loop]) -> None:
        self._act = loops[0].act
        self._period_s = loops[0].period_s
        self._loops = loops
        self._genomes = np.array([loop.genome for loop in loops])
        self._memories = np.array([loop.memory for loop in loops])

    def targets(self, tick: int, observations: FloatArray) -> FloatArray:
        """Return the targets `(n, a)` of the next call of `act`, number `tick`, with noise; observations have none."""
        noisy = _with(observations, [loop.observation_noise for loop in self._loops], tick)
        targets, self._memories = self._act(self._genomes, noisy, self._memories, tick * self._period_s)
        return _with(targets, [loop.target_noise for loop in self._loops], tick)


def _with(values: FloatArray, noises: Sequence[FloatArray], tick: int) -> FloatArray:
    """Return values `(n, v)` with the noises of one call of `act`."""
    if not any(noise.size for noise in noises):
        return values
    return np.array([row + noise[tick] if noise.size else row for row, noise in zip(values, noises, strict=True)])


class MotionAgenda:
    """The commands of a motion, by the time steps `moments`: a target is commanded only when it changes."""

    def __init__(self, motion: Motion, world: World) -> None:
        check_targets(motion, world)
        changed = np.vstack([np.ones_like(motion.targets[:1], bool), motion.targets[1:] != motion.targets[:-1]])
        rows, actuators = np.nonzero(changed)
        steps = steps_at(motion.times_s[rows], world.time_step_s)
        targets, late = motion.targets[rows, actuators].tolist(), delays(world)
        self._commands = _before(started(world, motion), late)
        for step, actuator, target in zip(steps, actuators.tolist(), targets, strict=True):
            self._commands.setdefault(step + late[actuator], []).append((actuator, target))
        self.moments: Iterable[int] = self._commands

    def commands(self, step: int) -> Commands:
        """Return the targets that change at the start of a time step."""
        return self._commands.get(step, [])


class LoopAgenda:
    """The commands of a controller in a loop.

    Attributes:
        moments: the time steps, from 0, in which `commands` must be called: once in each, ascending.
    """

    def __init__(self, loop: Loop, scene: "SteppedScene") -> None:
        self._acting, self._senses, self._scene, world = Acting([loop]), loop.senses, scene, scene.world
        self._late = delays(world)
        self._commands = _before(started(world, loop), self._late)
        self._ticks: dict[int, list[tuple[int, int]]] = {}
        acts, age = tick_steps(loop, world.time_step_s), round(loop.latency_s / world.time_step_s)
        senses = [max(0, step - age) for step in acts]
        for tick, (step, sensed) in enumerate(zip(acts, senses, strict=True)):
            self._ticks.setdefault(step, []).append((tick, sensed))
        self._seen: dict[int, FloatArray] = {}
        self._sensing = frozenset(senses)
        arriving = {step + late for step in acts for late in self._late}
        self.moments: Iterable[int] = {*acts, *senses, *arriving}

    def commands(self, step: int) -> Commands:
        """Observe and act if it is time; return the targets that arrive in a time step."""
        if step in self._sensing:
            self._seen[step] = self._observed()
        for tick, sensed in self._ticks.get(step, ()):
            targets = self._acting.targets(tick, self._seen[sensed][None])[0].tolist()
            for actuator, (target, late) in enumerate(zip(targets, self._late, strict=True)):
                self._commands.setdefault(step + late, []).append((actuator, target))
        return self._commands.pop(step, [])

    def _observed(self) -> FloatArray:
        scene, pose = self._scene, self._scene.pose()
        looks = pose, rotated(inverse(pose[3:]), scene.spin()), scene.angles(), scene.speeds()
        return np.asarray(observations(scene.world, self._senses, Bearing(*(look[None] for look in looks)))[0])


def _before(world: World, late: Sequence[int]) -> dict[int, Commands]:
    """Return the commands in time step 0 of the actuators that follow their first command later."""
    first = [(actuator, target) for actuator, target in enumerate(middles(world).tolist()) if late[actuator]]
    return {0: first} if first else {}


def consecutive(indices: Sequence[int]) -> slice | list[int]:
    """Return ascending indices, as a slice if each follows the one before: a slice copies nothing."""
    first, last = (indices[0], indices[-1]) if indices else (0, -1)
    return slice(first, last + 1) if list(indices) == list(range(first, last + 1)) else list(indices)


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

    def spin(self) -> FloatArray:
        """Return the angular velocity of the base, `(3,)`, rad/s, along the axes of the world."""

    def encoders(self) -> FloatArray:
        """Return `(7 + 3 · joints,)`: pose, angles, speeds, and torques of the motors in the last step, N·m, or N."""


def watch(
    scene: SteppedScene, advance: Callable[[int], None], motion: Motion | Loop, look: Callable[[], FloatArray]
) -> FloatArray:
    """Run a motion from time 0; return what `look` returns at each observation, `(t, ...)`.

    `advance` advances the scene by a number of time steps.
    """
    world = scene.world
    agenda = LoopAgenda(motion, scene) if isinstance(motion, Loop) else MotionAgenda(motion, world)
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


FARTHEST_M = 100.0
"""Largest plausible distance of the base from its start; beyond it, the rollout failed numerically."""

DEEPEST_M = 1.0
"""Largest plausible depth of the base in the ground."""

LOWEST, HIGHEST = frozen([-FARTHEST_M, -FARTHEST_M, -DEEPEST_M]), frozen([FARTHEST_M] * 3)
"""Open bounds of a plausible position."""


def plausible(poses: FloatArray) -> NDArray[np.bool_]:
    """Return `(...)`: whether all poses `(..., t, 7)` are plausible; nan is not."""
    places = poses[..., :3]
    return np.asarray(((places > LOWEST) & (places < HIGHEST)).all(axis=(-2, -1)))


def trajectory(motion: Motion | Loop, poses: FloatArray, encoders: FloatArray) -> Trajectory:
    """Return a Trajectory of poses `(..., t, 7)`, with encoders `(..., t, 3 · joints)` if the motion asks for them.

    Encoders are those of `SteppedScene`; those of a rollout with a pose of nan are nan.
    """
    if not motion.joints:
        return Trajectory(motion.observe_s, poses[..., :3], poses[..., 3:])
    if np.isnan(poses).any():
        encoders = np.where(np.isnan(poses).any(axis=(-2, -1), keepdims=True), np.nan, encoders)
    count = encoders.shape[-1] // 3
    told = (encoders[..., each * count : (each + 1) * count] for each in range(3))
    return Trajectory(motion.observe_s, poses[..., :3], poses[..., 3:], *told)


def recording(seen: Trajectory, times_s: FloatArray, poses: FloatArray, encoders: FloatArray) -> Recording:
    """Return a Recording of a trajectory, and of base `(k, 7)` and encoders `(k, 3 · joints)` at other times.

    Its poses and angles are nan if any pose of the trajectory is.
    """
    angles, _, torques = np.split(encoders, 3, axis=-1)
    if np.isnan(seen.positions_m).any():
        poses, angles = np.full_like(poses, np.nan), np.full_like(angles, np.nan)
    return Recording(seen, times_s, poses, angles, torques)


Rows = NDArray[np.intp]
S = TypeVar("S", bound=SteppedScene)


class SteppedEngine(SceneEngine[S]):
    """An engine that advances a scene step by step; a scene that failed is dropped.

    Attributes:
        failures: exceptions of the library that mean a numerical failure; such a rollout is nan.
    """

    failures: tuple[type[Exception], ...] = ()

    @abstractmethod
    def _start(self, scene: S, world: World, begun: Placed | None) -> Callable[[int], None]:
        """Set a scene to time 0 of a world; return the function that advances it by a number of time steps.

        Args:
            scene: scene that was built from `world.built(in_place)`.
            world: the world, which `scene.world` is from now on.
            begun: how the robot is; None if it is as the world has it.
        """

    def rollout(self, world: World, motion: Motion | Loop) -> Trajectory:
        """Return the trajectory of the observed body, `(t, 3)`; times are rounded to whole time steps."""
        with self._turn:
            seen = self._run(world, motion, slice(None), motion.joints)
        return trajectory(motion, _observed(world, seen), seen[:, 7:])

    def record(self, world: World, motion: Motion | Loop, times_s: FloatArray) -> Recording:
        """Return the same rollout with joint angles and torques."""
        often = motion.observed_at(np.union1d(motion.observe_s, times_s))
        observed, recorded = (np.searchsorted(often.observe_s, times) for times in (motion.observe_s, times_s))
        with self._turn:
            seen = self._run(world, often, observed, True)
        found = trajectory(motion, _observed(world, seen[observed]), seen[observed, 7:])
        return recording(found, times_s, seen[recorded, :7], seen[recorded, 7:])

    def _run(self, world: World, motion: Motion | Loop, checked: slice | Rows, with_encoders: bool) -> FloatArray:
        """Return poses and angles `(t, 7 + joints)`, or poses and encoders `(t, 7 + 3 · joints)`.

        All is nan if the poses of the checked rows are implausible, or the energy explodes.
        """
        built = world.built(self.in_place)
        scene, able = self._scenes[built], energy_of(built)
        checks_s = able.checks_s(float(motion.observe_s[-1]))
        often = motion.observed_at(np.union1d(motion.observe_s, checks_s))
        asked, checks = (np.searchsorted(often.observe_s, times) for times in (motion.observe_s, checks_s))
        look = scene.encoders if with_encoders else lambda: np.concatenate([scene.pose(), scene.angles()])
        begun = placed(world, motion)
        try:
            watched = watch(scene, self._start(scene, world, begun), often, look)
        except self.failures:
            watched = np.full((len(often.observe_s), 7 + (1 + 2 * with_encoders) * len(world.joints)), np.nan)
        watched[often.observe_s < world.time_step_s / 2, 7 + 2 * len(world.joints) :] = 0.0  # no step has ended yet
        seen, energetic, energy = watched[asked], watched[checks], able.thrown(motion)
        is_plausible = plausible(seen[checked, :7]) and plausible(_observed(world, seen[checked]))
        if not is_plausible or able.explodes(energetic, _angles(world, energetic), gravity_m_s2(world), energy):
            self._scenes.drop(built)  # nan persists in a PhysX scene; Bullet drops bodies that are too far away
            return np.full_like(seen, np.nan)
        return seen


def _angles(world: World, seen: FloatArray) -> FloatArray:
    return seen[:, 7 : 7 + len(world.joints)]


def _observed(world: World, seen: FloatArray) -> FloatArray:
    """Return `(t, 7)`: poses of the observed body, of rows with base and joints."""
    return observed_poses(world, seen[:, :7], _angles(world, seen))
