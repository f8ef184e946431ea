"""The PhysX engine, with one cached scene for each kind of world."""

from dataclasses import replace
from functools import partial
from importlib import import_module
from types import ModuleType
from warnings import catch_warnings, simplefilter

import numpy as np

from gaplab.schemas.base import Frozen
from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.errors import EngineUnavailable
from gaplab.services.core.world import Material, Motion, Recording, Trajectory, World
from gaplab.services.engines.base import ALL_FIELDS, Engine
from gaplab.services.engines.physx.scene import PhysXScene
from gaplab.services.engines.stepping import WarmScenes, plausible, record, recording, watch


class PhysX(Engine):
    """PhysX on the CPU, the paper's own engine, which has all three coefficients itself.

    Deterministic within one version and architecture; single precision; needs neither a GPU nor Vulkan.
    Restitution acts on impacts faster than 0.2 m/s.
    """

    name = "physx"
    source = "PhysX 5.3.1 through SAPIEN, https://sapien.ucsd.edu, version 3.0.3; docs/engines.md"
    library = "sapien"
    install = "pip install 'gaplab[physx]'"
    honours = ALL_FIELDS

    def __init__(self, options: Frozen | None = None) -> None:
        super().__init__(options)
        if not self.available():
            msg = f"the engine {self.name!r} needs a library: {self.install}"
            raise EngineUnavailable(msg)
        self._scenes = WarmScenes(partial(PhysXScene, _sapien()))

    @classmethod
    def runs(cls, world: World) -> bool:
        """Return whether the world has bodies."""
        return bool(world.bodies)

    def rollout(self, world: World, motion: Motion) -> Trajectory:
        """Return the trajectory of the base, `(t, 3)`; times are rounded to whole time steps."""
        bare = replace(world, material=Material())
        scene = self._scenes[bare]
        scene.start(world.material)
        poses = watch(scene, scene.step, motion)
        if not plausible(poses):
            poses = np.full_like(poses, np.nan)
            self._scenes.drop(bare)  # nan in a scene persists
        return Trajectory(motion.observe_s, poses[:, :3], poses[:, 3:])

    def record(self, world: World, motion: Motion, times_s: FloatArray) -> Recording:
        """Return the same rollout with joint angles."""
        bare = replace(world, material=Material())
        scene = self._scenes[bare]
        scene.start(world.material)
        poses, seen = record(scene, scene.step, motion, times_s)
        if not plausible(poses):
            self._scenes.drop(bare)
        return recording(motion, times_s, poses, seen)

    def close(self) -> None:
        """Close all scenes."""
        self._scenes.close()


def _sapien() -> ModuleType:
    """Import the library without its warnings about graphics, which is not used."""
    with catch_warnings():
        simplefilter("ignore")  # no Vulkan on the machine; older versions import `pkg_resources`
        return import_module("sapien")
