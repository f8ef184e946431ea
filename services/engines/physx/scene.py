"""A World in its own PhysX scene, built once and reset before each rollout."""

from types import ModuleType

import numpy as np

from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.kinematics import inverse, rotated
from gaplab.services.core.world import World
from gaplab.services.engines.physx.robot import Handle, build_robot, set_offsets

BOUNCE_THRESHOLD_M_S = 0.2
"""Impacts slower than this do not bounce, as in Bullet. PhysX's default, 2 m/s, is faster than walking feet."""

ABOUT_AXIS = 3
"""Index of the torque about a hinge's axis: forces, then torques, in the joint's frame, whose x is the axis."""

LARGEST = float(np.finfo(np.float32).max)
"""Largest number in single precision, in which PhysX computes."""


class PhysXScene:
    """One world in one scene, with its saved state at time 0.

    Robot and ground share one material, as in the paper: PhysX averages the coefficients of two surfaces, so equal
    ones stay unchanged. Source: the PhysX 5.3 guide; SAPIEN's `physx_system.cpp`.

    Args:
        sapien: the library module.
        world: world to build; `start` sets its material.
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
        self._links = [self.articulation.links.index(self.robot.links[joint.child]) for joint in world.joints]
        self._initial: bytes = self._system.pack()

    def start(self, world: World) -> None:
        """Reset to time 0 of a world. PhysX itself drops contacts when bodies are moved."""
        self.world = world
        ours, material = self._material, world.material
        ours.static_friction = max(material.static_friction, material.dynamic_friction)
        ours.dynamic_friction = material.dynamic_friction
        ours.restitution = material.restitution
        self._system.unpack(self._initial)

    def command(self, actuator: int, target: float) -> None:
        """Set a new target for a motor, rad."""
        self.robot.motors[actuator].set_drive_target(target)

    def step(self, count: int) -> None:
        """Advance by a number of time steps."""
        advance = self._system.step
        for _ in range(count):
            advance()

    def pose(self) -> FloatArray:
        """Return `(7,)`: position and quaternion of the base's frame."""
        pose = self.articulation.root_pose
        w, x, y, z = pose.q
        return np.array([*pose.p, x, y, z, w], dtype=float)

    def angles(self) -> FloatArray:
        """Return the joint angles `(joints,)`, rad, in the world's order, which is not PhysX's."""
        return np.asarray(self.articulation.qpos, dtype=float)[self._places]

    def speeds(self) -> FloatArray:
        """Return the joint speeds `(joints,)`, rad/s, in the world's order."""
        return np.asarray(self.articulation.qvel, dtype=float)[self._places]

    def turning(self) -> FloatArray:
        """Return the angular velocity of the base, `(3,)`, rad/s, in its own frame."""
        turning = np.asarray(self.articulation.root_angular_velocity, dtype=float)
        return rotated(inverse(self.pose()[3:]), turning)

    def torques(self) -> FloatArray:
        """Return the torques of the motors in the last step, `(joints,)`, N·m: all that acts about a hinge's axis."""
        return np.asarray(self.articulation.link_incoming_joint_forces, dtype=float)[self._links, ABOUT_AXIS]

    def close(self) -> None:
        """Close the scene; PhysX frees it with the last reference."""


def _system(sapien: ModuleType, world: World) -> Handle:
    """Create a system with the world's solver.

    SAPIEN reads a process-wide configuration when it creates a system: it is set, and then restored. The default
    solver, TGS, lets a foot break loose at 0.8 of the static friction; PGS at 1.0.
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
