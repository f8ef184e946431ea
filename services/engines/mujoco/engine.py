"""The engine itself: worlds sorted by kind, and each kind's rollouts made in one go."""

from collections.abc import Sequence
from dataclasses import replace
from importlib import import_module
from importlib.util import find_spec
from typing import Annotated

import numpy as np
from pydantic import Field

from gaplab.schemas.base import Frozen
from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.errors import EngineUnavailable
from gaplab.services.core.world import Material, Motion, Recording, Trajectory, World
from gaplab.services.engines.base import ALL_FIELDS, Engine
from gaplab.services.engines.mujoco.scene import MuJoCoScene
from gaplab.services.engines.stepping import WarmScenes, recording


class MuJoCoOptions(Frozen):
    """How many cores one call may use."""

    threads: Annotated[int, Field(ge=1, le=256)] = Field(
        default=1, description="that share the rollouts of a call; the numbers do not depend on it"
    )


class MuJoCo(Engine):
    """MuJoCo's rigid bodies in batches, with motors and contacts that obey the same law as PyBullet's.

    Static and dynamic friction are told apart by whether a contact slides; restitution acts on impacts faster than what
    gravity adds in two steps. Deterministic within one version and architecture, for any number of threads.
    """

    name = "mujoco"
    source = "https://mujoco.org, version 4.0; docs/engines.md"
    library = "mujoco"
    usual_rollout_s = 0.002
    install = "pip install 'gaplab[mujoco]'"
    Options = MuJoCoOptions
    options: MuJoCoOptions
    honours = ALL_FIELDS

    def __init__(self, options: Frozen | None = None) -> None:
        super().__init__(options)
        if not self.available():
            msg = f"the engine {self.name!r} needs a library: {self.install}"
            raise EngineUnavailable(msg)
        mujoco = import_module("mujoco")
        self._scenes = WarmScenes(lambda world: MuJoCoScene(mujoco, world, self.options.threads))
        self._latest: MuJoCoScene | None = None

    @classmethod
    def runs(cls, world: World) -> bool:
        """Any world with bodies."""
        return bool(world.bodies)

    @classmethod
    def available(cls) -> bool:
        """Whether MuJoCo is installed, and Numba, which makes machine code of the law of contacts."""
        return super().available() and find_spec("numba") is not None

    def rollout(self, world: World, motion: Motion) -> Trajectory:
        """The base's trajectory, `(t, 3)`; times are rounded to whole time steps."""
        poses = self._scene(_kind(world)).poses([world.material], [motion])[0, 0]
        return Trajectory(motion.observe_s, poses[:, :3], poses[:, 3:])

    def rollouts(self, worlds: Sequence[World], motions: Sequence[Motion]) -> Trajectory:
        """Every motion in every world; worlds that differ in their material alone share their calls of MuJoCo."""
        poses = np.empty((len(motions), len(worlds), len(motions[0].observe_s), 7))
        kinds = [_kind(world) for world in worlds]
        left = list(range(len(worlds)))
        while left:
            alike = [column for column in left if kinds[column] == kinds[left[0]]]
            scene = self._scene(kinds[left[0]])
            poses[:, alike] = scene.poses([worlds[column].material for column in alike], motions)
            left = [column for column in left if column not in alike]
        return Trajectory(motions[0].observe_s, poses[..., :3], poses[..., 3:])

    def record(self, world: World, motion: Motion, times_s: FloatArray) -> Recording:
        """The same rollout, with its joints."""
        return recording(motion, times_s, *self._scene(_kind(world)).record(world.material, motion, times_s))

    def close(self) -> None:
        """Give all threads up."""
        self._latest = None
        self._scenes.close()

    def _scene(self, kind: World) -> MuJoCoScene:
        """Equality sees at once that the bodies are the very same objects; a hash looks into each, in 25 µs."""
        if self._latest is None or self._latest.world != kind:
            self._latest = self._scenes[kind]
        return self._latest


def _kind(world: World) -> World:
    return replace(world, material=Material())
