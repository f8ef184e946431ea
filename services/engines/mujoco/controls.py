"""The targets of motors in each time step, where the law reads them; and controllers in loops.

All rollouts of a call with loops are stepped together, with one call of the controller in each period.
"""

from collections.abc import Hashable, Sequence

import numpy as np
from numpy.typing import NDArray

from gaplab.services.core.arrays import FloatArray
from gaplab.services.engines.mujoco.model import Structure
from gaplab.services.engines.mujoco.pool import Continued, Pool
from gaplab.services.engines.mujoco.worlds import Delays, Prepared, States
from gaplab.services.engines.stepping import Acting, check_targets, consecutive, tick_steps
from gaplab.services.world.motions import Loop, Motion
from gaplab.services.world.sensing import observations
from gaplab.services.world.world import World

Steps = NDArray[np.int_]


class Controls:
    """The targets of the actuators of a world.

    Args:
        world: world with the structure.
        structure: structure.
    """

    def __init__(self, world: World, structure: Structure) -> None:
        joints = [world.joints.index(joint) for joint in world.actuators]
        self._dofs = consecutive(structure.dofs[joints].tolist())
        self.width = int(structure.model.nv)
        self._world = world
        self._memory = np.zeros(0)

    def of(self, motions: Sequence[Motion], steps: int, delays: Sequence[Delays | None]) -> FloatArray:
        """Return `(n · m, steps, degrees of freedom)`: the targets of n motions in each step, in m worlds.

        They are in the memory of the last call if it is large enough; what no motor drives stays zero in it.

        Raises:
            PluginBroken: the targets of a motion are not those of the actuators.
        """
        controls, now = self.room(len(motions) * len(delays), steps), np.arange(steps)
        for motion, each in zip(motions, controls.reshape(len(motions), len(delays), steps, self.width), strict=True):
            check_targets(motion, self._world)
            at = np.rint(motion.times_s / self._world.time_step_s).astype(int)
            for late, columns in grouped(delays):
                targets = held(at, motion.targets, now, late)
                for column in columns:
                    self.put(each[column], targets)
        return controls

    def room(self, rows: int, steps: int) -> FloatArray:
        """Return an array `(rows, steps, degrees of freedom)`, zero where no motor drives."""
        size = rows * steps * self.width
        if self._memory.size < size:
            self._memory = np.zeros(size)
        return self._memory[:size].reshape(rows, steps, self.width)

    def put(self, controls: FloatArray, targets: FloatArray) -> None:
        """Write targets `(..., a)` into controls `(..., degrees of freedom)`."""
        controls[..., self._dofs] = targets


def held(at: Steps, targets: FloatArray, now: Steps, delays: Delays | None) -> FloatArray:
    """Return `(..., s, a)`: the targets that motors follow in each step.

    Args:
        at: `(k,)`, ascending: steps of the commands.
        targets: `(..., k, a)`: commands.
        now: `(s,)`: steps.
        delays: of the motors; None if they follow at once.
    """
    if delays is None:
        return targets.take(at.searchsorted(now, side="right") - 1, axis=-2)
    latest = at.searchsorted(now[:, None] - np.array(delays.steps), side="right") - 1
    known = targets[..., np.maximum(latest, 0), np.arange(targets.shape[-1])]
    return np.where(latest < 0, delays.first, known)


def grouped(delays: Sequence[Delays | None]) -> list[tuple[Delays | None, list[int] | list[slice]]]:
    """Return the different delays of worlds, each with the indices of the worlds that have it."""
    if all(each is None for each in delays):
        return [(None, [slice(None)])]
    found: dict[int, tuple[Delays | None, list[int]]] = {}
    for column, each in enumerate(delays):
        found.setdefault(id(each), (each, []))[1].append(column)
    return [(each, columns) for each, columns in found.values()]


class Looping:
    """Loops in the worlds of a scene.

    Args:
        pool: MuJoCo.
        states: what a state says.
        controls: where targets go.
    """

    def __init__(self, pool: Pool, states: States, controls: Controls) -> None:
        self._pool = pool
        self._states = states
        self._controls = controls

    def run(
        self, prepared: Sequence[Prepared], loops: Sequence[Loop], kept: Steps, told: FloatArray | None = None
    ) -> FloatArray:
        """Return states `(n · m, t, state)` after the given steps, by loop and world.

        Args:
            prepared: m worlds.
            loops: n loops, which share their function and their times.
            kept: `(t,)`, ascending: steps; the last one ends the rollout.
            told: `(n · m, steps, degrees of freedom)`: zeros, overwritten with the targets in each step; None if nobody
                asks for them.
        """
        run, end = _Run(self._states, prepared, loops), int(kept[-1])
        at = np.array(tick_steps(loops[0], prepared[0].world.time_step_s))
        targets = np.empty((len(run.models), len(at), len(prepared[0].world.actuators)))  # of each call
        delays = grouped([each.delays for each in prepared] * len(loops))
        found = np.empty((len(run.models), len(kept), len(self._states.start)))
        found[:, kept == 0] = run.recent[:, -1:]
        now = Continued(run.recent[:, -1], np.zeros((len(run.models), self._controls.width)))
        with self._pool.sensing(run.models[: len(prepared)]):
            for tick, (begin, then) in enumerate(zip(at, [*np.minimum(at[1:], end), end], strict=True)):
                targets[:, tick] = run.targets(tick)
                if begin == then:
                    continue
                controls = np.zeros((len(run.models), then - begin, self._controls.width))
                for late, columns in delays:
                    for column in columns:
                        given = targets[column, : tick + 1]
                        self._controls.put(controls[column], held(at[: tick + 1], given, np.arange(begin, then), late))
                if told is not None:
                    told[:, begin:then] = controls
                states, now = self._pool.advanced(run.models, now, controls)
                run.see(states)
                inside = (kept > begin) & (kept <= then)
                found[:, inside] = states[:, kept[inside] - begin - 1]
        return found


class _Run:
    """The controllers of a call, and what they observe."""

    def __init__(self, states: States, prepared: Sequence[Prepared], loops: Sequence[Loop]) -> None:
        self.models = [each.model for each in prepared] * len(loops)
        self._states = states
        self._senses = loops[0].senses
        self._acting = Acting([loop for loop in loops for _ in prepared])
        step_s = prepared[0].world.time_step_s
        lags = np.repeat([round(loop.latency_s / step_s) for loop in loops], len(prepared))
        self._length = int(lags.max()) + 1
        self._seen_at = np.arange(len(lags)), self._length - 1 - lags
        self.recent = np.repeat(states.starts(loops, len(prepared))[:, None], self._length, axis=1)
        self._worlds: dict[Hashable, tuple[World, list[int]]] = {}
        for row, each in enumerate([*prepared] * len(loops)):
            self._worlds.setdefault(_looks(each.world), (each.world, []))[1].append(row)

    def see(self, states: FloatArray) -> None:
        """Remember the latest states `(rows, steps, state)`, as far back as they are observed."""
        behind = [self.recent, states] if states.shape[1] < self._length else [states]
        self.recent = np.concatenate(behind, axis=1)[:, -self._length :]

    def targets(self, tick: int) -> FloatArray:
        """Return the targets `(rows, a)` that controllers set now."""
        seen = self.recent[self._seen_at]
        with np.errstate(all="ignore"):  # physics that failed gives nan, or numbers without bounds
            found = [
                observations(world, self._senses, self._states.bearing(seen[rows]))
                for world, rows in self._worlds.values()
            ]
            order = np.argsort(np.concatenate([rows for _, rows in self._worlds.values()]), kind="stable")
            return self._acting.targets(tick, np.concatenate(found)[order])


def _looks(world: World) -> Hashable:
    """Return what observations in worlds of one structure depend on: the slope, and the places of shapes."""
    solids = [body.center_m for body in world.bodies if not isinstance(body.shape, tuple)]
    return world.slope_rad, *solids
