"""A World's bodies, shapes and joints as a PhysX articulation, in reduced coordinates, and what acts in the joints.

A joint of PhysX has one drive: a spring with a damper, solved implicitly, whose force can be limited. It is a World's
servo, or a PD motor with the damping of its joint. Dry friction, and damping beside a servo, are torques: those of the
end of the step, if the joint moved alone under the load of the step before.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from types import ModuleType
from typing import Any, TypeAlias

import numpy as np

from gaplab.services.core.arrays import FloatArray
from gaplab.services.world.inertias import inertia_of
from gaplab.services.world.kinematics import product
from gaplab.services.world.world import (
    UNTURNED,
    Body,
    Box,
    Capsule,
    Cylinder,
    Hull,
    Joint,
    Motor,
    Part,
    PDLaw,
    PDMotor,
    Quaternion,
    Shape,
    Sphere,
    Vector,
    World,
    friction_nm,
    pd_law,
    pd_torque,
)

Handle: TypeAlias = Any
"""An object of SAPIEN, untyped because the library must not be imported here."""

CONTACT_OFFSET_M = 0.01
"""Distance below which surfaces are candidates for contact; they touch at distance 0."""

MOST_SURFACES = 31
"""Largest number of surfaces that have a ground of their own: one bit of PhysX's collision groups each."""

Z = (0.0, 0.0, 1.0)


def build_shape(sapien: ModuleType, part: Part, material: Handle, surface: int) -> Handle:
    """Return a shape at its place on a body, which touches the ground of a surface alone: see `robot_groups`."""
    lies = isinstance(part.shape, Capsule | Cylinder)  # along x, in PhysX
    turn = turn_from_x(Z) if lies else np.array(UNTURNED)
    place = product(np.array(part.turn), turn) if part.turn != UNTURNED else turn
    shape = _geometry(sapien, part.shape, material)
    shape.local_pose = pose_of(sapien, part.center_m, place)
    set_offsets(shape)
    shape.set_collision_groups(robot_groups(surface))
    return shape


def _geometry(sapien: ModuleType, shape: Shape, material: Handle) -> Handle:
    """Return PhysX's shape; a cylinder is a prism of SAPIEN's."""
    physx = sapien.physx
    match shape:
        case Box(size_m=edges):
            return physx.PhysxCollisionShapeBox([edge / 2 for edge in edges], material)
        case Sphere(radius_m=radius):
            return physx.PhysxCollisionShapeSphere(radius, material)
        case Capsule(radius_m=radius, length_m=length):
            return physx.PhysxCollisionShapeCapsule(radius, length / 2, material)
        case Cylinder(radius_m=radius, length_m=length):
            return physx.PhysxCollisionShapeCylinder(radius, length / 2, material)
        case Hull(points_m=points):
            vertices, scale = np.array(points, np.float32), np.ones(3, np.float32)
            return physx.PhysxCollisionShapeConvexMesh(vertices=vertices, scale=scale, material=material)


def pose_of(sapien: ModuleType, position: Vector, turn: FloatArray | Quaternion) -> Handle:
    """Return SAPIEN's pose, whose quaternions are w, x, y, z, of a position and a rotation x, y, z, w."""
    x, y, z, w = turn
    return sapien.Pose(position, [w, x, y, z])


def set_offsets(shape: Handle) -> None:
    """Set the contact distances of a shape, overriding SAPIEN's process-wide defaults."""
    shape.contact_offset = CONTACT_OFFSET_M
    shape.rest_offset = 0.0


def robot_groups(surface: int) -> list[int]:
    """Return the collision groups of a shape on the robot, which touches the ground of its surface and nothing else.

    Two shapes collide if the first group of one shares a bit with the second group of the other. Surface 0 is the
    ground's own material.
    """
    return [1 << surface, 0, 0, 0]


def ground_groups(surface: int) -> list[int]:
    """Return the collision groups of the ground of a surface; those of surface 0 are SAPIEN's defaults."""
    return [1, 1, 0, 0] if surface == 0 else [0, 1 << surface, 0, 0]


def turn_from_x(axis: Vector) -> FloatArray:
    """Return `(4,)`: the shortest rotation from the x axis to a unit vector, as a quaternion x, y, z, w."""
    if axis[0] < -0.999999:
        return np.array([0.0, 0.0, 1.0, 0.0])
    turn = np.array([0.0, -axis[2], axis[1], 1.0 + axis[0]])
    return np.asarray(turn / np.linalg.norm([turn[3], *turn[:3]]))


UNLIMITED = 1e6
"""Speed limit of links, m/s and rad/s: PhysX's defaults, 10 m/s and 50 rad/s, would brake permitted motions."""

MOST_ITERATIONS = 255
"""Largest number of iterations: PhysX stores it in a byte."""


@dataclass(frozen=True)
class PhysXRobot:
    """A World's robot in PhysX.

    The base is the first of its links, which are bodies by name, and of its entities, which enter a scene in their
    order. Joints are in the World's order.
    """

    links: dict[str, Handle]
    entities: tuple[Handle, ...]
    articulation: Handle
    joints: tuple[Handle, ...]


def build_robot(sapien: ModuleType, world: World, materials: Mapping[str, Handle]) -> PhysXRobot:
    """Build the robot of a world at its start, without motors and without adding it to a scene.

    The materials are by surface, in the order of their grounds; that of "" is the first.
    """
    bodies = {body.name: body for body in world.bodies}
    base = world.bodies[0]
    links = {base.name: _link(sapien, base, None, materials)}
    for joint in _outwards(world):
        links[joint.child] = _link(sapien, bodies[joint.child], links[joint.parent], materials)
        _connect(sapien, links[joint.child].joint, joint)
    if world.fixed:
        links[base.name].joint.type = "fixed"
    entities = tuple(sapien.Entity().add_component(link) for link in links.values())
    entities[0].pose = pose_of(sapien, (0.0, 0.0, world.start_height_m), world.start_turn)
    articulation = links[base.name].articulation
    articulation.solver_position_iterations = min(world.solver_iterations, MOST_ITERATIONS)
    articulation.solver_velocity_iterations = 1  # removes the speed that separating overlapping bodies adds
    articulation.sleep_threshold = 0.0
    return PhysXRobot(links, entities, articulation, tuple(links[joint.child].joint for joint in world.joints))


def set_masses(link: Handle, body: Body) -> None:
    """Set mass and moments of inertia of a body; a new centre of mass would leave rounding errors in PhysX's joints."""
    link.mass = body.mass_kg
    link.inertia = np.array(inertia_of(body).moments_kg_m2)


def _outwards(world: World) -> Iterator[Joint]:
    """Return the joints in order from the base outwards."""
    reached = [world.bodies[0].name]
    for name in reached:
        for joint in world.joints:
            if joint.parent == name:
                reached.append(joint.child)
                yield joint


def _link(sapien: ModuleType, body: Body, parent: Handle | None, materials: Mapping[str, Handle]) -> Handle:
    """Create a link, slowed only by contacts."""
    link = sapien.physx.PhysxArticulationLinkComponent(parent)
    number = list(materials).index(body.surface)
    for part in body.parts:
        if part.collides:
            link.attach(build_shape(sapien, part, materials[body.surface], number))
    set_masses(link, body)
    link.cmass_local_pose = pose_of(sapien, body.center_m, inertia_of(body).turn)
    link.linear_damping = link.angular_damping = 0.0
    link.max_linear_velocity = link.max_angular_velocity = UNLIMITED
    return link


def _connect(sapien: ModuleType, handle: Handle, joint: Joint) -> None:
    """Configure a joint; PhysX's turn about their own x, or slide along it.

    PhysX's friction of joints is left out: it is a share of the force that a joint carries, not a torque.
    """
    turn = turn_from_x(joint.axis)
    handle.type = "prismatic" if joint.slides else "revolute_unwrapped"
    in_parent = turn if joint.turn == UNTURNED else product(np.array(joint.turn), turn)
    handle.pose_in_parent = pose_of(sapien, joint.origin_m, in_parent)
    handle.pose_in_child = pose_of(sapien, (0.0, 0.0, 0.0), turn)
    handle.limit = [[-np.inf, np.inf] if joint.limits is None else list(joint.limits)]
    handle.friction = 0.0


RIGIDITY = 1e4
"""Weight of a servo's target speed relative to the current speed of the joint: see `_servo`."""

LARGEST_GAIN = 0.999
"""Largest gain of a servo: one that closes the whole error in a step would be infinitely stiff."""

STRONGEST = 1e30
"""Limit of a drive without a limit, in single precision."""


def within(value: float, limit: float) -> float:
    """Return a value limited to ± `limit`; nan for nan."""
    return -limit if value < -limit else limit if value > limit else value


def resists(joint: Joint) -> bool:
    """Return whether a joint needs torques in each step: for dry friction, or damping beside a motor."""
    follows = isinstance(joint.motor, Motor) or (isinstance(joint.motor, PDMotor) and joint.motor.follows != "torque")
    return joint.dry_friction > 0 or joint.static_friction > 0 or (follows and joint.damping > 0)


class JointDrive:
    """What acts in one joint, in one rollout.

    Attributes:
        steps: true if its torque must be set before each step.
        force: torque beside the drive.
    """

    def __init__(self, handle: Handle, joint: Joint, inverse_inertia: float, step_s: float) -> None:
        self._handle, self._step_s, self._kick = handle, step_s, step_s * inverse_inertia
        self._damping = joint.damping
        self._frictions = joint.dry_friction, joint.static_friction, joint.stribeck_speed
        self._law = PDLaw()
        if isinstance(joint.motor, PDMotor):  # the law of a rigid joint: PhysX itself solves for the end of the step
            limit = min(joint.motor.max_torque_nm, STRONGEST)
            self._law = pd_law(joint.motor, 0.0, 0.0)._replace(strongest_nm=limit)
        self._servo = isinstance(joint.motor, Motor)
        self._driven = isinstance(joint.motor, PDMotor) and joint.motor.follows != "torque"
        self.steps = resists(joint)
        self.force = self._target = self._brake = 0.0
        self._speed: float | None = None
        self._weak = False
        handle.armature = [[joint.armature]]
        handle.max_velocity = joint.motor.max_speed_rad_s if isinstance(joint.motor, Motor) else UNLIMITED
        handle.set_drive_target(0.0)
        handle.set_drive_velocity_target(0.0)
        if isinstance(joint.motor, Motor):
            _servo(handle, joint.motor, step_s)
        else:
            self._drive(weak=False)

    def command(self, target: float) -> None:
        """Set a new target of the motor."""
        self._target = target
        if self._servo or self._law.stiffness:
            self._handle.set_drive_target(target)
        elif self._driven:
            self._drive(weak=self._weak)
        else:
            self.force = within(self._law.feed * target, self._law.strongest_nm) + self._brake

    def motor_nm(self, angle: float, speed: float) -> float:
        """Return the torque of a PD motor in the step that ended at an angle and a speed; 0 for any other."""
        return pd_torque(self._target, angle, speed, self._law)

    def update(self, angle: float, speed: float) -> None:
        """Set drive and torque for the next step, which begins at an angle and a speed."""
        coasting = speed
        if self._speed is not None:
            own = self.motor_nm(angle, speed) - self._damping * speed + self._brake
            coasting += speed - self._speed - self._kick * own
        self._speed = speed
        free = self._ending(coasting, angle, self._law)
        weak = self._driven and abs(self._asked(angle, free[0])) > self._law.strongest_nm
        sign = 1.0 if self._asked(angle, free[0]) > 0 else -1.0
        ending, share = free
        motor = 0.0
        if weak:
            motor = sign * self._law.strongest_nm
            ending, share = self._ending(coasting + self._kick * motor, angle, PDLaw())
        elif not self._driven:
            motor = within(self._law.feed * self._target, self._law.strongest_nm)
            ending = share * (coasting + self._kick * motor)
        self._brake = within(-ending / (share * self._kick), friction_nm(*self._frictions, speed))
        self.force = motor + self._brake
        if self._servo:
            self.force -= self._damping * (ending + share * self._kick * self._brake)
        elif weak != self._weak:
            self._drive(weak=weak)

    def _ending(self, coasting: float, angle: float, law: PDLaw) -> tuple[float, float]:
        """Return the speed at the end of a step without friction, and what a kick of speed then adds to it."""
        step_s, kick = self._step_s, self._kick
        share = 1.0 / (1.0 + kick * (law.damping + self._damping + step_s * law.stiffness))
        pushed = (law.stiffness * (self._target - angle) + law.feed * self._target) if self._driven else 0.0
        return share * (coasting + kick * pushed), share

    def _asked(self, angle: float, ending: float) -> float:
        """Return the torque without its limit, at the end of a step."""
        boundless = self._law._replace(strongest_nm=STRONGEST)
        return pd_torque(self._target, angle + self._step_s * ending, ending, boundless)

    def _drive(self, *, weak: bool) -> None:
        """Let PhysX's drive be the motor with the joint's damping, or the damping alone if the motor is too weak.

        Without damping, the drive has the limit of the motor itself.
        """
        self._weak = weak
        driven = self._driven and not weak
        kp, kd, feed = self._law[:3] if driven else (0.0, 0.0, 0.0)
        resisting = kd + self._damping
        limit = self._law.strongest_nm if driven and not self._damping else STRONGEST
        self._handle.set_drive_velocity_target(feed * self._target / resisting if feed else 0.0)
        self._handle.set_drive_properties(kp, resisting, limit, "force")


def _servo(handle: Handle, motor: Motor, time_step_s: float) -> None:
    """Configure a World's servo as a PhysX drive, a spring k with a damper d.

    A drive in acceleration mode is solved implicitly and independently of inertia: from speed v and error e, a step h
    leads to v' = (v + h k e) / (1 + h d + h² k). With d = R/h and k = g (1 + R) / (1 - g) / h² that is
    v' = g e/h + v (1 - g) / (1 + R): for a large R, this is World's velocity constraint, which closes the share g of
    the error in each step. The largest force of the drive is the motor's torque. The largest speed applies to the
    joint, whatever turns it.
    """
    gain = min(motor.position_gain, LARGEST_GAIN)
    stiffness = gain * (1 + RIGIDITY) / (1 - gain) / time_step_s**2
    handle.set_drive_properties(stiffness, RIGIDITY / time_step_s, motor.max_torque_nm, "acceleration")
