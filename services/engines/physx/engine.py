"""The PhysX engine, and a World in its own PhysX scene, built once and reset before each rollout."""

from collections.abc import Callable
from importlib import import_module
from types import ModuleType
from warnings import catch_warnings, simplefilter

import numpy as np
from numpy.typing import NDArray

from gaplab.schemas.base import Frozen
from gaplab.services.core.arrays import FloatArray
from gaplab.services.engines.base import USUALLY_IN_PLACE
from gaplab.services.engines.physx.robot import (
    MOST_SURFACES,
    Handle,
    JointDrive,
    build_robot,
    ground_groups,
    pose_of,
    resists,
    set_masses,
    set_offsets,
)
from gaplab.services.engines.stepped import SteppedEngine
from gaplab.services.world.inertias import inertia_of, inverse_inertias
from gaplab.services.world.kinematics import tilted_pose
from gaplab.services.world.motions import LEVEL, Tilt
from gaplab.services.world.sensing import gravity_m_s2
from gaplab.services.world.world import Material, Motor, Quaternion, Vector, World

BOUNCE_THRESHOLD_M_S = 0.2
"""Impacts slower than this do not bounce, as in Bullet. PhysX's default, 2 m/s, is faster than walking feet."""

ALONG_AXIS, ABOUT_AXIS = 0, 3
"""Indices of force along a joint's axis and torque about it, in the joint's frame, whose x is the axis."""

LARGEST = float(np.finfo(np.float32).max)
"""Largest number in single precision, in which PhysX computes."""


class PhysXScene:
    """One world in one scene, with its saved state at time 0.

    Robot and ground share one material, as in the paper: PhysX averages the coefficients of two surfaces, so equal
    ones stay unchanged. Each surface has a ground and a material of its own, for the same reason; collision groups
    keep the shapes of all others off that ground. Source: the PhysX 5.3 guide; SAPIEN's `physx_system.cpp`.
    """

    def __init__(self, sapien: ModuleType, world: World) -> None:
        self._sapien = sapien
        self._crowded = any(sum(part.collides for part in body.parts) > 1 for body in world.bodies)
        self._build(world)

    def _build(self, world: World) -> None:
        self.world = world
        self._bodies, self._frames = world.bodies, _frames(world)
        physx = self._sapien.physx
        self._materials = {name: physx.PhysxMaterial(0.0, 0.0, 0.0) for name in surface_names(world)}
        self.robot = build_robot(self._sapien, world, self._materials)
        self._enter_scene()
        self.articulation = self.robot.articulation
        active = self.articulation.active_joints
        self._places = [active.index(joint) for joint in self.robot.joints]
        self._links = [self.articulation.links.index(self.robot.links[joint.child]) for joint in world.joints]
        self._axes = [ALONG_AXIS if joint.slides else ABOUT_AXIS for joint in world.joints]
        self._forces = [0.0] * len(world.joints)
        if any(joint.start for joint in world.joints):
            self.articulation.qpos = self._in_order([joint.start for joint in world.joints])
        self._initial: bytes = self._system.pack()

    def _enter_scene(self) -> None:
        """Put the robot into a new scene on the grounds of all surfaces."""
        self._system = _system(self._sapien, self.world)
        self._scene = self._sapien.Scene([self._system])
        for number, material in enumerate(self._materials.values()):
            ground = self._scene.add_ground(0.0, render=False, material=material)
            set_offsets(ground.components[0].collision_shapes[0])
            ground.components[0].collision_shapes[0].set_collision_groups(ground_groups(number))
        for entity in self.robot.entities:
            self._scene.add_entity(entity)

    def start(self, world: World, tilt_rad: Tilt = LEVEL) -> None:
        """Reset to time 0 of a world, with the base tilted about x and y.

        PhysX itself drops contacts when bodies are moved. But it solves those of several shapes of a body in an order
        that depends on all earlier contacts in the scene: such a robot moves to a new scene.
        """
        if (
            world.bodies != self._bodies and _frames(world) != self._frames
        ):  # set in place, they would leave rounding errors in PhysX's joints
            self._build(world)
        elif self._crowded:
            for entity in self.robot.entities:
                self._scene.remove_entity(entity)
            self._enter_scene()
        self.world = world
        named = dict(world.surfaces)
        for name, ours in self._materials.items():
            _set_material(ours, named.get(name, world.material))
        if world.bodies != self._bodies:
            self._bodies = world.bodies
            for body in world.bodies:
                set_masses(self.robot.links[body.name], body)
        self._set_joints()
        self._system.unpack(self._initial)
        if tilt_rad != LEVEL:
            pose = tilted_pose(world, tilt_rad)
            self.articulation.root_pose = pose_of(self._sapien, pose[:3].tolist(), pose[3:])

    def _set_joints(self) -> None:
        """Set motors, damping, dry friction and armature, and forget those of the last rollout."""
        world = self.world
        inverse_of = inverse_inertias(world).tolist() if any(resists(joint) for joint in world.joints) else None
        self._drives = [
            JointDrive(handle, joint, inverse_of[place] if inverse_of else 0.0, world.time_step_s)
            for place, (handle, joint) in enumerate(zip(self.robot.joints, world.joints, strict=True))
        ]
        self._motors = [
            drive for drive, joint in zip(self._drives, world.joints, strict=True) if joint.motor is not None
        ]
        self._stepped = [(place, drive) for place, drive in enumerate(self._drives) if drive.steps]
        self._forces = [0.0] * len(self._drives)
        self.articulation.qf = self._in_order(self._forces)

    def command(self, actuator: int, target: float) -> None:
        """Set a new target for a motor, in its unit."""
        self._motors[actuator].command(target)
        self._push()

    def _push(self) -> None:
        """Give PhysX the torques beside the drives, which it keeps from step to step."""
        forces = [drive.force for drive in self._drives]
        if forces != self._forces:
            self._forces = forces
            self.articulation.qf = self._in_order(forces)

    def _in_order(self, values: list[float]) -> NDArray[np.float32]:
        """Return values `(joints,)` of the world's joints in PhysX's order."""
        ordered = np.zeros(len(values), np.float32)
        ordered[self._places] = values
        return ordered

    def step(self, count: int) -> None:
        """Advance by a number of time steps."""
        advance, stepped = self._system.step, self._stepped
        for _ in range(count):
            if stepped:
                angles, speeds = self.angles().tolist(), self.speeds().tolist()
                for place, drive in stepped:
                    drive.update(angles[place], speeds[place])
                self._push()
            advance()

    def pose(self) -> FloatArray:
        """Return `(7,)`: position and quaternion of the base's frame."""
        pose = self.articulation.root_pose
        w, x, y, z = pose.q
        return np.array([*pose.p, x, y, z, w], dtype=float)

    def angles(self) -> FloatArray:
        """Return the joint angles `(joints,)`, rad or m, in the world's order, which is not PhysX's."""
        return np.asarray(self.articulation.qpos, dtype=float)[self._places]

    def speeds(self) -> FloatArray:
        """Return the joint speeds `(joints,)`, rad/s, in the world's order."""
        return np.asarray(self.articulation.qvel, dtype=float)[self._places]

    def spin(self) -> FloatArray:
        """Return the angular velocity of the base, `(3,)`, rad/s, along the axes of the world."""
        return np.asarray(self.articulation.root_angular_velocity, dtype=float)

    def torques(self) -> FloatArray:
        """Return the torques of the motors in the last step, `(joints,)`, N·m or N.

        Those of servos are all that acts about a joint's axis, less what is set beside its drive.
        """
        measured = np.asarray(self.articulation.link_incoming_joint_forces, dtype=float)[self._links, self._axes]
        angles, speeds = self.angles().tolist(), self.speeds().tolist()
        for place, (joint, drive) in enumerate(zip(self.world.joints, self._drives, strict=True)):
            if isinstance(joint.motor, Motor):
                measured[place] -= drive.force
            else:
                measured[place] = drive.motor_nm(angles[place], speeds[place])
        return measured

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
        gravity=np.clip(gravity_m_s2(world), -LARGEST, LARGEST).tolist(),
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


def surface_names(world: World) -> tuple[str, ...]:
    """Return the names of the surfaces of bodies, in their order; first "" for the ground's own material."""
    return tuple(dict.fromkeys(["", *(body.surface for body in world.bodies)]))


def _frames(world: World) -> list[tuple[Vector, Quaternion]]:
    """Return centre of mass and turn of the principal axes of each body."""
    return [(body.center_m, inertia_of(body).turn) for body in world.bodies]


def _set_material(ours: Handle, material: Material) -> None:
    ours.static_friction = max(material.static_friction, material.dynamic_friction)
    ours.dynamic_friction = material.dynamic_friction
    ours.restitution = material.restitution


class PhysX(SteppedEngine[PhysXScene]):
    """PhysX on the CPU, the paper's own engine, which has all three coefficients itself.

    Deterministic within one version and architecture; single precision; needs neither a GPU nor Vulkan.
    Restitution acts on impacts faster than 0.2 m/s. Dry friction is a torque that is set before each step, by the load
    of the step before.
    """

    name = "physx"
    source = "PhysX 5.3.1 through SAPIEN, https://sapien.ucsd.edu, version 3.0.3; docs/engines.md"
    library = "sapien"
    in_place = USUALLY_IN_PLACE | {"body.inertia", "joint.armature", "motor.follows"}
    # gravity, and so the slope, is given when a scene is created
    install = "pip install 'gaplab[physx]'"

    def __init__(self, options: Frozen | None = None) -> None:
        super().__init__(options)
        self._library = _sapien()

    @classmethod
    def exceeded(cls, world: World) -> str | None:
        """Return how many surfaces the world has, if PhysX cannot tell them apart."""
        found = len(surface_names(world)) - 1
        return None if found <= MOST_SURFACES else f"it has {found} special surfaces, and PhysX {MOST_SURFACES}"

    def _build(self, world: World) -> PhysXScene:
        return PhysXScene(self._library, world)

    def _start(self, scene: PhysXScene, world: World, tilt_rad: Tilt) -> Callable[[int], None]:
        scene.start(world, tilt_rad)
        return scene.step


def _sapien() -> ModuleType:
    """Import the library without its warnings about graphics, which is not used."""
    with catch_warnings():
        simplefilter("ignore")  # no Vulkan on the machine; older versions import `pkg_resources`
        return import_module("sapien")
