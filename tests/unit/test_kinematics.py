"""Forward kinematics, against arrangements whose answer is plain, and against Bullet's own."""

import numpy as np
import pytest

from gaplab.services.replay.shapes import labels, shapes_of
from gaplab.services.world.kinematics import about, body_poses, clearances_m, product, rotated
from gaplab.services.world.robots.quadruped import Quadruped
from gaplab.services.world.world import Body, Box, Joint, Motor, Sphere, World

QUARTER = np.pi / 2
MOTOR = Motor(0.1, 1.0)
ARM = World(
    bodies=(Body("base", 1.0, Box((1, 1, 1))), Body("far", 1.0, Sphere(0.1)), Body("near", 1.0, Sphere(0.1))),
    joints=(
        Joint("second", "near", "far", (1.0, 0.0, 0.0), (0.0, 0.0, 1.0), MOTOR),
        Joint("first", "base", "near", (0.5, 0.0, 0.0), (0.0, 0.0, 1.0), MOTOR),
    ),
)
LEVEL = np.array([[0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 1.0]])


def test_bodies_are_where_their_joints_carry_them_in_whatever_order_they_are_listed() -> None:
    positions, orientations = body_poses(ARM, LEVEL, np.array([[QUARTER, QUARTER]]))

    assert positions[0, 2] == pytest.approx([0.5, 0, 2])
    assert positions[0, 1] == pytest.approx([0.5, 1, 2])
    assert rotated(orientations[0, 1], np.array([1.0, 0, 0])) == pytest.approx([-1, 0, 0])


def test_the_base_carries_all() -> None:
    turned = np.array([[1.0, 2.0, 3.0, *about(np.array([0.0, 1.0, 0.0]), np.array([QUARTER]))[0]]])

    positions, _ = body_poses(ARM, turned, np.zeros((1, 2)))

    assert positions[0, 1] == pytest.approx([1, 2, 1.5])


def test_turns_compose() -> None:
    x, z = (about(np.array(axis), np.array([QUARTER])) for axis in ([1.0, 0, 0], [0, 0, 1.0]))

    assert rotated(product(z, x), np.array([0.0, 1.0, 0.0])) == pytest.approx(np.array([[0, 0, 1]]), abs=1e-12)
    assert rotated(product(x, z), np.array([1.0, 0.0, 0.0])) == pytest.approx(np.array([[0, 0, 1]]), abs=1e-12)


def test_clearance_is_of_the_lowest_point() -> None:
    edge = Body("box", 1.0, Box((0.2, 0.2, 0.2)))
    tilted = about(np.array([1.0, 0.0, 0.0]), np.array([np.pi / 4]))
    ball = Body("ball", 1.0, Sphere(0.1), center_m=(0.0, 0.0, -0.5))

    assert clearances_m(edge, np.array([[0, 0, 1.0]]), tilted) == pytest.approx([1 - 0.1 * np.sqrt(2)])
    assert clearances_m(ball, np.array([[0, 0, 1.0]]), np.array([[0, 0, 0, 1.0]])) == pytest.approx([0.4])


def test_bullet_has_the_bodies_at_the_same_places() -> None:
    pytest.importorskip("pybullet")
    from gaplab.services.engines.pybullet import PyBullet

    robot, engine = Quadruped(), PyBullet()
    scene = engine._scenes[robot.world]
    angles = np.linspace(-0.7, 0.8, 12)
    for joint, angle in enumerate(angles):
        scene.bullet.resetJointState(scene.robot, joint, angle, physicsClientId=scene.client)
    scene.bullet.stepSimulation(physicsClientId=scene.client)

    positions, orientations = body_poses(robot.world, scene.pose()[None], scene.angles()[None])

    for link, joint in enumerate(robot.world.joints):  # type: ignore[assignment]
        state = scene.bullet.getLinkState(scene.robot, link, 0, 1, physicsClientId=scene.client)
        place = [body.name for body in robot.world.bodies].index(joint.child)  # type: ignore[attr-defined]
        assert positions[0, place] == pytest.approx(state[4], abs=1e-6)
        assert abs(orientations[0, place] @ state[5]) == pytest.approx(1, abs=1e-6)
    engine.close()


def test_a_quadruped_is_seen_with_shins_between_knees_and_feet() -> None:
    world = Quadruped().world
    shapes = shapes_of(world)

    assert [sum(each.kind == kind for each in shapes) for kind in ("plane", "box", "sphere", "capsule")] == [1, 9, 4, 4]
    assert [sum(each.role == role for each in shapes) for role in ("ground", "trunk", "limb", "foot")] == [1, 1, 12, 4]
    assert labels(world) == ("front left", "front right", "rear left", "rear right")
    shin = next(each for each in shapes if each.kind == "capsule")
    assert shin.size_m == pytest.approx((0.01, 0.15))
    assert shin.position_m == (0.0, 0.0, -0.075)


def test_what_reaches_to_the_side_lies_along_its_way() -> None:
    arm = World(bodies=(ARM.bodies[0], Body("hand", 1.0, Sphere(0.1), center_m=(0.3, 0.0, -0.4))))

    strut = shapes_of(arm)[2]

    along = rotated(np.array(strut.orientation), np.array([0.0, 0.0, 1.0]))
    assert strut.kind == "capsule"
    assert strut.size_m[1] == pytest.approx(0.5)
    assert np.abs(along) == pytest.approx([0.6, 0, 0.8])
