"""The engine itself: motions in worlds, one server for each kind of world, kept warm."""

from collections import OrderedDict
from dataclasses import replace
from importlib import import_module
from itertools import pairwise

import numpy as np

from schemas.base import Frozen
from services.core.arrays import FloatArray
from services.core.errors import EngineUnavailable
from services.core.world import Material, Motion, Trajectory, World
from services.engines.base import Engine
from services.engines.pybullet.scene import Scene
from services.engines.pybullet.stick_slip import StickSlip

WARM_SCENES = 4
"""Worlds that differ in more than their material are kept warm up to this number; the longest unused one goes."""

FARTHEST_M = 100.0
"""A base that is farther than this from where it started was thrown there by numbers, not by physics: it failed."""

DEEPEST_M = 1.0
"""So was one that is deeper than this in the ground."""


class PyBullet(Engine):
    """Bullet's rigid bodies, with static and dynamic friction told apart by stick-slip switching at each contact.

    Deterministic within one version and architecture. Restitution acts on impacts faster than 0.2 m/s, Bullet's
    threshold. Where dynamic friction is not below static friction, no switching is needed and none is paid for.
    """

    name = "pybullet"
    source = "https://pybullet.org, version 3.2.7"
    library = "pybullet"
    install = "pip install 'pybullet>=3.2.7' (it has wheels for Python up to 3.11)"
    honours = frozenset(
        {
            "material.static_friction",
            "material.dynamic_friction",
            "material.restitution",
            "body.mass_kg",
            "body.shape",
            "motor.position_gain",
            "motor.max_torque_nm",
            "motor.max_speed_rad_s",
            "start_height_m",
            "gravity_m_s2",
            "time_step_s",
            "solver_iterations",
        }
    )

    def __init__(self, options: Frozen | None = None) -> None:
        super().__init__(options)
        if not self.available():
            msg = f"the engine {self.name!r} needs a library: {self.install}"
            raise EngineUnavailable(msg)
        self._bullet = import_module("pybullet")
        self._scenes: OrderedDict[World, Scene] = OrderedDict()

    @classmethod
    def runs(cls, world: World) -> bool:
        """Any world with bodies."""
        return bool(world.bodies)

    def rollout(self, world: World, motion: Motion) -> Trajectory:
        """The base's trajectory, `(t, 3)`; times are rounded to whole time steps."""
        bare = replace(world, material=Material())
        scene = self._scene(bare)
        try:
            poses = _roll(scene, world.material, motion)
        except self._bullet.error:
            poses = np.full((len(motion.observe_s), 7), np.nan)
        if not _plausible(poses[:, :3]):
            poses = np.full_like(poses, np.nan)
            self._scenes.pop(bare).close()  # Bullet drops bodies that it loses sight of: such a scene is spoilt
        return Trajectory(motion.observe_s, poses[:, :3], poses[:, 3:])

    def close(self) -> None:
        """Give all servers up."""
        while self._scenes:
            self._scenes.popitem()[1].close()

    def _scene(self, bare: World) -> Scene:
        scene = self._scenes.pop(bare, None) or Scene(self._bullet, bare)
        self._scenes[bare] = scene
        while len(self._scenes) > WARM_SCENES:
            self._scenes.popitem(last=False)[1].close()
        return scene


def _plausible(positions_m: FloatArray) -> bool:
    return bool(np.all(np.abs(positions_m) < FARTHEST_M) and np.all(positions_m[:, 2] > -DEEPEST_M))


def _roll(scene: Scene, material: Material, motion: Motion) -> FloatArray:
    """`(t, 7)`: position and quaternion of the base at each observation."""
    scene.start(material, max(material.static_friction, material.dynamic_friction))
    switches = material.dynamic_friction < material.static_friction
    advance = StickSlip(scene, material).step if switches else scene.step
    commands = _commands(motion, scene.world.time_step_s)
    observed = _steps(motion.observe_s, scene.world.time_step_s)
    poses: dict[int, FloatArray] = {}
    moments = [step for step in sorted({0, *commands, *observed}) if step <= observed[-1]]
    for now, then in pairwise([*moments, moments[-1]]):
        for actuator, target in commands.get(now, ()):
            scene.command(actuator, target)
        poses[now] = scene.pose()
        advance(then - now)
    return np.array([poses[step] for step in observed])


def _commands(motion: Motion, time_step_s: float) -> dict[int, list[tuple[int, float]]]:
    """By time step: the actuators whose targets change then, with their new targets; at step 0, all of them."""
    changed = np.vstack([np.ones_like(motion.targets[:1], bool), motion.targets[1:] != motion.targets[:-1]])
    rows, actuators = np.nonzero(changed)
    steps, targets = _steps(motion.times_s[rows], time_step_s), motion.targets[rows, actuators].tolist()
    commands: dict[int, list[tuple[int, float]]] = {}
    for step, actuator, target in zip(steps, actuators.tolist(), targets, strict=True):
        commands.setdefault(step, []).append((actuator, target))
    return commands


def _steps(times_s: FloatArray, time_step_s: float) -> list[int]:
    steps: list[int] = np.rint(times_s / time_step_s).astype(int).tolist()
    return steps
