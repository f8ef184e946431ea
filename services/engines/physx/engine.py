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
from gaplab.services.world.kinematics import Placed
from gaplab.services.world.sensing import gravity_m_s2
from gaplab.services.world.world import Motor, Quaternion, Vector, World

BOUNCE_THRESHOLD_M_S = 0.2
"""Impacts slower than this do not bounce, as in Bullet. PhysX's default, 2 m/s, is faster than walking feet."""

TURNED_POSE = np.array((0, 1, 2, 4, 5, 6, 3))
"""Indices of a pose as in a Trajectory, among PhysX's position and quaternion, which has w first."""

FELT = {True: 0, False: 3}
"""Index of force along a joint's axis if it slides, else of torque about it, in its frame, whose x is the axis."""

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
        self._places = np.array([active.index(joint) for joint in self.robot.joints], int)
        links, count = self.articulation.links, len(world.joints)
        felt = [6 * links.index(self.robot.links[each.child]) + FELT[each.slides] for each in world.joints]
        after = [7 + self._places, 7 + count + self._places, 7 + 2 * count + np.array(felt, int)]
        self._encoders = np.concatenate([TURNED_POSE, *after])
        self._forces = [0.0] * len(world.joints)
        if any(joint.start for joint in world.joints):
            self.articulation.qpos = self._in_order([joint.start for joint in world.joints])
        self._initial: bytes = self._system.pack()

    def _enter_scene(self) -> None:
        """Put the robot into a new scene on the grounds of all surfaces."""
        self._system = _system(self._sapien, self.world)
        self._scene = self._sapien.Scene([self._system])
        for number, material in enumerate(self._materials.values()):
            ground = self._scene.add_ground(self.world.ground_m, render=False, material=material)
            set_offsets(ground.components[0].collision_shapes[0])
            ground.components[0].collision_shapes[0].set_collision_groups(ground_groups(number))
        for entity in self.robot.entities:
            self._scene.add_entity(entity)

    def start(self, world: World, begun: Placed | None = None) -> None:
        """Reset to time 0 of a world.

        PhysX itself drops contacts when bodies are moved. But it solves those of several shapes of a body in an order
        that depends on all earlier contacts in the scene: such a robot moves to a new scene. So does one whose ground
        has another height.
        """
        before, self.world = self.world, world
        if (
            world.bodies != self._bodies and _frames(world) != self._frames
        ):  # set in place, they would leave rounding errors in PhysX's joints
            self._build(world)
        elif self._crowded or world.ground_m != before.ground_m:
            for entity in self.robot.entities:
                self._scene.remove_entity(entity)
            self._enter_scene()
        self._set_materials()
        if world.bodies != self._bodies:
            self._bodies = world.bodies
            for body in world.bodies:
                set_masses(self.robot.links[body.name], body)
        self._set_joints()
        self._system.unpack(self._initial)
        if begun is not None:
            self._place(begun)

    def _place(self, begun: Placed) -> None:
        """Move and turn the base, and the joints."""
        robot = self.articulation
        if not self.world.fixed:
            robot.root_pose = pose_of(self._sapien, begun.pose[:3].tolist(), begun.pose[3:])
            robot.root_linear_velocity, robot.root_angular_velocity = begun.of_centre(self.world.bodies[0].center_m)
        robot.qpos, robot.qvel = (self._in_order(each.tolist()) for each in (begun.angles_rad, begun.speeds_rad_s))

    def _set_materials(self) -> None:
        named = dict(self.world.surfaces)
        for name, ours in self._materials.items():
            material = named.get(name, self.world.material)
            ours.static_friction = max(material.static_friction, material.dynamic_friction)
            ours.dynamic_friction = material.dynamic_friction
            ours.restitution = material.restitution

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
        self._unpowered = [
            (n, self._drives[n]) for n, each in enumerate(world.joints) if not isinstance(each.motor, Motor)
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
        return np.concatenate([pose.p, pose.q], dtype=float).take(TURNED_POSE)

    def angles(self) -> FloatArray:
        """Return the joint angles `(joints,)`, rad or m, in the world's order, which is not PhysX's."""
        return np.asarray(self.articulation.qpos, dtype=float).take(self._places)

    def speeds(self) -> FloatArray:
        """Return the joint speeds `(joints,)`, rad/s, in the world's order."""
        return np.asarray(self.articulation.qvel, dtype=float).take(self._places)

    def spin(self) -> FloatArray:
        """Return the angular velocity of the base, `(3,)`, rad/s, along the axes of the world."""
        return np.asarray(self.articulation.root_angular_velocity, dtype=float)

    def encoders(self) -> FloatArray:
        """Return `(7 + 3 · joints,)`: pose, angles, speeds, and torques of the motors in the last step, N·m, or N.

        Torques of servos are all that acts about a joint's axis, less what is set beside its drive.
        """
        robot, count = self.articulation, len(self._drives)
        pose, forces = robot.root_pose, robot.link_incoming_joint_forces.ravel()
        told = np.concatenate([pose.p, pose.q, robot.qpos, robot.qvel, forces]).take(self._encoders).astype(float)
        if any(self._forces):
            told[7 + 2 * count :] -= self._forces
        for place, drive in self._unpowered:
            told[place - count] = drive.motor_nm(float(told[7 + place]), float(told[7 + count + place]))
        return told

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

    def _start(self, scene: PhysXScene, world: World, begun: Placed | None) -> Callable[[int], None]:
        scene.start(world, begun)
        return scene.step


def _sapien() -> ModuleType:
    """Import the library without its warnings about graphics, which is not used."""
    with catch_warnings():
        simplefilter("ignore")  # no Vulkan on the machine; older versions import `pkg_resources`
        return import_module("sapien")
