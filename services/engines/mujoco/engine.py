"""The MuJoCo engine: worlds are grouped by what is compiled, and the rollouts of a group run in one call."""

from collections.abc import Iterator, Sequence
from importlib import import_module
from importlib.util import find_spec
from types import ModuleType
from typing import Annotated, NamedTuple

import numpy as np
from pydantic import Field

from gaplab.schemas.base import Frozen
from gaplab.services.core.arrays import FloatArray
from gaplab.services.engines.base import USUALLY_IN_PLACE, SceneEngine
from gaplab.services.engines.energy import Energy
from gaplab.services.engines.mujoco.callback import torque_teller
from gaplab.services.engines.mujoco.pool import Looping, Pool
from gaplab.services.engines.mujoco.worlds import POSITIONS, TIME, Controls, Models, Prepared, States, Steps
from gaplab.services.engines.stepped import consecutive, plausible, recording, trajectory
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
        self._energy = Energy(world)

    def observed(self, worlds: Sequence[World], motions: Sequence[Motion | Loop]) -> FloatArray:
        """Return `(n, m, t, 7)`: positions and quaternions x, y, z, w of the observed body; nan if physics failed.

        If the motions ask for joints, return `(n, m, t, 7 + 3 · joints)`: the same, and encoders.
        """
        width = 7 + 3 * motions[0].joints * len(self.world.joints)
        found = np.empty((len(motions), len(worlds), len(motions[0].observe_s), width))
        rows = self._rows if isinstance(motions[0], Motion) else LOOPING_ROWS
        with self.pool.in_force():
            for down in _slices(len(motions), max(1, rows // len(worlds))):
                for across in _slices(len(worlds), rows):
                    rolled = self._rolled(self.models[worlds[across]], motions[down])
                    seen = found[down, across]
                    seen[..., :7] = self._checked(rolled, motions[0].observe_s).reshape(*seen.shape[:3], 7)
                    if motions[0].joints:
                        seen[..., 7:] = self._encoders(rolled).reshape(*seen.shape[:3], -1)
        return found

    def record(self, world: World, motion: Motion | Loop, times_s: FloatArray) -> Recording:
        """Return the same rollout with joint angles and torques."""
        often = motion.observed_at(np.union1d(motion.observe_s, times_s), joints=True)
        observed, recorded = (np.searchsorted(often.observe_s, times) for times in (motion.observe_s, times_s))
        with self.pool.in_force():
            rolled = self._rolled(self.models[[world]], [often])
        encoders = self._encoders(rolled)[0]
        seen = trajectory(motion, self._checked(rolled, motion.observe_s)[0], encoders[observed])
        return recording(seen, times_s, self.states.base(rolled.at(self.steps(times_s))[0]), encoders[recorded])

    def close(self) -> None:
        """End the threads."""
        self.pool.close()

    def steps(self, times_s: FloatArray) -> Steps:
        """Return the time steps at which times are."""
        return np.rint(times_s / self.world.time_step_s).astype(int)

    def _rolled(self, prepared: Sequence[Prepared], motions: Sequence[Motion | Loop]) -> "_Rolled":
        """Run n motions in m worlds."""
        observed, checks = self.steps(motions[0].observe_s), self._checks(motions[0].observe_s)
        joints = motions[0].joints
        before, earlier = (np.maximum(observed - ago, 0) if joints else observed[:0] for ago in (1, 2))
        kept = np.unique(np.concatenate([observed, [max(1, int(observed[-1]))], checks, before, earlier]))
        if loops := [motion for motion in motions if isinstance(motion, Loop)]:
            controls = np.empty((len(loops) * len(prepared), joints * int(kept[-1]), self.controls.width))
            states = self._looping.run(prepared, loops, kept, controls if joints else None)
        else:
            known = [motion for motion in motions if isinstance(motion, Motion)]
            controls = self.controls.of(known, int(kept[-1]), [each.delays for each in prepared])
            starts = self.states.starts(motions, len(prepared))
            states = self.pool.rolled([each.model for each in prepared] * len(motions), starts, controls)[:, kept - 1]
            states[:, kept == 0] = starts[:, None]
        return _Rolled(prepared, motions, kept, states, controls[:, before] if joints else controls)

    def _checks(self, observe_s: FloatArray) -> Steps:
        """Return the steps after which energy is checked."""
        return self.steps(self._energy.checks_s(float(observe_s[-1])))

    def _checked(self, rolled: "_Rolled", observe_s: FloatArray) -> FloatArray:
        """Return `(rows, t, 7)`: observed poses; nan if MuJoCo stopped, or a rollout failed."""
        prepared, motions, kept, states, _ = rolled
        seen, checked = (rolled.at(steps) for steps in (self.steps(observe_s), self._checks(observe_s)))
        poses = self.states.base(seen)
        finished = states[:, -1, TIME] > (kept[-1] - 0.5) * self.world.time_step_s
        failed = ~(finished & plausible(poses))
        gravity = np.tile([gravity_m_s2(each.world) for each in prepared], (len(motions), 1))
        energy = np.repeat([self._energy.thrown(motion) for motion in motions], len(prepared))
        failed |= self._energy.explodes(self.states.base(checked), self.states.angles(checked), gravity, energy)
        if not observes_base(self.world):
            rows = len(seen) * seen.shape[1]
            angles = self.states.angles(seen).reshape(rows, -1)
            poses = observed_poses(self.world, poses.reshape(rows, 7), angles).reshape(*seen.shape[:2], 7)
            failed |= ~plausible(poses)
        if np.count_nonzero(failed):
            poses[failed] = np.nan
        return poses

    def _encoders(self, rolled: "_Rolled") -> FloatArray:
        """Return `(rows, t, 3 · joints)`: angles, speeds and torques of motors at each observation."""
        steps, tell, torques = self.steps(rolled.motions[0].observe_s), torque_teller(), rolled.controls
        around = rolled.kept.searchsorted(np.maximum(steps - np.array([[2], [1], [0]]), 0))
        for row, each in enumerate([*rolled.prepared] * len(rolled.motions)):
            tell(each.model.numeric_data, torques[row], rolled.states[row, :, POSITIONS:], around)
        torques[:, steps == 0] = 0.0  # no step has ended yet
        now = rolled.at(steps)
        return np.concatenate(
            [self.states.angles(now), self.states.joint_speeds(now), torques[..., self.models.structure.dofs]], axis=-1
        )


class _Rolled(NamedTuple):
    """n motions in m worlds.

    Attributes:
        prepared: the worlds.
        motions: the motions.
        kept: `(s,)`: steps, ascending, the last of which ends the rollouts.
        states: `(n · m, s, state)`: states after them, by motion and world.
        controls: `(n · m, ..., degrees of freedom)`: targets; if joints are asked for, in the step before each
            observation.
    """

    prepared: Sequence[Prepared]
    motions: Sequence[Motion | Loop]
    kept: Steps
    states: FloatArray
    controls: FloatArray

    def at(self, steps: Steps) -> FloatArray:
        """Return the states after some of the kept steps."""
        return self.states[:, self.kept.searchsorted(steps)]


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
        "gravity_tilt_rad",
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
            seen = self._scenes[world.built(self.in_place)].observed([world], [motion])[0, 0]
        return trajectory(motion, seen[:, :7], seen[:, 7:])

    def rollouts(self, worlds: Sequence[World], motions: Sequence[Motion | Loop]) -> Trajectory:
        """Return every motion in every world; worlds that differ only in place share calls of MuJoCo."""
        width = 7 + 3 * motions[0].joints * len(worlds[0].joints)
        seen = np.empty((len(motions), len(worlds), len(motions[0].observe_s), width))
        left = list(range(len(worlds)))
        while left:
            built = worlds[left[0]].built(self.in_place)
            alike = [column for column in left if worlds[column].built(self.in_place) == built]
            here = consecutive(alike)
            with self._turn:
                seen[:, here] = self._scenes[built].observed([worlds[column] for column in alike], motions)
            left = [column for column in left if column not in alike]
        return trajectory(motions[0], seen[..., :7], seen[..., 7:])

    def record(self, world: World, motion: Motion | Loop, times_s: FloatArray) -> Recording:
        """Return the same rollout with joint angles and torques."""
        with self._turn:
            return self._scenes[world.built(self.in_place)].record(world, motion, times_s)
