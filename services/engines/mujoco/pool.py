"""Calls of MuJoCo: many rollouts at once, under the law, on any number of threads."""

from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from importlib import import_module
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np

from gaplab.services.core.arrays import FloatArray
from gaplab.services.engines.mujoco.callback import Callbacks, callbacks
from gaplab.services.engines.mujoco.logs import unlogged


class Continued(NamedTuple):
    """States from which rollouts go on.

    Attributes:
        states: `(rows, state)`.
        accelerations: `(rows, degrees of freedom)`: those of the last step.
    """

    states: FloatArray
    accelerations: FloatArray


class Pool:
    """Threads that share the rollouts of a call.

    Rollouts are independent: each sets the whole state, and the solver starts from zero in each step.

    Args:
        mujoco: the library module.
        model: a model of the structure.
        threads: number of threads.
    """

    def __init__(self, mujoco: ModuleType, model: Any, threads: int) -> None:
        self._mujoco = mujoco
        self.datas = [mujoco.MjData(model) for _ in range(threads)]
        self._size = int(mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS))
        self._channel = mujoco.mjtState.mjSTATE_QFRC_APPLIED.value
        self._sensor_off = int(mujoco.mjtDisableBit.mjDSBL_SENSOR)
        self._callbacks = callbacks()
        self._memory = np.empty(0)
        self._threads = import_module("mujoco.rollout").Rollout(nthread=threads if threads > 1 else 0)

    def rolled(self, models: Sequence[Any], starts: FloatArray, controls: FloatArray) -> FloatArray:
        """Return `(rows, steps, state)`: states after each step; nan where MuJoCo stopped. The next call overwrites it.

        Args:
            models: `rows` models.
            starts: `(rows, state)`.
            controls: `(rows, steps, degrees of freedom)`.
        """
        states = self._room(*controls.shape[:2])
        self._roll(models, starts, controls, None, states, None)
        return states

    def advanced(self, models: Sequence[Any], begin: Continued, controls: FloatArray) -> tuple[FloatArray, Continued]:
        """Return states after each step, and the end, from which another call goes on as if there were no end.

        Args:
            models: `rows` models, in `sensing`.
            begin: where rollouts begin.
            controls: `(rows, steps, degrees of freedom)`.
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

    def _room(self, count: int, steps: int) -> FloatArray:
        """Return an array `(count, steps, state)`, in the memory of the last call if it is large enough."""
        size = count * steps * self._size
        if self._memory.size < size:
            self._memory = np.empty(size)
        return self._memory[:size].reshape(count, steps, self._size)


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
