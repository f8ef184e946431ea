"""Worlds of one structure in MuJoCo: models, which are rewritten and never compiled again, states, and controls.

A state has time, positions and speeds. Controls are the targets of motors in each time step, where the law reads them.
"""

from collections import OrderedDict
from collections.abc import Sequence
from copy import copy
from math import prod
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gaplab.services.core.arrays import FloatArray
from gaplab.services.engines.mujoco.model import Structure, compiled, start, write
from gaplab.services.engines.stepped import check_targets, consecutive, delays
from gaplab.services.world.controllers.parts import middles
from gaplab.services.world.kinematics import placed, started
from gaplab.services.world.motions import Loop, Motion
from gaplab.services.world.sensing import Bearing
from gaplab.services.world.world import World

Steps = NDArray[np.int_]

KEPT, KEPT_BYTES = 64, 256 * 2**20
"""Largest number and size of the models that are kept for the next call; one of the quadruped takes 0.1 MB."""


class Delays(NamedTuple):
    """How many time steps later each actuator follows a command, and its targets `(a,)` before any command arrives."""

    steps: tuple[int, ...]
    first: FloatArray


class Prepared(NamedTuple):
    """A world with its model; no delays if all motors follow at once."""

    world: World
    model: Any
    delays: Delays | None


class Models:
    """The models of worlds that differ only in what is set in place."""

    def __init__(self, mujoco: ModuleType, world: World) -> None:
        self._mujoco = mujoco
        self.structure = compiled(mujoco, world)
        self._data = mujoco.MjData(self.structure.model)
        self._kept: OrderedDict[int, Prepared] = OrderedDict()
        self.start = start(self.structure, world)

    def __getitem__(self, worlds: Sequence[World]) -> list[Prepared]:
        """Return each world with its model, which is the world's own until the next call."""
        for world in worlds:
            if id(world) in self._kept:  # the cache keeps the world, so its id is its own
                self._kept.move_to_end(id(world))
        most = max(min(KEPT, KEPT_BYTES // self.structure.model.nbuffer), len(worlds))
        while len(self._kept) > most:
            self._kept.popitem(last=False)
        for world in worlds:
            if id(world) not in self._kept:
                spare = self._kept.popitem(last=False)[1] if len(self._kept) >= most else None
                self._kept[id(world)] = self._prepared(world, spare)
        return [self._kept[id(world)] for world in worlds]

    def _prepared(self, world: World, spare: Prepared | None) -> Prepared:
        """Return a world with a model, which may be that of another world."""
        before = None if spare is None else spare.world
        model = copy(self.structure.model) if spare is None else spare.model
        write(self._mujoco, self.structure, model, self._data, world, before)
        same = spare is not None and world.joints is spare.world.joints
        return Prepared(world, model, spare.delays if spare is not None and same else _delays(world))


def _delays(world: World) -> Delays | None:
    steps = tuple(delays(world))
    return Delays(steps, middles(world)) if any(steps) else None


TIME, POSITIONS = 0, 1
"""Indices into a state: time; positions of the base and all joints, then their speeds."""

TURNED_POSE = np.array((1, 2, 3, 5, 6, 7, 4))
"""Indices into a state: the base's pose as in a Trajectory; MuJoCo's quaternions have w first, a Trajectory's last."""

TURNING = 3
"""Index into the speeds of a free base: its angular velocity, in its own frame."""


class States:
    """What a state says of a world."""

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
            begun = placed(self._world, motion)
            if begun is not None:
                row[self._angles], row[self._dofs] = begun.angles_rad, begun.speeds_rad_s
            if begun is not None and self._fixed is None:
                row[TURNED_POSE] = begun.pose
                row[self._speeds_at : self._speeds_at + 6] = *begun.velocity_m_s, *begun.turning_rad_s
        return np.repeat(found, worlds, axis=0)

    def base(self, states: FloatArray) -> FloatArray:
        """Return `(..., 7)`: poses of the base in states `(..., state)`."""
        if self._fixed is not None:
            return np.tile(self._fixed, (*states.shape[:-1], 1))
        return states[..., TURNED_POSE]

    def angles(self, states: FloatArray) -> FloatArray:
        """Return `(..., joints)`: joint angles, in the world's order."""
        return states[..., self._angles]

    def joint_speeds(self, states: FloatArray) -> FloatArray:
        """Return `(..., joints)`: speeds of the joints, in the world's order."""
        return states[..., self._dofs]

    def bearing(self, states: FloatArray) -> Bearing:
        """Return the poses, angles and speeds of the robots in states `(n, state)`."""
        turning = np.zeros((len(states), 3))
        if self._fixed is None:
            turning = states[:, self._speeds_at + TURNING : self._speeds_at + TURNING + 3]
        return Bearing(self.base(states), turning, self.angles(states), self.joint_speeds(states))

    def _start(self, mujoco: ModuleType, models: Models) -> FloatArray:
        """Return `(state,)`: the state at time 0."""
        data, full = mujoco.MjData(models.structure.model), mujoco.mjtState.mjSTATE_FULLPHYSICS
        data.qpos[:] = models.start
        state = np.empty(mujoco.mj_stateSize(models.structure.model, full))
        mujoco.mj_getState(models.structure.model, data, state, full)
        return state


class Memory:
    """An array for the results of calls, which each call overwrites; it begins with zeros."""

    def __init__(self) -> None:
        self._kept = np.zeros(0)

    def __call__(self, *shape: int) -> FloatArray:
        """Return an array of a shape, in the memory of the last call if it is large enough."""
        if self._kept.size < prod(shape):
            self._kept = np.zeros(prod(shape))
        return self._kept[: prod(shape)].reshape(shape)


class Controls:
    """The targets of the actuators of worlds of one structure."""

    def __init__(self, world: World, structure: Structure) -> None:
        joints = [world.joints.index(joint) for joint in world.actuators]
        self._dofs = consecutive(structure.dofs[joints].tolist())
        self.width = int(structure.model.nv)
        self._world = world
        self._memory = Memory()

    def of(self, motions: Sequence[Motion], steps: int, delays: Sequence[Delays | None]) -> FloatArray:
        """Return `(n · m, steps, degrees of freedom)`: the targets of n motions in each step, in m worlds.

        They are in the memory of the last call if it is large enough; what no motor drives stays zero in it.

        Raises:
            PluginBroken: the targets of a motion are not those of the actuators.
        """
        controls, now = self._memory(len(motions) * len(delays), steps, self.width), np.arange(steps)
        for motion, each in zip(motions, controls.reshape(len(motions), len(delays), steps, self.width), strict=True):
            check_targets(motion, self._world)
            at = np.rint(motion.times_s / self._world.time_step_s).astype(int)
            for late, columns in grouped(delayed(self._world, motion, delays)):
                targets = held(at, motion.targets, now, late)
                for column in columns:
                    self.put(each[column], targets)
        return controls

    def put(self, controls: FloatArray, targets: FloatArray) -> None:
        """Write targets `(..., a)` into controls `(..., degrees of freedom)`."""
        controls[..., self._dofs] = targets


def delayed(world: World, motion: Motion | Loop, delays: Sequence[Delays | None]) -> list[Delays | None]:
    """Return the delays of worlds, whose actuators begin where the motion does."""
    if motion.start is None or motion.start.angles_rad is None:
        return list(delays)
    first = middles(started(world, motion))
    return [None if each is None else each._replace(first=first) for each in delays]


def held(at: Steps, targets: FloatArray, now: Steps, delays: Delays | None) -> FloatArray:
    """Return `(..., s, a)`: the targets that motors follow in steps `(s,)`, given steps and targets of commands.

    Commands are at ascending steps `(k,)`, with targets `(..., k, a)`; without delays, motors follow at once.
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
