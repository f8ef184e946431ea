"""What is commanded in which time step: by a motion, or by a controller in a loop. All times are whole time steps."""

from collections.abc import Callable, Iterable, Sequence
from typing import TypeAlias

import numpy as np

from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.controllers.actuation import middles
from gaplab.services.core.errors import PluginBroken
from gaplab.services.core.motions import Loop, Motion
from gaplab.services.core.world import PDMotor, World

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
