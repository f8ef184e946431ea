"""Models of the worlds of one structure: copies that are rewritten, never compiled again."""

from collections import OrderedDict
from collections.abc import Sequence
from copy import copy
from types import ModuleType
from typing import Any, NamedTuple

from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.controllers.actuation import middles
from gaplab.services.core.world import World
from gaplab.services.engines.agenda import delays
from gaplab.services.engines.mujoco.model import compiled
from gaplab.services.engines.mujoco.values import start, write

KEPT, KEPT_BYTES = 64, 256 * 2**20
"""Largest number and size of the models that are kept for the next call; one of the quadruped takes 0.1 MB."""


class Delays(NamedTuple):
    """When motors follow commands.

    Attributes:
        steps: time steps from a command until the motor follows it, of each actuator.
        first: targets `(a,)` before any command arrives.
    """

    steps: tuple[int, ...]
    first: FloatArray


class Prepared(NamedTuple):
    """A world with its model; no delays if all motors follow at once."""

    world: World
    model: Any
    delays: Delays | None


class Models:
    """The models of worlds that differ only in what is set in place.

    Args:
        mujoco: the library module.
        world: world with the structure.
    """

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
