"""Inertia of solids and of joints, against sums over points, and against Bullet's own matrix."""

from dataclasses import replace

import numpy as np
import pytest

from gaplab.services.world.inertias import inertia_of, inverse_inertias
from gaplab.services.world.kinematics import about, rotated
from gaplab.services.world.robots.quadruped import Quadruped
from gaplab.services.world.world import (
    Body,
    Box,
    Capsule,
    Cylinder,
    Hull,
    Inertia,
    Joint,
    PDMotor,
    Sphere,
    World,
    pd_law,
    pd_torque,
)

TURN = about(np.array([0.6, 0.0, 0.8]), np.array([0.7]))[0]


def tensor(inertia: Inertia) -> np.ndarray:
    axes = rotated(np.array(inertia.turn), np.eye(3)).T
    return axes @ np.diag(inertia.moments_kg_m2) @ axes.T


@pytest.mark.parametrize("shape", [Sphere(0.1), Capsule(0.1, 0.3), Cylinder(0.1, 0.3), Box((0.2, 0.3, 0.4))])
def test_inertia_is_the_sum_over_the_solid(shape: Sphere | Capsule | Cylinder | Box) -> None:
    points = np.random.default_rng(1).uniform(-0.25, 0.25, (1_000_000, 3))
    across, along = np.hypot(points[:, 0], points[:, 1]), np.abs(points[:, 2])
    match shape:
        case Sphere():
            inside = np.linalg.norm(points, axis=1) < 0.1
        case Capsule():
            inside = np.hypot(across, np.maximum(along - 0.15, 0)) < 0.1
        case Cylinder():
            inside = (across < 0.1) & (along < 0.15)
        case Box():
            inside = (np.abs(points) < [0.1, 0.15, 0.2]).all(axis=1)
    squares = np.square(points[inside]).mean(axis=0)

    assert inertia_of(Body("b", 2.0, shape)).moments_kg_m2 == pytest.approx(2 * (squares.sum() - squares), rel=0.01)


def test_the_inertia_of_a_hull_is_that_of_the_box_that_it_is() -> None:
    corners = np.array([(x, y, z) for x in (-0.1, 0.1) for y in (-0.2, 0.2) for z in (-0.3, 0.3)])
    box, turned = inertia_of(Body("b", 2.0, Box((0.2, 0.4, 0.6)))), rotated(TURN, corners) + np.array([1.0, 2.0, 3.0])

    hull = inertia_of(Body("h", 2.0, Hull(tuple(map(tuple, turned.tolist())))))

    assert tensor(hull) == pytest.approx(tensor(replace(box, turn=tuple(TURN.tolist()))))
    assert np.linalg.norm(hull.turn) == pytest.approx(1)
    heavier = inertia_of(Body("h", 3.7, Hull(tuple(map(tuple, turned.tolist())))))
    assert heavier.turn == hull.turn


def test_a_given_inertia_is_kept() -> None:
    given = Inertia((1.0, 2.0, 2.5))

    assert inertia_of(Body("b", 2.0, Sphere(0.1), inertia=given)) is given


def test_a_wheel_on_a_fixed_axle_turns_by_its_inertia_and_its_armature() -> None:
    wheel = Body("wheel", 2.0, Cylinder(0.1, 0.3), (0.0, 0.0, 0.0))
    axle = Joint("axle", "base", "wheel", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), armature=0.02)
    world = World((Body("base", 1.0, Sphere(0.1)), wheel), (axle,), fixed=True)

    assert inverse_inertias(world) == pytest.approx([1 / (0.01 + 0.02)])
    slide = replace(world, joints=(replace(axle, slides=True, armature=0.5),))
    assert inverse_inertias(slide) == pytest.approx([1 / 2.5])
    free = replace(world, fixed=False, joints=(replace(axle, slides=True, armature=0.0),))
    assert inverse_inertias(free) == pytest.approx([1 / 2.0 + 1 / 1.0])


def test_bullet_has_the_same_inverse_inertia() -> None:
    pytest.importorskip("pybullet")
    from gaplab.services.engines.pybullet import PyBullet

    starts = np.linspace(-0.5, 0.6, 12).tolist()
    world = Quadruped().world
    joints = [replace(joint, start=start) for joint, start in zip(world.joints, starts, strict=True)]
    world, engine = replace(world, joints=tuple(joints)), PyBullet()
    scene = engine._scenes[world]

    matrix = np.array(scene.bullet.calculateMassMatrix(scene.robot, starts, physicsClientId=scene.client))

    assert inverse_inertias(world) == pytest.approx(np.diag(np.linalg.inv(matrix))[6:], rel=1e-6)
    engine.close()


STEP_S, INVERSE = 0.01, 40.0
MOTORS = [
    PDMotor("position", 1e6, kp=300.0, kd=5.0),
    PDMotor("position", 1e6, kp=300.0),
    PDMotor("velocity", 1e6, kd=7.0),
    PDMotor("torque", 1e6),
]


@pytest.mark.parametrize("motor", MOTORS)
def test_the_torque_of_a_motor_is_that_of_the_end_of_the_step(motor: PDMotor) -> None:
    target, angle, coasting = 0.7, 0.2, -1.3

    torque = pd_torque(target, angle, coasting, pd_law(motor, INVERSE, STEP_S))

    speed = coasting + STEP_S * INVERSE * torque
    ends_at = angle + STEP_S * speed
    expected = {
        "position": motor.kp * (target - ends_at) - motor.kd * speed,
        "velocity": motor.kd * (target - speed),
        "torque": target,
    }
    assert torque == pytest.approx(expected[motor.follows])


def test_a_torque_is_limited_and_what_is_no_number_stays_none() -> None:
    law = pd_law(PDMotor("position", 2.0, kp=300.0), INVERSE, STEP_S)

    assert pd_torque(5.0, 0.0, 0.0, law) == 2.0
    assert pd_torque(-5.0, 0.0, 0.0, law) == -2.0
    assert np.isnan(pd_torque(float("nan"), 0.0, 0.0, law))
