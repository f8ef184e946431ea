"""Worlds that differ only in what is set in place: many motions or loops in many of them, each from the same start."""

from collections.abc import Iterator, Sequence
from types import ModuleType

import numpy as np
from numpy.typing import NDArray

from gaplab.services.core.arrays import FloatArray
from gaplab.services.engines.mujoco.controls import Controls, Looping
from gaplab.services.engines.mujoco.law import drive_torques
from gaplab.services.engines.mujoco.pool import Pool
from gaplab.services.engines.mujoco.worlds import TIME, Models, Prepared, States
from gaplab.services.engines.stepped import checked_s, explodes
from gaplab.services.engines.stepping import plausible
from gaplab.services.world.kinematics import observed_poses, observes_base
from gaplab.services.world.motions import Loop, Motion
from gaplab.services.world.sensing import gravity_m_s2
from gaplab.services.world.world import World

ROWS = 64
"""Rollouts per thread in one call of MuJoCo; more would only take memory, 0.1 MB each for the quadruped."""

LOOPING_ROWS = 512
"""Loops in one call of a controller: the more share a call, the less it takes."""


class MuJoCoScene:
    """Worlds that differ only in what is set in place.

    Args:
        mujoco: the library module.
        world: world to build; what is set in place is ignored.
        threads: number of threads that share the rollouts of a call.
    """

    def __init__(self, mujoco: ModuleType, world: World, threads: int) -> None:
        self.world = world
        self.models = Models(mujoco, world)
        self.states = States(mujoco, world, self.models)
        self.controls = Controls(world, self.models.structure)
        self.pool = Pool(mujoco, self.models.structure.model, threads)
        self._rows = ROWS * threads
        self._looping = Looping(self.pool, self.states, self.controls)

    def poses(self, worlds: Sequence[World], motions: Sequence[Motion | Loop]) -> FloatArray:
        """Return `(n, m, t, 7)`: positions and quaternions x, y, z, w of the observed body; nan if physics failed."""
        steps = self.steps(motions[0].observe_s)
        found = np.empty((len(motions), len(worlds), len(steps), 7))
        rows = self._rows if isinstance(motions[0], Motion) else LOOPING_ROWS
        with self.pool.in_force():
            for down in _slices(len(motions), max(1, rows // len(worlds))):
                for across in _slices(len(worlds), rows):
                    seen = self._seen(self.models[worlds[across]], motions[down], steps)
                    found[down, across] = seen.reshape(*found[down, across].shape)
        return found

    def record(
        self, world: World, motion: Motion | Loop, times_s: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the result of `poses`, `(t, 7)`; base and joints at other times, `(k, 7 + joints)`; and torques.

        The torques `(k, joints)`, N·m, are the motors' in the step before; zeros at time 0.
        """
        start, observed, chosen = self.states.starts([motion], 1), self.steps(motion.observe_s), self.steps(times_s)
        steps = max(1, int(observed[-1]))
        (prepared,) = self.models[[world]]
        with self.pool.in_force():
            if isinstance(motion, Motion):
                controls = self.controls.of([motion], steps, [prepared.delays])
                after = self.pool.rolled([prepared.model], start, controls)
            else:
                controls = np.zeros((1, steps, self.controls.width))
                after = self._looping.run([prepared], [motion], np.arange(1, steps + 1), controls)
        states = np.vstack([start, after[0]])
        looked = states[chosen]
        seen = np.hstack([self.states.base(looked), self.states.angles(looked)])
        torques = self._torques(prepared, controls[0], states)[chosen]
        checks = self.steps(checked_s(world, float(motion.observe_s[-1])))
        poses = self._checked([prepared], states[None, observed], states[None, checks], states[None, -1], steps)
        return poses[0], seen, torques

    def close(self) -> None:
        """End the threads."""
        self.pool.close()

    def steps(self, times_s: FloatArray) -> NDArray[np.int_]:
        """Return the time steps at which times are."""
        return np.rint(times_s / self.world.time_step_s).astype(int)

    def _seen(
        self, prepared: Sequence[Prepared], motions: Sequence[Motion | Loop], steps: NDArray[np.int_]
    ) -> FloatArray:
        """Return `(n · m, t, 7)`: poses after the given steps, by motion and world."""
        last, checks = max(1, int(steps[-1])), self.steps(checked_s(self.world, float(motions[0].observe_s[-1])))
        loops = [motion for motion in motions if isinstance(motion, Loop)]
        if loops:
            kept = np.union1d(np.append(steps, last), checks)
            states = self._looping.run(prepared, loops, kept)
            seen, checked = (states[:, np.searchsorted(kept, each)] for each in (steps, checks))
            return self._checked(prepared, seen, checked, states[:, -1], last)
        controls = self.controls.of(
            [motion for motion in motions if isinstance(motion, Motion)], last, [each.delays for each in prepared]
        )
        models = [each.model for each in prepared] * len(motions)
        starts = self.states.starts(motions, len(prepared))
        states = self.pool.rolled(models, starts, controls)
        seen, checked = states[:, steps - 1], states[:, checks - 1]
        seen[:, steps == 0] = checked[:, checks == 0] = starts[:, None]
        return self._checked(prepared, seen, checked, states[:, -1], last)

    def _checked(
        self, prepared: Sequence[Prepared], seen: FloatArray, checked: FloatArray, last: FloatArray, steps: int
    ) -> FloatArray:
        """Return `(rows, t, 7)`: observed poses in states; nan if MuJoCo stopped, or a rollout failed.

        Args:
            prepared: m worlds, to which the rows belong in turns.
            seen: `(rows, t, state)`: states.
            checked: `(rows, c, state)`: states in which energy is checked.
            last: `(rows, state)`: states at the end.
            steps: number of steps until then.
        """
        poses = self.states.base(seen)
        failed = ~((last[:, TIME] > (steps - 0.5) * self.world.time_step_s) & plausible(poses))
        gravity = np.tile([gravity_m_s2(each.world) for each in prepared], (len(seen) // len(prepared), 1))
        failed |= explodes(self.world, self.states.base(checked), self.states.angles(checked), gravity)
        if not observes_base(self.world):
            rows = len(seen) * seen.shape[1]
            angles = self.states.angles(seen).reshape(rows, -1)
            poses = observed_poses(self.world, poses.reshape(rows, 7), angles).reshape(*seen.shape[:2], 7)
            failed |= ~plausible(poses)
        if np.count_nonzero(failed):
            poses[failed] = np.nan
        return poses

    def _torques(self, prepared: Prepared, controls: FloatArray, states: FloatArray) -> FloatArray:
        """Return `(steps + 1, joints)`: torques of the motors before each state; zeros before the first."""
        known = prepared.model.numeric_data
        torques = drive_torques(known, controls, self.states.positions(states), self.states.speeds(states))
        dofs = self.models.structure.dofs
        return np.vstack([np.zeros((1, len(dofs))), torques[:, dofs]])


def _slices(count: int, size: int) -> Iterator[slice]:
    for begin in range(0, count, size):
        yield slice(begin, min(count, begin + size))
