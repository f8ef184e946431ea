"""MuJoCo's states of a world: time, positions, and speeds."""

from collections.abc import Sequence
from types import ModuleType

import numpy as np

from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.kinematics import tilted_pose
from gaplab.services.core.motions import LEVEL, Loop, Motion
from gaplab.services.core.observations import Bearing
from gaplab.services.core.world import World
from gaplab.services.engines.mujoco.models import Models
from gaplab.services.engines.stepping import consecutive

TIME, POSITIONS = 0, 1
"""Indices into a state: time; positions of the base and all joints, then their speeds."""

TURNED_POSE = np.array((1, 2, 3, 5, 6, 7, 4))
"""Indices into a state: the base's pose as in a Trajectory; MuJoCo's quaternions have w first, a Trajectory's last."""

TURNING = 3
"""Index into the speeds of a free base: its angular velocity, in its own frame."""


class States:
    """What a state says of a world.

    Args:
        mujoco: the library module.
        world: world.
        models: its models.
    """

    def __init__(self, mujoco: ModuleType, world: World, models: Models) -> None:
        structure, model = models.structure, models.structure.model
        self._world = world
        self.start = self._start(mujoco, models)
        self._fixed = np.array((0.0, 0.0, world.start_height_m, *world.start_turn)) if world.fixed else None
        self._speeds_at = POSITIONS + int(model.nq)
        self._angles = consecutive((structure.dofs + structure.ahead + POSITIONS).tolist())
        self._dofs = consecutive((structure.dofs + self._speeds_at).tolist())

    def starts(self, motions: Sequence[Motion | Loop], worlds: int) -> FloatArray:
        """Return `(n · worlds, state)`: the states at time 0 of n motions, each in as many worlds."""
        found = np.tile(self.start, (len(motions), 1))
        for row, motion in zip(found, motions, strict=True):
            if motion.start_tilt_rad != LEVEL:
                row[TURNED_POSE] = tilted_pose(self._world, motion.start_tilt_rad)
        return np.repeat(found, worlds, axis=0)

    def base(self, states: FloatArray) -> FloatArray:
        """Return `(..., 7)`: poses of the base in states `(..., state)`."""
        if self._fixed is not None:
            return np.tile(self._fixed, (*states.shape[:-1], 1))
        return states[..., TURNED_POSE]

    def angles(self, states: FloatArray) -> FloatArray:
        """Return `(..., joints)`: joint angles, in the world's order."""
        return states[..., self._angles]

    def positions(self, states: FloatArray) -> FloatArray:
        """Return `(..., positions)`: all positions, in MuJoCo's order."""
        return states[..., POSITIONS : self._speeds_at]

    def speeds(self, states: FloatArray) -> FloatArray:
        """Return `(..., degrees of freedom)`: all speeds, in MuJoCo's order."""
        return states[..., self._speeds_at :]

    def bearing(self, states: FloatArray) -> Bearing:
        """Return what states `(n, state)` say of the robots."""
        turning = np.zeros((len(states), 3))
        if self._fixed is None:
            turning = states[:, self._speeds_at + TURNING : self._speeds_at + TURNING + 3]
        return Bearing(self.base(states), turning, self.angles(states), states[:, self._dofs])

    def _start(self, mujoco: ModuleType, models: Models) -> FloatArray:
        """Return `(state,)`: the state at time 0."""
        data, full = mujoco.MjData(models.structure.model), mujoco.mjtState.mjSTATE_FULLPHYSICS
        data.qpos[:] = models.start
        state = np.empty(mujoco.mj_stateSize(models.structure.model, full))
        mujoco.mj_getState(models.structure.model, data, state, full)
        return state
