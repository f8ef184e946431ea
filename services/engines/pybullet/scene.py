"""A World as bodies in its own Bullet server, built once and reset before each rollout."""

from dataclasses import dataclass
from types import ModuleType

import numpy as np

from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.kinematics import inverse, rotated
from gaplab.services.core.shapes import Box
from gaplab.services.core.world import Body, Joint, Material, World

UNTURNED = (0.0, 0.0, 0.0, 1.0)
FAR_AWAY = (0.0, 0.0, 1e4)
"""Position of the base, m, in which nothing touches the ground."""

BASE = -1
"""Bullet's index of the base. Links count from 0, and link i belongs to joint i."""


class PyBulletScene:
    """One world in one server, with its saved state at time 0.

    Source: the PyBullet Quickstart Guide. `restoreState` resets positions, speeds and contacts, but neither motors nor
    values set by `changeDynamics`. Therefore `start` applies the material again, and a rollout commands every motor.

    Attributes:
        client: id of the server; every call names it, so scenes do not interfere.
        robot: Bullet's id of the robot.
        colliding: Bullet's indices of the links that can touch the ground.
    """

    def __init__(self, bullet: ModuleType, world: World) -> None:
        self.bullet = bullet
        self.world = world
        self.client: int = bullet.connect(bullet.DIRECT)
        self._set_up_physics()
        tree = _tree(world)
        self.robot = self._create_robot(tree)
        self.colliding = tuple(index for index, body in enumerate(tree.bodies, start=BASE) if body.collides)
        self._motors = tuple(
            (index, joint.motor) for index, joint in enumerate(world.joints) if joint.motor is not None
        )
        self._from_center_of_mass = [-each for each in tree.bodies[0].center_m]
        self._finish_robot(tree)
        self._initial: int = bullet.saveState(physicsClientId=self.client)

    def start(self, material: Material, friction: float) -> None:
        """Reset to time 0, with a material and the initial coefficient of friction of its contacts.

        `restoreState` keeps contact points of the last rollout, with their impulses, where a foot ended near its start.
        Far from the ground they are dropped.
        """
        self.bullet.resetBasePositionAndOrientation(self.robot, FAR_AWAY, UNTURNED, physicsClientId=self.client)
        self.bullet.performCollisionDetection(physicsClientId=self.client)
        self.bullet.restoreState(self._initial, physicsClientId=self.client)
        bounce, client = material.restitution, self.client
        for link in self.colliding:
            self.bullet.changeDynamics(self.robot, link, restitution=bounce, physicsClientId=client)
            self.set_friction(link, friction)

    def set_friction(self, link: int, friction: float) -> None:
        """Set the coefficient of friction of a link from the next step on."""
        self.bullet.changeDynamics(self.robot, link, lateralFriction=friction, physicsClientId=self.client)

    def command(self, actuator: int, target: float) -> None:
        """Set a new target for a motor, rad."""
        index, motor = self._motors[actuator]
        self.bullet.setJointMotorControl2(
            self.robot,
            index,
            self.bullet.POSITION_CONTROL,
            targetPosition=target,
            force=motor.max_torque_nm,
            positionGain=motor.position_gain,
            velocityGain=1.0,
            maxVelocity=motor.max_speed_rad_s,
            physicsClientId=self.client,
        )

    def step(self, count: int) -> None:
        """Advance by a number of time steps."""
        advance, client = self.bullet.stepSimulation, self.client
        for _ in range(count):
            advance(physicsClientId=client)

    def pose(self) -> FloatArray:
        """Return `(7,)`: position and quaternion of the base's frame."""
        position, turn = self.bullet.getBasePositionAndOrientation(self.robot, physicsClientId=self.client)
        origin, turn = self.bullet.multiplyTransforms(position, turn, self._from_center_of_mass, UNTURNED)
        return np.array([*origin, *turn])

    def angles(self) -> FloatArray:
        """Return the joint angles `(joints,)`, rad."""
        return self._states(0)

    def speeds(self) -> FloatArray:
        """Return the joint speeds `(joints,)`, rad/s."""
        return self._states(1)

    def turning(self) -> FloatArray:
        """Return the angular velocity of the base, `(3,)`, rad/s, in its own frame."""
        _, turning = self.bullet.getBaseVelocity(self.robot, physicsClientId=self.client)
        return rotated(inverse(self.pose()[3:]), np.array(turning))

    def torques(self) -> FloatArray:
        """Return the torques of the motors in the last step, `(joints,)`, N·m."""
        return self._states(3)

    def close(self) -> None:
        """Close the server."""
        self.bullet.disconnect(physicsClientId=self.client)

    def _states(self, place: int) -> FloatArray:
        """Return one of Bullet's numbers about each joint, `(joints,)`."""
        joints = range(len(self.world.joints))
        states = self.bullet.getJointStates(self.robot, joints, physicsClientId=self.client) if joints else ()
        return np.array([state[place] for state in states], dtype=float)

    def _set_up_physics(self) -> None:
        bullet, client = self.bullet, self.client
        bullet.setPhysicsEngineParameter(
            fixedTimeStep=self.world.time_step_s,
            numSolverIterations=self.world.solver_iterations,
            numSubSteps=0,
            deterministicOverlappingPairs=1,
            physicsClientId=client,
        )
        bullet.setGravity(0, 0, -self.world.gravity_m_s2, physicsClientId=client)
        plane = bullet.createCollisionShape(bullet.GEOM_PLANE, physicsClientId=client)
        self.ground: int = bullet.createMultiBody(0, plane, physicsClientId=client)
        # Bullet multiplies the coefficients of two bodies in contact: with 1 here, the robot's apply.
        bullet.changeDynamics(self.ground, BASE, lateralFriction=1.0, restitution=1.0, physicsClientId=client)

    def _create_robot(self, tree: "_Tree") -> int:
        base, *links = tree.bodies
        robot: int = self.bullet.createMultiBody(
            baseMass=base.mass_kg,
            baseCollisionShapeIndex=self._create_shape(base),
            basePosition=(0.0, 0.0, self.world.start_height_m),
            baseInertialFramePosition=base.center_m,
            linkMasses=[link.mass_kg for link in links],
            linkCollisionShapeIndices=[self._create_shape(link) for link in links],
            linkVisualShapeIndices=[-1] * len(links),
            linkPositions=[joint.origin_m for joint in tree.joints],
            linkOrientations=[UNTURNED] * len(links),
            linkInertialFramePositions=[link.center_m for link in links],
            linkInertialFrameOrientations=[UNTURNED] * len(links),
            linkParentIndices=tree.parents,
            linkJointTypes=[self.bullet.JOINT_REVOLUTE] * len(links),
            linkJointAxis=[joint.axis for joint in tree.joints],
            physicsClientId=self.client,
        )
        return robot

    def _create_shape(self, body: Body) -> int:
        shape, options = body.shape, {"collisionFramePosition": body.center_m, "physicsClientId": self.client}
        if isinstance(shape, Box):
            half = [edge / 2 for edge in shape.size_m]
            return int(self.bullet.createCollisionShape(self.bullet.GEOM_BOX, halfExtents=half, **options))
        return int(self.bullet.createCollisionShape(self.bullet.GEOM_SPHERE, radius=shape.radius_m, **options))

    def _finish_robot(self, tree: "_Tree") -> None:
        """Remove damping and unwanted collisions, and free the hinges without motors.

        Bullet computes a link's inertia from its collision shape. A link without a shape would have none, and
        `changeDynamics(localInertiaDiagonal=...)` would change the base's instead. Therefore every body gets its shape.
        """
        bullet, robot, client = self.bullet, self.robot, self.client
        for index, body in enumerate(tree.bodies, start=BASE):
            bullet.changeDynamics(robot, index, linearDamping=0.0, angularDamping=0.0, physicsClientId=client)
            if not body.collides:
                bullet.setCollisionFilterGroupMask(robot, index, 0, 0, physicsClientId=client)
        for index in range(len(tree.joints)):
            bullet.setJointMotorControl2(robot, index, bullet.VELOCITY_CONTROL, force=0.0, physicsClientId=client)


@dataclass(frozen=True)
class _Tree:
    """Bodies in Bullet's order: the base, then the child of each joint; in `parents`, the base is 0."""

    bodies: tuple[Body, ...]
    joints: tuple[Joint, ...]
    parents: tuple[int, ...]


def _tree(world: World) -> _Tree:
    by_name = {body.name: body for body in world.bodies}
    names = [world.bodies[0].name, *(joint.child for joint in world.joints)]
    return _Tree(
        bodies=tuple(by_name[name] for name in names),
        joints=world.joints,
        parents=tuple(names.index(joint.parent) for joint in world.joints),
    )
