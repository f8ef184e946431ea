"""What a controller observes, and the heights of bodies: against arrangements whose answer is plain."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from gaplab.services.world.kinematics import Clearances, about, body_poses, clearances_m, observed_poses, product
from gaplab.services.world.sensing import GROUPS, Bearing, feet, gravity_m_s2, names, noises, observations
from gaplab.services.world.world import (
    Body,
    Box,
    Capsule,
    Cylinder,
    Hull,
    Inertia,
    Joint,
    Motor,
    Noise,
    Part,
    PDMotor,
    Shape,
    Sphere,
    World,
)

RNG = np.random.default_rng(1)
AXIS = (0.6, 0.0, 0.8)
TURN = tuple(about(np.array(AXIS), np.array([0.7]))[0].tolist())
HULL = Hull(tuple(map(tuple, RNG.normal(size=(12, 3)).tolist())))
SHAPES: list[Shape] = [Box((0.1, 0.2, 0.3)), Sphere(0.2), Capsule(0.1, 0.4), Cylinder(0.2, 0.3), HULL]
PARTS = tuple(Part(shape, (0.1 * i, -0.2, 0.3), TURN) for i, shape in enumerate(SHAPES))
POINTS = 400


def body(name: str, *parts: Part) -> Body:
    return Body(name, 1.0, parts, inertia=Inertia((1.0, 1.0, 1.0)))


TREE = World(
    bodies=(
        body("base", Part(Box((1.0, 1.0, 1.0)))),
        body("far", *PARTS[:2]),
        body("near", *PARTS[2:], replace(PARTS[0], collides=False, center_m=(0.0, 0.0, -9.0))),
        Body("bare", 1.0, Sphere(0.1), collides=False),
        body("farther", PARTS[4]),
    ),
    joints=(
        Joint("d", "far", "farther", (0.3, 0.0, 0.1), AXIS, Motor(0.1, 1.0), turn=TURN),
        Joint("b", "near", "far", (1.0, 0.0, 0.0), AXIS, PDMotor("torque", 1.0), slides=True),
        Joint("a", "base", "near", (0.5, 0.2, 0.0), (0.0, 1.0, 0.0), turn=TURN),
        Joint("c", "base", "bare", (0.0, 0.2, 0.0), (0.0, 0.0, 1.0), Motor(0.1, 1.0)),
    ),
)


def bearing(count: int = 50) -> Bearing:
    rng = np.random.default_rng(5)
    turns = rng.normal(size=(count, 4))
    poses = np.hstack([rng.normal(size=(count, 3)), turns / np.linalg.norm(turns, axis=1)[:, None]])
    angles, speeds = rng.normal(size=(2, count, 4))
    return Bearing(poses, rng.normal(size=(count, 3)), angles, speeds)


def surface(shape: Shape) -> Any:
    """Points of a shape, among them nearly the lowest one in any direction."""
    around = RNG.normal(size=(POINTS**2 // 4, 3))
    ball = around / np.linalg.norm(around, axis=1)[:, None]
    match shape:
        case Box(size_m=edges):
            return np.sign(ball) * np.array(edges) / 2
        case Sphere(radius_m=radius):
            return radius * ball
        case Capsule(radius_m=radius, length_m=length):
            return radius * ball + np.sign(ball[:, 2:]) * [0, 0, length / 2]
        case Cylinder(radius_m=radius, length_m=length):
            flat = ball[:, :2] / np.linalg.norm(ball[:, :2], axis=1)[:, None]
            return np.hstack([radius * flat, np.sign(ball[:, 2:]) * length / 2])
        case Hull(points_m=points):
            return np.array(points)


@pytest.mark.parametrize("part", PARTS, ids=lambda part: type(part.shape).__name__)
def test_clearance_is_the_height_of_the_lowest_point_of_a_shape(part: Part) -> None:
    now = bearing(10)

    found = clearances_m(body("b", part), now.poses[:, :3], now.poses[:, 3:])

    points = surface(part.shape)
    for pose, height in zip(now.poses, found, strict=True):
        placed = place(pose[3:], place(np.array(part.turn), points) + part.center_m) + pose[:3]
        assert height == pytest.approx(placed[:, 2].min(), abs=2e-4)


def place(turn: Any, points: Any) -> Any:
    """Points turned by a matrix, which is not how kinematics does it."""
    x, y, z, w = turn
    columns = [
        [1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)],
        [2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)],
        [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)],
    ]
    return points @ np.array(columns)


def test_only_what_collides_counts_if_anything_does() -> None:
    near, bare = TREE.bodies[2], TREE.bodies[3]
    level = np.array([[0.0, 0.0, 5.0]]), np.array([[0.0, 0.0, 0.0, 1.0]])

    assert clearances_m(near, *level)[0] > 3
    assert clearances_m(bare, *level) == pytest.approx([4.9])


def test_joints_slide_and_turn_their_children() -> None:
    slid = np.array([[0.0, 0.3, 0.4, 0.0]])
    base = np.array([[1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 1.0]])

    positions, orientations = body_poses(TREE, base, slid)

    near = product(np.array(TURN), about(np.array([0.0, 1.0, 0.0]), np.array([0.4]))[0])
    assert orientations[0, 2] == pytest.approx(near)
    assert orientations[0, 1] == pytest.approx(near)
    assert positions[0, 2] == pytest.approx([1.5, 2.2, 3.0])
    assert positions[0, 1] == pytest.approx(
        np.array([1.5, 2.2, 3.0]) + place(near, np.array([1.0, 0.0, 0.0]) + 0.3 * np.array(AXIS))
    )


@pytest.mark.parametrize("name", ["far", "farther", "base", ""])
def test_observed_poses_are_those_of_the_observed_body(name: str) -> None:
    now = bearing()
    at = [each.name for each in TREE.bodies].index(name or "base")

    found = observed_poses(replace(TREE, observed=name), now.poses, now.angles_rad)

    positions, orientations = body_poses(TREE, now.poses, now.angles_rad)
    assert np.array_equal(found, np.hstack([positions[:, at], orientations[:, at]]))


def test_observations_are_named_in_their_order() -> None:
    assert names(TREE, GROUPS) == (
        *("angle d", "angle b", "angle c", "speed d", "speed b", "speed c"),
        *("tilt x", "tilt y", "tilt z", "turning x", "turning y", "turning z"),
        *("contact far", "contact near", "contact farther"),
    )
    assert names(TREE, ("turning", "contacts"))[0] == "turning x"
    assert [each.name for each in feet(TREE)] == ["far", "near", "farther"]


def test_observations_are_what_the_engine_knows() -> None:
    now = bearing()

    found = observations(TREE, GROUPS, now)

    heights = Clearances(TREE, feet(TREE))(now.poses, now.angles_rad)
    assert found.shape == (50, 15)
    assert np.array_equal(found[:, :3], now.angles_rad[:, [0, 1, 3]])
    assert np.array_equal(found[:, 3:6], now.speeds_rad_s[:, [0, 1, 3]])
    assert found[:, 8] == pytest.approx([place(turn, np.array([0, 0, 1.0]))[2] * -1 for turn in now.poses[:, 3:]])
    assert np.array_equal(found[:, 9:12], now.turning_rad_s)
    assert np.array_equal(found[:, 12:], heights < 0.002)
    assert 0 < found[:, 12:].mean() < 1
    assert observations(TREE, (), now).shape == (50, 0)


def test_a_row_depends_on_its_own_row_alone() -> None:
    now = bearing()
    alone = [
        observations(TREE, GROUPS, Bearing(*(values[i : i + 1] for values in vars(now).values()))) for i in range(50)
    ]
    heights = Clearances(TREE, feet(TREE))
    each = [heights(now.poses[i : i + 1], now.angles_rad[i : i + 1]) for i in range(50)]

    assert np.array_equal(np.vstack(alone), observations(TREE, GROUPS, now))
    assert np.array_equal(np.vstack(each), heights(now.poses, now.angles_rad))


def test_a_slope_turns_gravity_and_tilt() -> None:
    world = replace(TREE, slope_rad=0.3, gravity_m_s2=2.0)
    upright = Bearing(np.array([[0, 0, 0, 0, 0, 0, 1.0]]), np.zeros((1, 3)), np.zeros((1, 4)), np.zeros((1, 4)))

    tilt = observations(world, ("tilt",), upright)[0]

    assert gravity_m_s2(world) == pytest.approx([-2 * np.sin(0.3), 0, -2 * np.cos(0.3)])
    assert tilt == pytest.approx(gravity_m_s2(world) / 2)
    assert np.array_equal(gravity_m_s2(TREE), [0.0, 0.0, -9.81])


def test_each_observation_has_the_noise_of_its_group() -> None:
    noise = Noise(angle_rad=0.1, speed_rad_s=0.2, tilt=0.3, turning_rad_s=0.4)

    assert noises(TREE, GROUPS, noise).tolist() == [0.1] * 3 + [0.2] * 3 + [0.3] * 3 + [0.4] * 3 + [0.0] * 3
    assert noises(TREE, ("tilt", "angles"), noise).tolist() == [0.3] * 3 + [0.1] * 3
