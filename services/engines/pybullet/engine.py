"""The PyBullet engine, and a World in its own Bullet server, built once and reset before each rollout.

Bullet has one coefficient of friction. For a static and a dynamic one, each link in contact sticks or slides.
"""

from collections.abc import Callable
from importlib import import_module
from math import hypot
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np

from gaplab.schemas.base import Frozen
from gaplab.services.core.arrays import FloatArray
from gaplab.services.engines.base import USUALLY_IN_PLACE
from gaplab.services.engines.pybullet.robot import (
    BASE,
    MOST_LINKS,
    Server,
    Torques,
    build_robot,
    inertial_frame,
    links_of,
    set_masses,
)
from gaplab.services.engines.stepped import SteppedEngine
from gaplab.services.world.kinematics import Placed
from gaplab.services.world.sensing import gravity_m_s2
from gaplab.services.world.world import UNTURNED, Material, Motor, Quaternion, Vector, World

FAR_AWAY = (0.0, 0.0, 1e4)
"""Position of the base, m, in which nothing touches the ground."""

ANGLE, SPEED, MOTOR_TORQUE = 0, 1, 3
"""Indices into Bullet's numbers about a joint."""


class PyBulletScene:
    """One world in one server, with its saved state at time 0.

    Source: the PyBullet Quickstart Guide. `restoreState` resets positions, speeds and contacts, but neither motors nor
    values set by `changeDynamics`. Therefore `start` applies the material again, and a rollout commands every motor.

    Attributes:
        bullet: Bullet, in a server of its own, so that scenes do not interfere; `client` is its id.
        robot: Bullet's id of the robot.
        materials: material of each link that can touch the ground, by Bullet's index.
        advance: function that steps Bullet once.
        inner_steps: number of Bullet's steps in a time step of the world.
    """

    def __init__(self, bullet: ModuleType, world: World) -> None:
        self.bullet = Server(bullet)
        self.client, self.close = self.bullet.client, self.bullet.close
        self.world = world
        self._set_up_physics()
        self._robot = build_robot(self.bullet, world)
        self.robot = self._robot.robot
        self.materials: dict[int, Material] = {}
        self.inner_steps = 1
        self._bare_step = self.bullet.stepSimulation
        self._frame = self._from_center_of_mass()
        self._set_joints()
        self._initial: int = self.bullet.saveState()

    def start(self, world: World, begun: Placed | None = None) -> None:
        """Reset to time 0 of a world, with the static friction of all contacts.

        `restoreState` keeps contact points of the last rollout, with their impulses, where a foot ended near its start.
        Far from the ground they are dropped.
        """
        bullet, turn = self.bullet, self.world.start_turn
        bullet.resetBasePositionAndOrientation(self.robot, FAR_AWAY, turn)
        bullet.performCollisionDetection()
        bullet.restoreState(self._initial)
        self._become(world)
        if begun is not None:
            self._place(begun)
        self._torques.reset()
        named = dict(world.surfaces)
        for link, body in self._robot.colliding.items():
            material = self.materials[link] = named.get(body.surface, world.material)
            bullet.changeDynamics(self.robot, link, restitution=material.restitution)
            self.set_friction(link, max(material.static_friction, material.dynamic_friction))

    def set_friction(self, link: int, friction: float) -> None:
        """Set the coefficient of friction of a link from the next step on."""
        self.bullet.changeDynamics(self.robot, link, lateralFriction=friction)

    def command(self, actuator: int, target: float) -> None:
        """Set a new target for a motor, in its unit."""
        joint, motor = self._motors[actuator]
        if not isinstance(motor, Motor):
            self._torques.command(joint, target)
            return
        self.bullet.setJointMotorControl2(
            self.robot,
            self._robot.joints[joint],
            self.bullet.POSITION_CONTROL,
            targetPosition=target,
            force=motor.max_torque_nm,
            positionGain=_shared(motor.position_gain, self.inner_steps),
            velocityGain=1.0,
            maxVelocity=motor.max_speed_rad_s,
        )

    def step(self, count: int) -> None:
        """Advance by a number of time steps."""
        advance = self.advance
        for _ in range(count * self.inner_steps):
            advance()

    def pose(self) -> FloatArray:
        """Return `(7,)`: position and quaternion of the base's frame."""
        position, turn = self.bullet.getBasePositionAndOrientation(self.robot)
        origin, turn = self.bullet.multiplyTransforms(position, turn, *self._frame)
        return np.array([*origin, *turn])

    def angles(self) -> FloatArray:
        """Return the joint angles `(joints,)`, rad or m."""
        return self._states(ANGLE)

    def speeds(self) -> FloatArray:
        """Return the joint speeds `(joints,)`, rad/s or m/s."""
        return self._states(SPEED)

    def spin(self) -> FloatArray:
        """Return the angular velocity of the base, `(3,)`, rad/s, along the axes of the world."""
        return np.array(self.bullet.getBaseVelocity(self.robot)[1])

    def encoders(self) -> FloatArray:
        """Return `(7 + 3 · joints,)`: pose, angles, speeds, and torques of the motors in the last step, N·m, or N."""
        told = np.concatenate([self.pose(), self._states(ANGLE, SPEED, MOTOR_TORQUE)])
        for number in self._unpowered:
            told[number - len(self._robot.joints)] = self._torques.motor_nm(number)
        return told

    def _place(self, begun: Placed) -> None:
        """Move and turn the base, and the joints."""
        bullet, frame = self.bullet, inertial_frame(self.world.bodies[0])
        if not self.world.fixed:
            place = bullet.multiplyTransforms(begun.pose[:3].tolist(), begun.pose[3:].tolist(), *frame)
            bullet.resetBasePositionAndOrientation(self.robot, *place)
            bullet.resetBaseVelocity(self.robot, *(each.tolist() for each in begun.of_centre(frame[0])))
        for link, angle, speed in zip(self._robot.joints, begun.angles_rad, begun.speeds_rad_s, strict=True):
            bullet.resetJointState(self.robot, link, angle, speed)

    def _states(self, *places: int) -> FloatArray:
        """Return some of Bullet's numbers about all joints, one after the other, `(numbers · joints,)`."""
        joints = self._robot.joints
        states = self.bullet.getJointStates(self.robot, joints) if joints else ()
        return np.array([state[place] for place in places for state in states], dtype=float)

    def _set_up_physics(self) -> None:
        bullet = self.bullet
        bullet.setPhysicsEngineParameter(
            fixedTimeStep=self.world.time_step_s,
            numSolverIterations=self.world.solver_iterations,
            numSubSteps=0,
            deterministicOverlappingPairs=1,
        )
        bullet.setGravity(*gravity_m_s2(self.world))
        plane = bullet.createCollisionShape(bullet.GEOM_PLANE)
        self.ground: int = bullet.createMultiBody(0, plane)
        # Bullet multiplies the coefficients of two bodies in contact: with 1 here, the robot's apply.
        bullet.changeDynamics(self.ground, BASE, lateralFriction=1.0, restitution=1.0)

    def _become(self, world: World) -> None:
        """Set what differs in a world from that of the last start."""
        before, self.world = self.world, world
        if world.bodies != before.bodies:
            set_masses(self.bullet, self._robot, world)
        if world.joints != before.joints or world.bodies != before.bodies:
            self._set_joints()
        if (pull := gravity_m_s2(world).tolist()) != gravity_m_s2(before).tolist():
            self.bullet.setGravity(*pull)
        if world.ground_m or before.ground_m:
            self.bullet.resetBasePositionAndOrientation(self.ground, (0.0, 0.0, world.ground_m), UNTURNED)

    def _set_joints(self) -> None:
        """Set dry friction, and choose how to step: with torques that Bullet has no motor for, or without."""
        numbers = {joint.name: number for number, joint in enumerate(self.world.joints)}
        self._motors = tuple((numbers[joint.name], joint.motor) for joint in self.world.actuators)
        self._torques = Torques(self.world)
        self._set_inner_steps(self._torques.inner_steps)
        # Bullet's motor is the dry friction there
        self._unpowered = [n for n, joint in enumerate(self.world.joints) if not isinstance(joint.motor, Motor)]
        for number in self._unpowered:
            link, joint, kind = self._robot.joints[number], self.world.joints[number], self.bullet.VELOCITY_CONTROL
            friction = 0.0 if joint.static_friction else joint.dry_friction
            self.bullet.setJointMotorControl2(self.robot, link, kind, targetVelocity=0.0, force=friction)
        self._driven = [self._robot.joints[number] for number in self._torques.joints]
        self.advance = self._driven_step if self._driven else self._bare_step

    def _set_inner_steps(self, count: int) -> None:
        """Set the number of Bullet's steps, each of `advance`, in a time step of the world.

        Bullet turns the force of a motor into an impulse when it is set, so this comes before.
        """
        if count != self.inner_steps:
            step_s = self.world.time_step_s / count
            self.bullet.setPhysicsEngineParameter(fixedTimeStep=step_s)
            self.inner_steps = count

    def _driven_step(self) -> None:
        bullet, robot, links = self.bullet, self.robot, self._driven
        states = bullet.getJointStates(robot, links)
        forces = self._torques.of(states)
        bullet.setJointMotorControlArray(robot, links, bullet.TORQUE_CONTROL, forces=forces)
        self._bare_step()

    def _from_center_of_mass(self) -> tuple[Vector, Quaternion]:
        """Return the base's frame in its inertial frame, which is what Bullet tells the pose of."""
        center, turn = inertial_frame(self.world.bodies[0])
        if turn == UNTURNED:
            return (-center[0], -center[1], -center[2]), UNTURNED
        return self.bullet.invertTransform(center, turn)  # type: ignore[no-any-return]


def _shared(gain: float, steps: int) -> float:
    """Return the share of an error to close in each of some steps, so that a share `gain` of it is closed in all."""
    return gain if steps == 1 else 1.0 - max(0.0, 1.0 - gain) ** (1.0 / steps)


SLIDES = 0.999
"""Share of the largest static friction above which a sticking link slides."""

STICKS_AGAIN = 0.9
"""Share of the largest dynamic friction below which a sliding link sticks again."""

LINK, NORMAL_FORCE, FRICTION_1, FRICTION_2 = 3, 9, 10, 12
"""Indices into a contact point from `getContactPoints`."""

UNLOADED = (0.0, 0.0)


class _Limits(NamedTuple):
    """A link's coefficients, and the shares of its load at which it slides and sticks again."""

    static: float
    dynamic: float
    slides_from: float
    sticks_below: float

    @classmethod
    def of(cls, material: Material) -> "_Limits":
        """Return the limits in a material."""
        dynamic = material.dynamic_friction
        static = max(material.static_friction, dynamic)
        return cls(static, dynamic, SLIDES * static, STICKS_AGAIN * dynamic)


class StickSlip:
    """Steps a scene, and sets the coefficient of each link after each step: static or dynamic.

    A link in contact first sticks. It slides when its friction reaches the static limit. It sticks again when its
    friction is clearly below the dynamic limit, which shows that less was enough to hold it, or when it bears no load.
    For a link with several contact points, their sums count.
    """

    def __init__(self, scene: PyBulletScene) -> None:
        self._scene = scene
        self._limits = {link: _Limits.of(material) for link, material in scene.materials.items()}
        self._sliding: set[int] = set()

    def step(self, count: int) -> None:
        """Advance by a number of time steps."""
        bullet, robot = self._scene.bullet, self._scene.robot
        advance, contacts = self._scene.advance, bullet.getContactPoints
        for _ in range(count * self._scene.inner_steps):
            advance()
            self._switch(contacts(robot))

    def _switch(self, points: tuple[tuple[Any, ...], ...]) -> None:
        bearing: dict[int, tuple[float, float]] = {}
        for point in points:
            if (normal := point[NORMAL_FORCE]) > 0.0:
                load, friction = bearing.get(point[LINK], UNLOADED)
                bearing[point[LINK]] = load + normal, friction + hypot(point[FRICTION_1], point[FRICTION_2])
        for link, (load, friction) in bearing.items():
            if link in self._sliding:
                if friction < self._limits[link].sticks_below * load:
                    self._stick(link)
            elif friction >= self._limits[link].slides_from * load:
                self._slide(link)
        for link in self._sliding.difference(bearing):
            self._stick(link)

    def _stick(self, link: int) -> None:
        self._sliding.remove(link)
        self._scene.set_friction(link, self._limits[link].static)

    def _slide(self, link: int) -> None:
        self._sliding.add(link)
        self._scene.set_friction(link, self._limits[link].dynamic)


class PyBullet(SteppedEngine[PyBulletScene]):
    """Bullet's rigid bodies; stick-slip switching at each contact distinguishes static and dynamic friction.

    Deterministic within one version and architecture. Restitution acts on impacts faster than 0.2 m/s, Bullet's
    threshold. If dynamic friction is not below static friction, there is no switching and no cost of it. Bullet has no
    armature.
    """

    name = "pybullet"
    source = "https://pybullet.org, version 3.2.7"
    library = "pybullet"
    honours = SteppedEngine.honours - {"joint.armature"}
    in_place = USUALLY_IN_PLACE | {"gravity_m_s2", "gravity_tilt_rad", "slope_rad"}
    install = "pip install pybullet, which has wheels up to Python 3.11, or choose another engine, like mujoco"

    def __init__(self, options: Frozen | None = None) -> None:
        super().__init__(options)
        self._bullet = import_module("pybullet")
        self.failures = (self._bullet.error,)

    @classmethod
    def exceeded(cls, world: World) -> str | None:
        """Return how many links the world needs, if Bullet has fewer: one for each body and each further shape."""
        needed = len(links_of(world)) - 1 if world.bodies else 0
        if needed <= MOST_LINKS:
            return None
        return f"its bodies and shapes need {needed} links besides the base, and Bullet has {MOST_LINKS}"

    def _build(self, world: World) -> PyBulletScene:
        return PyBulletScene(self._bullet, world)

    def _start(self, scene: PyBulletScene, world: World, begun: Placed | None) -> Callable[[int], None]:
        scene.start(world, begun)
        switches = any(each.dynamic_friction < each.static_friction for each in scene.materials.values())
        return StickSlip(scene).step if switches else scene.step
