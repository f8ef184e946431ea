"""A World's robot in Bullet.

Bullet gives a link one shape, and only a plain hull can do without a margin. Therefore the further shapes of a body
are links without mass, welded to it.
"""

from dataclasses import dataclass
from types import ModuleType
from typing import Any

import numpy as np

from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.inertias import inertia_of
from gaplab.services.core.kinematics import inverse, product, rotated
from gaplab.services.core.shapes import ORIGIN, UNTURNED, Box, Capsule, Cylinder, Hull, Part, Quaternion, Sphere, Vector
from gaplab.services.core.world import Body, World

MOST_LINKS = 127
"""Most links of a robot beside its base; Bullet has no place for the state of others."""

BASE = -1
"""Bullet's index of the base. Links count from 0."""

NO_SHAPE = -1
NO_JOINT = -1


@dataclass(frozen=True)
class Link:
    """A link of Bullet's.

    Attributes:
        body: the body that it is, or that it is welded to.
        part: its shape; None without.
        welded: true if it is a further shape of its body, without mass.
        parent: number of its parent's link, counted from 0 for the base.
        joint: number of its joint; `NO_JOINT` for the base and a welded link.
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


def build_robot(bullet: ModuleType, client: int, world: World) -> PyBulletRobot:
    """Build the robot of a world at its start, in the server `client`."""
    links = links_of(world)
    robot = _create(bullet, client, world, links)
    joints = tuple(next(i for i, link in enumerate(links) if link.joint == n) + BASE for n in range(len(world.joints)))
    made = PyBulletRobot(robot, links, joints)
    _finish(bullet, client, world, made)
    return made


def set_masses(bullet: ModuleType, client: int, made: PyBulletRobot, world: World) -> None:
    """Set masses and inertia.

    Bullet computes the inertia of a link from its shape whenever its mass is set: right for boxes and spheres alone.
    """
    bodies = {body.name: body for body in world.bodies}
    for index, link in enumerate(made.links, start=BASE):
        if not link.welded and not (world.fixed and index == BASE):
            body = bodies[link.body.name]
            bullet.changeDynamics(made.robot, index, mass=body.mass_kg, physicsClientId=client)
            _set_inertia(bullet, client, made.robot, index, body)


def _set_inertia(bullet: ModuleType, client: int, robot: int, index: int, body: Body) -> None:
    if not _is_bullets(body):
        moments = inertia_of(body).moments_kg_m2
        bullet.changeDynamics(robot, index, localInertiaDiagonal=moments, physicsClientId=client)


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


def _create(bullet: ModuleType, client: int, world: World, links: tuple[Link, ...]) -> int:
    base, *others = links
    frames = [(ORIGIN, UNTURNED) if link.welded else inertial_frame(link.body) for link in links]
    joints = [world.joints[link.joint] if link.joint >= 0 else None for link in others]
    kinds = {True: bullet.JOINT_PRISMATIC, False: bullet.JOINT_REVOLUTE}
    robot: int = bullet.createMultiBody(
        baseMass=0.0 if world.fixed else base.body.mass_kg,  # Bullet fixes a base without mass
        baseCollisionShapeIndex=_shape(bullet, client, base, *frames[0]),
        basePosition=(0.0, 0.0, world.start_height_m),
        baseOrientation=world.start_turn,
        baseInertialFramePosition=frames[0][0],
        baseInertialFrameOrientation=frames[0][1],
        linkMasses=[0.0 if link.welded else link.body.mass_kg for link in others],
        linkCollisionShapeIndices=[
            _shape(bullet, client, link, *frame) for link, frame in zip(others, frames[1:], strict=True)
        ],
        linkVisualShapeIndices=[NO_SHAPE] * len(others),
        linkPositions=[joint.origin_m if joint else ORIGIN for joint in joints],
        linkOrientations=[joint.turn if joint else UNTURNED for joint in joints],
        linkInertialFramePositions=[position for position, _ in frames[1:]],
        linkInertialFrameOrientations=[turn for _, turn in frames[1:]],
        linkParentIndices=[link.parent for link in others],
        linkJointTypes=[kinds[joint.slides] if joint else bullet.JOINT_FIXED for joint in joints],
        linkJointAxis=[joint.axis if joint else (0.0, 0.0, 1.0) for joint in joints],
        physicsClientId=client,
    )
    return robot


def _shape(bullet: ModuleType, client: int, link: Link, center: Vector, turn: Quaternion) -> int:
    """Create the shape of a link whose centre of mass and principal axes are given.

    A hull is put into the inertial frame: Bullet keeps only a shape in this place plain, and a plain one can do
    without a margin.
    """
    part = link.part
    if part is None:
        return NO_SHAPE
    options: dict[str, Any] = {"collisionFramePosition": part.center_m, "physicsClientId": client}
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


def _finish(bullet: ModuleType, client: int, world: World, made: PyBulletRobot) -> None:
    """Remove damping, margins and unwanted collisions; set inertia, limits and starts; free the joints."""
    robot = made.robot
    for index, link in enumerate(made.links, start=BASE):
        bullet.changeDynamics(robot, index, linearDamping=0.0, angularDamping=0.0, physicsClientId=client)
        if link.part is not None and not link.part.collides:
            bullet.setCollisionFilterGroupMask(robot, index, 0, 0, physicsClientId=client)
        if link.part is not None and isinstance(link.part.shape, Hull):
            bullet.changeDynamics(robot, index, collisionMargin=0.0, physicsClientId=client)
        if not link.welded and not (world.fixed and index == BASE):
            _set_inertia(bullet, client, robot, index, link.body)
    for index, joint in zip(made.joints, world.joints, strict=True):
        bullet.setJointMotorControl2(robot, index, bullet.VELOCITY_CONTROL, force=0.0, physicsClientId=client)
        if joint.limits is not None:
            lower, upper = joint.limits
            options = {"jointLowerLimit": lower, "jointUpperLimit": upper, "physicsClientId": client}
            bullet.changeDynamics(robot, index, **options)
        if joint.start:
            bullet.resetJointState(robot, index, joint.start, physicsClientId=client)
