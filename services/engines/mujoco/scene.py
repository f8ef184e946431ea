"""One kind of world with a cached model: many motions in many materials, each from the same start."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from copy import copy
from importlib import import_module
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.motions import Motion
from gaplab.services.core.world import Material, World
from gaplab.services.engines.mujoco.callback import callbacks
from gaplab.services.engines.mujoco.law import drive_torques, settings
from gaplab.services.engines.mujoco.model import compiled, driven, drives, paint
from gaplab.services.engines.stepping import consecutive, plausible

ROWS = 64
"""Rollouts per thread in one call of MuJoCo; more would only take memory, 0.1 MB each for the quadruped."""

TIME, ANGLES = 0, 1
"""Indices into a state: time; positions of all joints, then speeds."""

TURNED_POSE = np.array((1, 2, 3, 5, 6, 7, 4))
"""Indices into a state: the base's pose as in a Trajectory; MuJoCo's quaternions have w first, a Trajectory's last."""


class MuJoCoScene:
    """A world in any material.

    Rollouts are independent: each sets the whole state, and the solver starts from zero in each step.

    Args:
        mujoco: the library module.
        world: world to build; its material is ignored.
        threads: number of threads that share the rollouts of a call.
    """

    def __init__(self, mujoco: ModuleType, world: World, threads: int) -> None:
        self.world = world
        self.model = compiled(mujoco, world)
        self._mujoco = mujoco
        self._callbacks = callbacks()
        self._drives = drives(self.model, world)
        self._dofs = consecutive([drive.dof for drive in self._drives])
        self._driven = consecutive([world.actuators.index(joint) for joint in driven(world)])
        self._angles = [ANGLES + int(self.model.joint(each.name).qposadr[0]) for each in world.joints]
        self._models = [self.model]
        self._datas = [self._data() for _ in range(threads)]
        self._start = self._initial()
        self._starts = np.tile(self._start, (ROWS * threads, 1))
        self._channel = mujoco.mjtState.mjSTATE_QFRC_APPLIED.value
        self._memory, self._targets = np.empty(0), np.zeros(0)
        self._pool = import_module("mujoco.rollout").Rollout(nthread=threads if threads > 1 else 0)

    def poses(self, materials: Sequence[Material], motions: Sequence[Motion]) -> FloatArray:
        """Return `(n, m, t, 7)`: positions and quaternions x, y, z, w of the base; all nan where the physics failed."""
        steps = self._steps(motions[0].observe_s)
        rows = ROWS * len(self._datas)
        found = np.empty((len(motions), len(materials), len(steps), 7))
        with _in_force(self._mujoco, *self._callbacks):
            for down in _slices(len(motions), max(1, rows // len(materials))):
                for across in _slices(len(materials), rows):
                    models = self._painted(materials[across])
                    controls = self._controls(motions[down], max(1, int(steps[-1])), len(models))
                    states = self._rolled(models, controls)
                    found[down, across] = self._seen(states, steps).reshape(-1, len(models), len(steps), 7)
        return found

    def record(
        self, material: Material, motion: Motion, times_s: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the result of `poses`, `(t, 7)`; base and joints at other times, `(k, 7 + joints)`; and torques.

        The torques `(k, joints)`, N·m, are the motors' in the step before; zeros at time 0.
        """
        observed, chosen = self._steps(motion.observe_s), self._steps(times_s)
        with _in_force(self._mujoco, *self._callbacks):
            controls = self._controls([motion], max(1, int(observed[-1])))
            states = self._rolled(self._painted([material]), controls)
        states_with_start = np.vstack([self._start, states[0]])
        looked = states_with_start[chosen]
        torques = self._torques(controls[0], states_with_start)[chosen]
        seen = np.hstack([looked[:, TURNED_POSE], looked[:, self._angles]])
        return self._seen(states, observed)[0], seen, torques

    def close(self) -> None:
        """End the threads."""
        self._pool.close()

    def _steps(self, times_s: FloatArray) -> NDArray[np.int_]:
        return np.rint(times_s / self.world.time_step_s).astype(int)

    def _controls(self, motions: Sequence[Motion], steps: int, copies: int = 1) -> FloatArray:
        """Return `(n · copies, steps, degrees of freedom)`: the targets in each step, where the law reads them.

        They are in the memory of the last call if it is large enough; what no motor drives stays zero in it.
        """
        rows, dofs = len(motions) * copies, int(self.model.nv)
        size = rows * steps * dofs
        if self._targets.size < size:
            self._targets = np.zeros(size)
        controls, now = self._targets[:size].reshape(-1, copies, steps, dofs), np.arange(steps)
        for motion, each in zip(motions, controls, strict=True):
            current = self._steps(motion.times_s).searchsorted(now, side="right") - 1
            each[..., self._dofs] = motion.targets.take(current, axis=0)[:, self._driven]
        return controls.reshape(rows, steps, dofs)

    def _rolled(self, models: list[Any], controls: FloatArray) -> FloatArray:
        """Return `(n · m, steps, state)`: states after each step, by motion and model; nan where MuJoCo stopped.

        Args:
            models: m models.
            controls: `(n · m, steps, degrees of freedom)`, by motion and model.
        """
        count, steps = controls.shape[:2]
        states = self._room(count, steps)
        try:
            self._pool.rollout(
                models * (count // len(models)),
                self._datas,
                self._starts[:count],
                controls,
                control_spec=self._channel,
                skip_checks=True,
                nstep=steps,
                state=states,
            )
        except self._mujoco.FatalError:
            states.fill(np.nan)
        return states

    def _seen(self, states: FloatArray, steps: NDArray[np.int_]) -> FloatArray:
        """Return `(rows, t, 7)`: poses after the given steps; nan if MuJoCo stopped or the pose is implausible."""
        complete = states[:, -1, TIME] > (states.shape[1] - 0.5) * self.world.time_step_s
        poses = states[:, steps[:, None] - 1, TURNED_POSE]
        if not steps[0]:
            poses[:, steps == 0] = self._start[TURNED_POSE]
        failed = ~(complete & plausible(poses))
        if np.count_nonzero(failed):
            poses[failed] = np.nan
        return poses

    def _torques(self, controls: FloatArray, states: FloatArray) -> FloatArray:
        """Return `(steps + 1, joints)`: torques of the motors before each state; zeros before the first."""
        angles = states[:, ANGLES : ANGLES + self.model.nq]
        speeds = states[:, ANGLES + self.model.nq : ANGLES + self.model.nq + self.model.nv]
        torques = drive_torques(self._datas[0].userdata, controls, angles, speeds)
        dofs = [int(self.model.joint(each.name).dofadr[0]) for each in self.world.joints]
        return np.vstack([np.zeros((1, len(dofs))), torques[:, dofs]])

    def _room(self, count: int, steps: int) -> FloatArray:
        """Return an array `(count, steps, state)`, in the memory of the last call if it is large enough."""
        size = count * steps * len(self._start)
        if self._memory.size < size:
            self._memory = np.empty(size)
        return self._memory[:size].reshape(count, steps, -1)

    def _painted(self, materials: Sequence[Material]) -> list[Any]:
        """Return a model for each material: copies that are rewritten in each call, never compiled."""
        while len(self._models) < len(materials):
            self._models.append(copy(self.model))
        models = self._models[: len(materials)]
        for model, material in zip(models, materials, strict=True):
            paint(model, material)
        return models

    def _data(self) -> Any:
        data = self._mujoco.MjData(self.model)
        known = settings(self.world, self.model.nv, self._drives)
        data.userdata[: len(known)] = known
        return data

    def _initial(self) -> FloatArray:
        full = self._mujoco.mjtState.mjSTATE_FULLPHYSICS
        state = np.empty(self._mujoco.mj_stateSize(self.model, full))
        self._mujoco.mj_getState(self.model, self._mujoco.MjData(self.model), state, full)
        return state


def _slices(count: int, size: int) -> Iterator[slice]:
    for begin in range(0, count, size):
        yield slice(begin, min(count, begin + size))


@contextmanager
def _in_force(mujoco: ModuleType, law: Any, clock: Any) -> Iterator[None]:
    """Activate the law, and stop MuJoCo from printing warnings or writing them to a file.

    These settings are process-wide, so they are restored.
    """
    before, log = (mujoco.get_mjcb_control(), mujoco.get_mjcb_time()), mujoco.MjLogConfig.get()
    silent = mujoco.MjLogConfig.get()
    silent.logto_console = silent.logto_file = False
    silent.set()
    mujoco.set_mjcb_control(law)
    mujoco.set_mjcb_time(clock)
    try:
        yield
    finally:
        mujoco.set_mjcb_control(before[0])
        mujoco.set_mjcb_time(before[1])
        log.set()
