"""Calls of MuJoCo: many rollouts at once, under the law, on any number of threads.

All rollouts of a call with loops are stepped together, with one call of the controller in each period.
"""

from collections.abc import Hashable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from importlib import import_module
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np

from gaplab.services.core.arrays import FloatArray
from gaplab.services.engines.mujoco.callback import Callbacks, callbacks
from gaplab.services.engines.mujoco.worlds import Controls, Memory, Prepared, States, Steps, delayed, grouped, held
from gaplab.services.engines.stepped import Acting, tick_steps
from gaplab.services.world.motions import Loop
from gaplab.services.world.sensing import observations
from gaplab.services.world.world import World


class Continued(NamedTuple):
    """States `(rows, state)` from which rollouts go on, and the last accelerations `(rows, degrees of freedom)`."""

    states: FloatArray
    accelerations: FloatArray


class Pool:
    """Threads that share the rollouts of a call.

    Rollouts are independent: each sets the whole state, and the solver starts from zero in each step.
    """

    def __init__(self, mujoco: ModuleType, model: Any, threads: int) -> None:
        self._mujoco = mujoco
        self.datas = [mujoco.MjData(model) for _ in range(threads)]
        self._size = int(mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS))
        self._channel = mujoco.mjtState.mjSTATE_QFRC_APPLIED.value
        self._sensor_off = int(mujoco.mjtDisableBit.mjDSBL_SENSOR)
        self._callbacks = callbacks()
        self._memory = Memory()
        self._threads = import_module("mujoco.rollout").Rollout(nthread=threads if threads > 1 else 0)

    def rolled(self, models: Sequence[Any], starts: FloatArray, controls: FloatArray) -> FloatArray:
        """Return `(rows, steps, state)`: states after each step; nan where MuJoCo stopped. The next call overwrites it.

        Starts are `(rows, state)`, controls `(rows, steps, degrees of freedom)`.
        """
        states = self._memory(*controls.shape[:2], self._size)
        self._roll(models, starts, controls, None, states, None)
        return states

    def advanced(self, models: Sequence[Any], begin: Continued, controls: FloatArray) -> tuple[FloatArray, Continued]:
        """Return states after each step, and the end, from which another call goes on as if there were no end.

        Models are in `sensing`, controls `(rows, steps, degrees of freedom)`.
        """
        states, felt = np.empty((*controls.shape[:2], self._size)), np.empty(controls.shape)
        self._roll(models, begin.states, controls, begin.accelerations, states, felt)
        return states, Continued(np.ascontiguousarray(states[:, -1]), np.ascontiguousarray(felt[:, -1]))

    @contextmanager
    def sensing(self, models: Sequence[Any]) -> Iterator[None]:
        """Let models sense accelerations, which takes time."""
        for model in models:
            model.opt.disableflags &= ~self._sensor_off
        try:
            yield
        finally:
            for model in models:
                model.opt.disableflags |= self._sensor_off

    def in_force(self) -> AbstractContextManager[None]:
        """Activate the law during a call."""
        return in_force(self._mujoco, self._callbacks)

    def close(self) -> None:
        """End the threads."""
        self._threads.close()

    def _roll(
        self,
        models: Sequence[Any],
        starts: FloatArray,
        controls: FloatArray,
        accelerations: FloatArray | None,
        states: FloatArray,
        felt: FloatArray | None,
    ) -> None:
        try:
            self._threads.rollout(
                models,
                self.datas,
                starts,
                controls,
                control_spec=self._channel,
                skip_checks=True,
                nstep=controls.shape[1],
                initial_warmstart=accelerations,
                state=states,
                sensordata=felt,
            )
        except self._mujoco.FatalError:
            if len(models) == 1:
                states.fill(np.nan)
                return
            for row in range(len(models)):  # each alone, so that no rollout depends on another
                at = slice(row, row + 1)
                begin = None if accelerations is None else accelerations[at]
                self._roll(models[at], starts[at], controls[at], begin, states[at], None if felt is None else felt[at])


@contextmanager
def in_force(mujoco: ModuleType, these: Callbacks) -> Iterator[None]:
    """Activate the law, without warnings; the settings are process-wide, so they are restored."""
    before = mujoco.get_mjcb_control(), mujoco.get_mjcb_time(), mujoco.get_mjcb_sensor()
    with unlogged(mujoco):
        _set(mujoco, these)
        try:
            yield
        finally:
            _set(mujoco, Callbacks(*before))


def _set(mujoco: ModuleType, these: Callbacks) -> None:
    mujoco.set_mjcb_control(these.law)
    mujoco.set_mjcb_time(these.clock)
    mujoco.set_mjcb_sensor(these.sensor)


@contextmanager
def unlogged(mujoco: ModuleType) -> Iterator[None]:
    """Stop MuJoCo from printing warnings or writing them to a file; the setting is process-wide, so it is restored."""
    log, silent = mujoco.MjLogConfig.get(), mujoco.MjLogConfig.get()
    silent.logto_console = silent.logto_file = False
    silent.set()
    try:
        yield
    finally:
        log.set()


class Looping:
    """Loops in the worlds of a scene."""

    def __init__(self, pool: Pool, states: States, controls: Controls) -> None:
        self._pool, self._states, self._controls = pool, states, controls

    def run(
        self, prepared: Sequence[Prepared], loops: Sequence[Loop], kept: Steps, told: FloatArray | None = None
    ) -> FloatArray:
        """Return states `(n · m, t, state)` after the given steps, by loop and world.

        Args:
            prepared: m worlds.
            loops: n loops, which share their function and their times.
            kept: `(t,)`, ascending: steps; the last one ends the rollout.
            told: `(n · m, steps, degrees of freedom)`: overwritten with the targets in each step, if it is given.
        """
        run, end = _Run(self._states, prepared, loops), int(kept[-1])
        known, world = [each.delays for each in prepared], prepared[0].world
        at = np.array(tick_steps(loops[0], world.time_step_s))
        targets = np.empty((len(run.models), len(at), len(world.actuators)))  # of each call
        delays = grouped([each for loop in loops for each in delayed(world, loop, known)])
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
    """Return what observations in worlds of one structure depend on: gravity, ground, biases, and places of shapes."""
    solids = [body.center_m for body in world.bodies if not isinstance(body.shape, tuple)]
    return world.slope_rad, world.gravity_tilt_rad, world.ground_m, world.biases, *solids
