"""A World's robot in Bullet, with the torques that Bullet has no motor for: PD motors, damping, dry friction.

Bullet gives a link one shape, and only a plain hull can do without a margin. Therefore the further shapes of a body
are links without mass, welded to it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from inspect import isbuiltin
from types import ModuleType
from typing import Any, NamedTuple, TypeAlias
from weakref import finalize

import numpy as np

from gaplab.services.core.arrays import FloatArray
from gaplab.services.world.inertias import inertia_of, inverse_inertias
from gaplab.services.world.kinematics import inverse, product, rotated
from gaplab.services.world.world import (
    ORIGIN,
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
    Sphere,
    Vector,
    World,
    friction_nm,
    pd_law,
    pd_torque,
)

MOST_LINKS = 127
"""Most links of a robot besides its base; Bullet has no place for the state of others."""

BASE = -1
"""Bullet's index of the base. Links count from 0."""

NO_SHAPE = -1
NO_JOINT = -1


class Server:
    """Bullet's functions, each call of which goes to one server; a server that nothing refers to closes by itself."""

    def __init__(self, bullet: ModuleType) -> None:
        self._bullet = bullet
        self.client: int = bullet.connect(bullet.DIRECT)
        self.close = finalize(self, bullet.disconnect, physicsClientId=self.client)

    def __getattr__(self, name: str) -> Any:  # noqa: ANN401 - Bullet has no types
        found = getattr(self._bullet, name)
        bound = partial(found, physicsClientId=self.client) if isbuiltin(found) else found
        setattr(self, name, bound)
        return bound


@dataclass(frozen=True)
class Link:
    """A link of Bullet's: a body, or a further shape of one, without mass, that is welded to it.

    Its parent is the number of a link, 0 for the base; it has a joint's number unless it is the base, or welded.
    """

    body: Body
    part: Part | None
    welded: bool = False
    parent: int = 0
    joint: int = NO_JOINT


@dataclass(frozen=True)
class PyBulletRobot:
    """A robot in a server.

    Attributes:
        robot: Bullet's id.
        links: its links; the first is the base, whose index is -1.
        joints: index of the link of each of the world's joints.
    """

    robot: int
    links: tuple[Link, ...]
    joints: tuple[int, ...]

    @property
    def colliding(self) -> dict[int, Body]:
        """Return the body of each link that can touch the ground, by Bullet's index."""
        return {
            index: link.body
            for index, link in enumerate(self.links, start=BASE)
            if link.part is not None and link.part.collides
        }


def build_robot(bullet: Server, world: World) -> PyBulletRobot:
    """Build the robot of a world at its start."""
    links = links_of(world)
    robot = _create(bullet, world, links)
    joints = tuple(next(i for i, link in enumerate(links) if link.joint == n) + BASE for n in range(len(world.joints)))
    made = PyBulletRobot(robot, links, joints)
    _finish(bullet, world, made)
    return made


def set_masses(bullet: Server, made: PyBulletRobot, world: World) -> None:
    """Set masses and inertia.

    Bullet computes the inertia of a link from its shape whenever its mass is set: right for boxes and spheres alone.
    """
    bodies = {body.name: body for body in world.bodies}
    for index, link in enumerate(made.links, start=BASE):
        if not link.welded and not (world.fixed and index == BASE):
            body = bodies[link.body.name]
            bullet.changeDynamics(made.robot, index, mass=body.mass_kg)
            _set_inertia(bullet, made.robot, index, body)


def _set_inertia(bullet: Server, robot: int, index: int, body: Body) -> None:
    if not _is_bullets(body):
        moments = inertia_of(body).moments_kg_m2
        bullet.changeDynamics(robot, index, localInertiaDiagonal=moments)


def _is_bullets(body: Body) -> bool:
    """Return whether Bullet itself computes the inertia of a body."""
    return body.inertia is None and isinstance(body.shape, Box | Sphere)


def inertial_frame(body: Body) -> tuple[Vector, Quaternion]:
    """Return centre of mass and turn of the principal axes, in the frame of a body."""
    return body.center_m, UNTURNED if _is_bullets(body) else inertia_of(body).turn


def links_of(world: World) -> tuple[Link, ...]:
    """Return the links depth first: Bullet would put them into this order itself, and number them by it."""
    bodies = {body.name: body for body in world.bodies}
    links: list[Link] = []

    def add(body: Body, parent: int, joint: int) -> None:
        links.append(Link(body, _first(body), parent=parent, joint=joint))
        place = len(links) - 1
        links.extend(Link(body, part, welded=True, parent=place) for part in _colliding(body)[1:])
        for number, each in enumerate(world.joints):
            if each.parent == body.name:
                add(bodies[each.child], place, number)

    add(world.bodies[0], 0, NO_JOINT)
    return tuple(links)


def _colliding(body: Body) -> list[Part]:
    return [part for part in body.parts if part.collides]


def _first(body: Body) -> Part | None:
    """Return the shape of a body's own link: a solid one that does not collide stays, because it has the inertia."""
    if colliding := _colliding(body):
        return colliding[0]
    return None if isinstance(body.shape, tuple) else body.parts[0]


def _create(bullet: Server, world: World, links: tuple[Link, ...]) -> int:
    base, *others = links
    frames = [(ORIGIN, UNTURNED) if link.welded else inertial_frame(link.body) for link in links]
    joints = [world.joints[link.joint] if link.joint >= 0 else None for link in others]
    kinds = {True: bullet.JOINT_PRISMATIC, False: bullet.JOINT_REVOLUTE}
    robot: int = bullet.createMultiBody(
        baseMass=0.0 if world.fixed else base.body.mass_kg,  # Bullet fixes a base without mass
        baseCollisionShapeIndex=_shape(bullet, base, *frames[0]),
        basePosition=(0.0, 0.0, world.start_height_m),
        baseOrientation=world.start_turn,
        baseInertialFramePosition=frames[0][0],
        baseInertialFrameOrientation=frames[0][1],
        linkMasses=[0.0 if link.welded else link.body.mass_kg for link in others],
        linkCollisionShapeIndices=[
            _shape(bullet, link, *frame) for link, frame in zip(others, frames[1:], strict=True)
        ],
        linkVisualShapeIndices=[NO_SHAPE] * len(others),
        linkPositions=[joint.origin_m if joint else ORIGIN for joint in joints],
        linkOrientations=[joint.turn if joint else UNTURNED for joint in joints],
        linkInertialFramePositions=[position for position, _ in frames[1:]],
        linkInertialFrameOrientations=[turn for _, turn in frames[1:]],
        linkParentIndices=[link.parent for link in others],
        linkJointTypes=[kinds[joint.slides] if joint else bullet.JOINT_FIXED for joint in joints],
        linkJointAxis=[joint.axis if joint else (0.0, 0.0, 1.0) for joint in joints],
    )
    return robot


def _shape(bullet: Server, link: Link, center: Vector, turn: Quaternion) -> int:
    """Create the shape of a link whose centre of mass and principal axes are given.

    A hull is put into the inertial frame: Bullet keeps only a shape in this place plain, and a plain one can do
    without a margin.
    """
    part = link.part
    if part is None:
        return NO_SHAPE
    options: dict[str, Any] = {"collisionFramePosition": part.center_m}
    if part.turn != UNTURNED:
        options["collisionFrameOrientation"] = part.turn
    match part.shape:
        case Box(size_m=edges):
            shape = bullet.createCollisionShape(bullet.GEOM_BOX, halfExtents=[each / 2 for each in edges], **options)
        case Sphere(radius_m=radius):
            shape = bullet.createCollisionShape(bullet.GEOM_SPHERE, radius=radius, **options)
        case Capsule(radius_m=radius, length_m=length):
            shape = bullet.createCollisionShape(bullet.GEOM_CAPSULE, radius=radius, height=length, **options)
        case Cylinder(radius_m=radius, length_m=length):
            shape = bullet.createCollisionShape(bullet.GEOM_CYLINDER, radius=radius, height=length, **options)
        case Hull(points_m=points):
            options |= {"collisionFramePosition": center, "collisionFrameOrientation": turn}
            vertices = _in_frame(part, np.array(points), center, turn).tolist()
            shape = bullet.createCollisionShape(bullet.GEOM_MESH, vertices=vertices, **options)
    return int(shape)


def _in_frame(part: Part, points: FloatArray, center: Vector, turn: Quaternion) -> FloatArray:
    """Return the points `(n, 3)` of a part in a frame that is given in the body's frame, as is the part's."""
    back = inverse(np.array(turn))
    return rotated(product(back, np.array(part.turn)), points) + rotated(back, np.subtract(part.center_m, center))


def _finish(bullet: Server, world: World, made: PyBulletRobot) -> None:
    """Remove damping, margins and unwanted collisions; set inertia, limits and starts; free the joints."""
    robot = made.robot
    for index, link in enumerate(made.links, start=BASE):
        bullet.changeDynamics(robot, index, linearDamping=0.0, angularDamping=0.0)
        if link.part is not None and not link.part.collides:
            bullet.setCollisionFilterGroupMask(robot, index, 0, 0)
        if link.part is not None and isinstance(link.part.shape, Hull):
            bullet.changeDynamics(robot, index, collisionMargin=0.0)
        if not link.welded and not (world.fixed and index == BASE):
            _set_inertia(bullet, robot, index, link.body)
    for index, joint in zip(made.joints, world.joints, strict=True):
        bullet.setJointMotorControl2(robot, index, bullet.VELOCITY_CONTROL, force=0.0)
        if joint.limits is not None:
            lower, upper = joint.limits
            bullet.changeDynamics(robot, index, jointLowerLimit=lower, jointUpperLimit=upper)
        if joint.start:
            bullet.resetJointState(robot, index, joint.start)


States: TypeAlias = tuple[tuple[float, ...], ...]
"""Bullet's numbers about joints: angle, speed, and more."""

STIFFEST = 1.5
"""Largest share (kd + h kp) h w of a joint's inertia that its motor may have in an inner step of length h: beyond it,
motors of joints that move each other swing up."""

MOST_INNER_STEPS = 16
"""Largest number of Bullet's steps in one of the world's."""


class _Resisted(NamedTuple):
    """A joint's law, and what resists it; with damping, a joint that coasts at c ends the step at c · share.

    Attributes:
        kick: speed by torque at the end of a step, without damping.
        share: 1 / (1 + kick · damping).
        frictions: its dry, its static friction and the speed of that, N·m, if no motor of Bullet's can be them.
    """

    law: PDLaw
    kick: float
    damping: float
    share: float
    frictions: tuple[float, float, float] | None


class Torques:
    """The torques of some joints, computed before each step.

    They are those of the end of the step, if the joint moved alone under the load of the step before. The load is what
    else accelerates the joint: the change of its speed in that step, less what these torques did.

    Attributes:
        joints: numbers of the joints.
        inner_steps: number of steps of Bullet's in a time step of the world: more than one where motors are too strong.
    """

    def __init__(self, world: World) -> None:
        self.joints = tuple(number for number, joint in enumerate(world.joints) if needs_torque(joint))
        self._places = {joint: place for place, joint in enumerate(self.joints)}
        inverse = inverse_inertias(_without_armature(world)).tolist() if self.joints else []
        pairs = [(world.joints[number], inverse[number]) for number in self.joints]
        self.inner_steps = _inner_steps(pairs, world.time_step_s)
        step_s = world.time_step_s / self.inner_steps
        self._resisted = [_resisted(joint, response, step_s) for joint, response in pairs]
        self.reset()

    def reset(self) -> None:
        """Forget targets, speeds and torques, for another rollout."""
        count = len(self.joints)
        self._targets, self._motors_nm = [0.0] * count, [0.0] * count
        self._expected: list[float | None] = [None] * count

    def command(self, joint: int, target: float) -> None:
        """Set a new target for the motor of a joint."""
        self._targets[self._places[joint]] = target

    def motor_nm(self, joint: int) -> float:
        """Return the torque of a joint's motor in the last step; 0 without one."""
        return self._motors_nm[self._places[joint]] if joint in self._places else 0.0

    def of(self, states: States) -> list[float]:
        """Return the torques of the joints in a step with these states at its start, and remember those of motors."""
        total = []
        for place, (target, state, resisted) in enumerate(zip(self._targets, states, self._resisted, strict=True)):
            angle, speed = state[0], state[1]
            law, kick, damping, share, frictions = resisted
            expected = self._expected[place]
            coasting = share * (speed if expected is None else speed + (speed - expected))
            torque = self._motors_nm[place] = pd_torque(target, angle, coasting, law)
            ending = coasting + share * kick * torque
            torque -= damping * ending
            if frictions is not None:
                friction = friction_nm(*frictions, speed)
                torque -= min(max(ending / (share * kick), -friction), friction)
            self._expected[place] = speed + kick * torque
            total.append(torque)
        return total


def needs_torque(joint: Joint) -> bool:
    """Return whether Bullet lacks a motor for what acts in a joint."""
    return isinstance(joint.motor, PDMotor) or joint.damping > 0 or _needs_friction(joint)


def _needs_friction(joint: Joint) -> bool:
    """Return whether Bullet lacks a motor for a joint's friction: beside a servo, or if it sticks."""
    return joint.static_friction > 0 or (isinstance(joint.motor, Motor) and joint.dry_friction > 0)


def _inner_steps(pairs: Sequence[tuple[Joint, float]], step_s: float) -> int:
    """Return the number of inner steps, given joints and their inverse inertias."""
    for count in range(1, MOST_INNER_STEPS):
        if all(_strength(joint, step_s / count) * inverse <= STIFFEST for joint, inverse in pairs):
            return count
    return MOST_INNER_STEPS if pairs else 1


def _strength(joint: Joint, step_s: float) -> float:
    """Return the inertia that a joint's motor and damping have in a step, kg m²."""
    damping, stiffness = joint.damping, 0.0
    if isinstance(joint.motor, PDMotor) and joint.motor.follows != "torque":
        damping += joint.motor.kd
        stiffness = joint.motor.kp if joint.motor.follows == "position" else 0.0
    return step_s * (damping + step_s * stiffness)


def _resisted(joint: Joint, inverse: float, step_s: float) -> _Resisted:
    share = 1.0 / (1.0 + step_s * joint.damping * inverse)
    law = pd_law(joint.motor, share * inverse, step_s) if isinstance(joint.motor, PDMotor) else PDLaw()
    frictions = (joint.dry_friction, joint.static_friction, joint.stribeck_speed) if _needs_friction(joint) else None
    return _Resisted(law, step_s * inverse, joint.damping, share, frictions)


def _without_armature(world: World) -> World:
    if not any(joint.armature for joint in world.joints):
        return world
    return replace(world, joints=tuple(replace(joint, armature=0.0) for joint in world.joints))
