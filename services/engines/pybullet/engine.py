"""The PyBullet engine, with one cached server for each kind of world."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from importlib import import_module

import numpy as np

from gaplab.schemas.base import Frozen
from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.errors import EngineUnavailable
from gaplab.services.core.world import Material, Motion, Recording, Trajectory, World
from gaplab.services.engines.base import ALL_FIELDS, Engine
from gaplab.services.engines.pybullet.scene import PyBulletScene
from gaplab.services.engines.pybullet.stick_slip import StickSlip
from gaplab.services.engines.stepping import WarmScenes, plausible, record, recording, watch


class PyBullet(Engine):
    """Bullet's rigid bodies; stick-slip switching at each contact distinguishes static and dynamic friction.

    Deterministic within one version and architecture. Restitution acts on impacts faster than 0.2 m/s, Bullet's
    threshold. If dynamic friction is not below static friction, there is no switching and no cost of it.
    """

    name = "pybullet"
    source = "https://pybullet.org, version 3.2.7"
    library = "pybullet"
    install = "pip install 'pybullet>=3.2.7' (it has wheels for Python up to 3.11)"
    honours = ALL_FIELDS

    def __init__(self, options: Frozen | None = None) -> None:
        super().__init__(options)
        if not self.available():
            msg = f"the engine {self.name!r} needs a library: {self.install}"
            raise EngineUnavailable(msg)
        self._bullet = import_module("pybullet")
        self._scenes = WarmScenes(partial(PyBulletScene, self._bullet))

    @classmethod
    def runs(cls, world: World) -> bool:
        """Return whether the world has bodies."""
        return bool(world.bodies)

    def rollout(self, world: World, motion: Motion) -> Trajectory:
        """Return the trajectory of the base, `(t, 3)`; times are rounded to whole time steps."""
        bare = replace(world, material=Material())
        scene = self._scenes[bare]
        try:
            poses = watch(scene, _started(scene, world.material), motion)
        except self._bullet.error:
            poses = np.full((len(motion.observe_s), 7), np.nan)
        if not plausible(poses):
            poses = np.full_like(poses, np.nan)
            self._scenes.drop(bare)  # Bullet drops bodies that are too far away: the scene is broken
        return Trajectory(motion.observe_s, poses[:, :3], poses[:, 3:])

    def record(self, world: World, motion: Motion, times_s: FloatArray) -> Recording:
        """Return the same rollout with joint angles."""
        bare = replace(world, material=Material())
        scene = self._scenes[bare]
        try:
            poses, seen = record(scene, _started(scene, world.material), motion, times_s)
        except self._bullet.error:
            poses = np.full((len(motion.observe_s), 7), np.nan)
            seen = np.full((len(times_s), 7 + len(world.joints)), np.nan)
        if not plausible(poses):
            self._scenes.drop(bare)
        return recording(motion, times_s, poses, seen)

    def close(self) -> None:
        """Close all servers."""
        self._scenes.close()


def _started(scene: PyBulletScene, material: Material) -> Callable[[int], None]:
    """Return a scene at time 0 in a material, and the function that advances it by time steps."""
    scene.start(material, max(material.static_friction, material.dynamic_friction))
    switches = material.dynamic_friction < material.static_friction
    return StickSlip(scene, material).step if switches else scene.step
