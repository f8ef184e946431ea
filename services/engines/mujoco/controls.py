"""The targets of motors in each time step, where the law reads them."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.motions import Motion
from gaplab.services.core.world import World
from gaplab.services.engines.agenda import check_targets
from gaplab.services.engines.mujoco.model import Structure
from gaplab.services.engines.mujoco.models import Delays
from gaplab.services.engines.stepping import consecutive

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
