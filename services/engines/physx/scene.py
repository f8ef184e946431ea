"""A World in a PhysX scene of its own, built once and put back to its start before each rollout."""

from types import ModuleType

import numpy as np

from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.world import Material, World
from gaplab.services.engines.physx.robot import Handle, build_robot, set_offsets

BOUNCE_THRESHOLD_M_S = 0.2
"""Slower impacts do not bounce; Bullet's threshold too. PhysX's own, 2 m/s, is faster than a walking robot's feet."""

LARGEST = float(np.finfo(np.float32).max)
"""PhysX computes in single precision."""


class PhysXScene:
    """One world in one scene, with its state at time 0 kept.

    Robot and ground share one material, as in the paper: PhysX averages the coefficients of two surfaces, and the
    average of a number with itself is that number. Source: the PhysX 5.3 guide; SAPIEN's `physx_system.cpp`.

    Args:
        sapien: the library.
        world: whose material does not count; `start` is given one.
    """

    def __init__(self, sapien: ModuleType, world: World) -> None:
        self.world = world
        self._material = sapien.physx.PhysxMaterial(0.0, 0.0, 0.0)
        self._system = _system(sapien, world)
        self._scene = sapien.Scene([self._system])
        ground = self._scene.add_ground(0.0, render=False, material=self._material)
        set_offsets(ground.components[0].collision_shapes[0])
        self.robot = build_robot(sapien, world, self._material)
        for entity in self.robot.entities:
            self._scene.add_entity(entity)
        self.articulation = self.robot.articulation
        active = self.articulation.active_joints
        self._places = [active.index(self.robot.links[joint.child].joint) for joint in world.joints]
        self._initial: bytes = self._system.pack()

    def start(self, material: Material) -> None:
        """Back to time 0, in a material. What is not put back, contacts, PhysX forgets when bodies are moved."""
        ours = self._material
        ours.static_friction = max(material.static_friction, material.dynamic_friction)
        ours.dynamic_friction = material.dynamic_friction
        ours.restitution = material.restitution
        self._system.unpack(self._initial)

    def command(self, actuator: int, target: float) -> None:
        """A new target for a motor, rad."""
        self.robot.motors[actuator].set_drive_target(target)

    def step(self, count: int) -> None:
        """Go on by so many time steps."""
        advance = self._system.step
        for _ in range(count):
            advance()

    def pose(self) -> FloatArray:
        """`(7,)`: position and quaternion of the base's frame."""
        pose = self.articulation.root_pose
        w, x, y, z = pose.q
        return np.array([*pose.p, x, y, z, w], dtype=float)

    def angles(self) -> FloatArray:
        """`(joints,)`, rad; PhysX counts joints by their distance from the base."""
        return np.asarray(self.articulation.qpos, dtype=float)[self._places]

    def close(self) -> None:
        """Give the scene up; PhysX frees it with the last reference."""


def _system(sapien: ModuleType, world: World) -> Handle:
    """The solver that the world asks for.

    SAPIEN reads a configuration that belongs to the whole process while it makes a system: it is set, and put back.
    The default solver, TGS, lets a foot break loose at 0.8 of the static friction; PGS holds to what it is told.
    """
    physx = sapien.physx
    before = physx.get_scene_config()
    physx.set_scene_config(
        gravity=[0.0, 0.0, -float(np.clip(world.gravity_m_s2, -LARGEST, LARGEST))],
        bounce_threshold=BOUNCE_THRESHOLD_M_S,
        enable_tgs=False,
        enable_enhanced_determinism=True,
    )
    try:
        system = physx.PhysxCpuSystem()
    finally:
        physx.set_scene_config(before)
    system.timestep = world.time_step_s
    return system
