"""The MuJoCo engine: worlds are grouped by what is compiled, and the rollouts of a group run in one call."""

from collections.abc import Iterator, Sequence
from importlib import import_module
from importlib.util import find_spec
from types import ModuleType
from typing import Annotated

import numpy as np
from pydantic import Field

from gaplab.schemas.base import Frozen
from gaplab.services.core.arrays import FloatArray
from gaplab.services.engines.base import USUALLY_IN_PLACE, SceneEngine
from gaplab.services.engines.mujoco.law import drive_torques
from gaplab.services.engines.mujoco.pool import Looping, Pool
from gaplab.services.engines.mujoco.worlds import TIME, Controls, Models, Prepared, States, Steps
from gaplab.services.engines.stepped import checked_s, consecutive, explodes, plausible, recording
from gaplab.services.world.kinematics import observed_poses, observes_base
from gaplab.services.world.motions import Loop, Motion, Recording, Trajectory
from gaplab.services.world.sensing import gravity_m_s2
from gaplab.services.world.world import World

ROWS = 64
"""Rollouts per thread in one call of MuJoCo; more would only take memory, 0.1 MB each for the quadruped."""

LOOPING_ROWS = 512
"""Loops in one call of a controller: the more share a call, the less it takes."""


class MuJoCoScene:
    """Worlds that differ only in what is set in place; threads share the rollouts of a call."""

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
        found = np.empty((len(motions), len(worlds), len(motions[0].observe_s), 7))
        rows = self._rows if isinstance(motions[0], Motion) else LOOPING_ROWS
        with self.pool.in_force():
            for down in _slices(len(motions), max(1, rows // len(worlds))):
                for across in _slices(len(worlds), rows):
                    seen = self._seen(self.models[worlds[across]], motions[down])
                    found[down, across] = seen.reshape(*found[down, across].shape)
        return found

    def record(
        self, world: World, motion: Motion | Loop, times_s: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the result of `poses`, `(t, 7)`; base and joints at other times, `(k, 7 + joints)`; and torques.

        The torques `(k, joints)`, N·m, are the motors' in the step before; zeros at time 0.
        """
        prepared, kept = self.models[[world]], np.arange(max(1, int(self.steps(motion.observe_s)[-1])) + 1)
        controls = np.zeros((1, int(kept[-1]), self.controls.width))
        with self.pool.in_force():
            states = self._states(prepared, [motion], kept, controls)
        chosen = self.steps(times_s)
        looked = states[0, chosen]
        seen = np.hstack([self.states.base(looked), self.states.angles(looked)])
        torques = self._torques(prepared[0], controls[0], states[0])[chosen]
        return self._checked(prepared, states, kept, motion.observe_s)[0], seen, torques

    def close(self) -> None:
        """End the threads."""
        self.pool.close()

    def steps(self, times_s: FloatArray) -> Steps:
        """Return the time steps at which times are."""
        return np.rint(times_s / self.world.time_step_s).astype(int)

    def _seen(self, prepared: Sequence[Prepared], motions: Sequence[Motion | Loop]) -> FloatArray:
        """Return `(n · m, t, 7)`: observed poses, by motion and world."""
        observe_s = motions[0].observe_s
        observed = self.steps(observe_s)
        kept = np.union1d([*observed, max(1, observed[-1])], self._checks(observe_s))
        return self._checked(prepared, self._states(prepared, motions, kept), kept, observe_s)

    def _states(
        self,
        prepared: Sequence[Prepared],
        motions: Sequence[Motion | Loop],
        kept: Steps,
        told: FloatArray | None = None,
    ) -> FloatArray:
        """Return `(n · m, t, state)`: states after steps `(t,)`, ascending, the last of which ends the rollouts.

        The targets in each step are written to `told`, `(n · m, steps, degrees of freedom)`, if it is given.
        """
        loops = [motion for motion in motions if isinstance(motion, Loop)]
        if loops:
            return self._looping.run(prepared, loops, kept, told)
        known = [motion for motion in motions if isinstance(motion, Motion)]
        controls = self.controls.of(known, int(kept[-1]), [each.delays for each in prepared])
        if told is not None:
            told[:] = controls
        starts = self.states.starts(motions, len(prepared))
        found = self.pool.rolled([each.model for each in prepared] * len(motions), starts, controls)[:, kept - 1]
        found[:, kept == 0] = starts[:, None]
        return found

    def _checks(self, observe_s: FloatArray) -> Steps:
        """Return the steps after which energy is checked."""
        return self.steps(checked_s(self.world, float(observe_s[-1])))

    def _checked(
        self, prepared: Sequence[Prepared], states: FloatArray, kept: Steps, observe_s: FloatArray
    ) -> FloatArray:
        """Return `(rows, t, 7)`: observed poses in states after steps; nan if MuJoCo stopped, or a rollout failed.

        The rows belong to the worlds in turns.
        """
        places = (np.searchsorted(kept, each) for each in (self.steps(observe_s), self._checks(observe_s)))
        seen, checked = (states[:, place] for place in places)
        poses = self.states.base(seen)
        finished = states[:, -1, TIME] > (kept[-1] - 0.5) * self.world.time_step_s
        failed = ~(finished & plausible(poses))
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


class MuJoCoOptions(Frozen):
    """Options of the engine `mujoco`."""

    threads: Annotated[int, Field(ge=1, le=256)] = Field(
        default=1, description="threads that share the rollouts of a call; the numbers do not depend on it"
    )


class MuJoCo(SceneEngine[MuJoCoScene]):
    """MuJoCo's rigid bodies in batches, with motors and contacts that follow the same law as PyBullet's.

    A contact that slides has dynamic friction, any other static friction. Restitution acts on impacts faster than the
    speed that gravity adds in two steps. Deterministic within one version and architecture, for any number of threads.
    """

    name = "mujoco"
    source = "https://mujoco.org, version 4.0; docs/engines.md"
    library = "mujoco"
    usual_rollout_s = 0.002
    install = "pip install 'gaplab[mujoco]'"
    Options = MuJoCoOptions
    options: MuJoCoOptions
    in_place = USUALLY_IN_PLACE | {
        "body.center_m",
        "body.inertia",
        "gravity_m_s2",
        "joint.armature",
        "joint.limits",
        "motor.follows",
        "slope_rad",
    }

    def _build(self, world: World) -> MuJoCoScene:
        return MuJoCoScene(import_module("mujoco"), world, self.options.threads)

    @classmethod
    def available(cls) -> bool:
        """Return whether MuJoCo is installed, and Numba, which compiles the contact law."""
        return super().available() and find_spec("numba") is not None

    def rollout(self, world: World, motion: Motion | Loop) -> Trajectory:
        """Return the trajectory of the observed body, `(t, 3)`; times are rounded to whole time steps."""
        with self._turn:
            poses = self._scenes[world.built(self.in_place)].poses([world], [motion])[0, 0]
        return Trajectory(motion.observe_s, poses[:, :3], poses[:, 3:])

    def rollouts(self, worlds: Sequence[World], motions: Sequence[Motion | Loop]) -> Trajectory:
        """Return every motion in every world; worlds that differ only in place share calls of MuJoCo."""
        poses = np.empty((len(motions), len(worlds), len(motions[0].observe_s), 7))
        left = list(range(len(worlds)))
        while left:
            built = worlds[left[0]].built(self.in_place)
            alike = [column for column in left if worlds[column].built(self.in_place) == built]
            here = consecutive(alike)
            with self._turn:
                poses[:, here] = self._scenes[built].poses([worlds[column] for column in alike], motions)
            left = [column for column in left if column not in alike]
        return Trajectory(motions[0].observe_s, poses[..., :3], poses[..., 3:])

    def record(self, world: World, motion: Motion | Loop, times_s: FloatArray) -> Recording:
        """Return the same rollout with joint angles and torques."""
        with self._turn:
            seen = self._scenes[world.built(self.in_place)].record(world, motion, times_s)
        return recording(motion, times_s, *seen)
