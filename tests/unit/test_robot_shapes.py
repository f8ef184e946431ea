"""What draws a robot: faces that close and point outwards, feet, struts, and how far away the camera is."""

from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from gaplab.services.replay.shapes import (
    MOST_FEET,
    extent_of,
    feet_of,
    framing_of,
    hull_faces,
    labels,
    observed_of,
    shapes_of,
)
from gaplab.services.world.kinematics import about
from gaplab.services.world.robots.quadruped import Quadruped
from gaplab.services.world.world import Body, Box, Capsule, Cylinder, Hull, Inertia, Joint, Part, Sphere, World

EVEN = Inertia((0.01, 0.01, 0.01))
UPRIGHT = (0.0, 0.0, 0.0, 1.0)
CUBE = tuple((x, y, z) for x in (-0.5, 0.0, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5))
CORNERS = tuple((x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5))
CLOUD = tuple((float(x), float(y), float(z)) for x, y, z in np.random.default_rng(3).normal(size=(64, 3)))


def volume(corners: Any, faces: Any) -> float:
    """The volume by the divergence theorem; fails unless each edge is passed once in each direction."""
    edges = [edge for face in faces for edge in zip(face, (*face[1:], face[0]), strict=True)]
    assert len(edges) == len(set(edges))
    assert {(second, first) for first, second in edges} == set(edges)
    places, sixfold = np.array(corners), 0.0
    for face in faces:
        for second, third in pairwise(face[1:]):
            sixfold += float(places[face[0]] @ np.cross(places[second], places[third]))
    return sixfold / 6


@pytest.mark.parametrize("points", [CUBE, CLOUD, CLOUD[:4]])
def test_faces_of_a_hull_are_closed_and_point_outwards(points: Any) -> None:
    corners, faces = hull_faces(points)

    assert volume(corners, faces) == pytest.approx(ConvexHull(np.array(points)).volume)
    for face in faces:
        a, b, c = (np.array(corners[place]) for place in face)
        assert ((np.array(corners) - a) @ np.cross(b - a, c - a)).max() < 1e-12  # no corner is outside a face


def test_a_hull_has_no_points_inside_and_the_order_of_its_faces_is_fixed() -> None:
    corners, faces = hull_faces(((0.0, 0.0, 0.0), *CUBE))

    assert len(corners) == 8
    assert len(faces) == 12
    assert hull_faces.__wrapped__(((0.0, 0.0, 0.0), *CUBE)) == (corners, faces)
    assert list(faces) == sorted(faces)


def test_points_in_a_plane_have_the_faces_of_a_flat_box() -> None:
    corners, faces = hull_faces(((0.0, 0.0, 1.0), (2.0, 0.0, 1.0), (0.0, 3.0, 1.0)))

    assert np.ptp(np.array(corners), axis=0) == pytest.approx([2, 3, 0])
    assert len(faces) == 6
    assert volume(CORNERS, faces) == pytest.approx(1)  # outwards


def chain(count: int, forks: int = 1) -> World:
    """A base with chains of bodies that all touch the ground."""
    base = Body("base", 1.0, Box((0.2, 0.2, 0.1)))
    bodies, joints = [base], []
    for fork in range(forks):
        for place in range(count):
            name, parent = f"l{fork}_{place}", "base" if place == 0 else f"l{fork}_{place - 1}"
            bodies.append(Body(name, 0.1, (Part(Capsule(0.02, 0.1), (0.0, 0.0, -0.05)),), inertia=EVEN))
            joints.append(Joint(f"j{fork}_{place}", parent, name, (0.0, 0.0, -0.1), (0.0, 1.0, 0.0)))
    return World(tuple(bodies), tuple(joints), start_height_m=1.0)


def test_feet_are_the_outer_bodies_that_touch() -> None:
    assert feet_of(chain(3, forks=4)) == (3, 6, 9, 12)
    assert labels(chain(3, forks=2)) == ("l0", "l1")
    assert len(feet_of(Quadruped().world)) == 4


def test_all_links_of_a_snake_are_feet_but_not_too_many() -> None:
    assert feet_of(chain(5)) == (1, 2, 3, 4, 5)
    assert feet_of(replace(chain(5), fixed=True)) == (5,)  # an arm has a hand
    long = feet_of(chain(30))
    assert len(long) == MOST_FEET
    assert (long[0], long[-1]) == (1, 30)


def test_each_part_is_drawn_at_its_place_and_only_what_touches_is_a_foot() -> None:
    leg = Body(
        "leg",
        1.0,
        (
            Part(Cylinder(0.01, 0.2), (0.0, 0.0, -0.1), collides=False),
            Part(Hull(CUBE), (0.0, 0.0, -0.2), (0.0, 0.0, 1.0, 0.0)),
        ),
        inertia=EVEN,
    )
    world = World((Body("trunk", 1.0, Sphere(0.1)), leg), (Joint("hip", "trunk", "leg", (0, 0, 0), (0, 1, 0)),))

    ground, trunk, bone, foot = shapes_of(world)

    assert [each.kind for each in (ground, trunk, bone, foot)] == ["plane", "sphere", "cylinder", "hull"]
    assert [each.role for each in (ground, trunk, bone, foot)] == ["ground", "trunk", "limb", "foot"]
    assert (bone.size_m, bone.position_m) == ((0.01, 0.2), (0.0, 0.0, -0.1))
    assert (foot.orientation, len(foot.vertices_m), len(foot.faces)) == ((0.0, 0.0, 1.0, 0.0), 8, 12)


def test_a_body_whose_parts_are_all_far_from_its_joint_gets_one_strut_to_the_nearest() -> None:
    parts = (Part(Sphere(0.02), (0.0, 0.0, -0.3)), Part(Capsule(0.02, 0.04), (0.0, 0.2, 0.0)))
    world = World((Body("trunk", 1.0, Sphere(0.1)), Body("hand", 1.0, parts, inertia=EVEN)))

    struts = [each for each in shapes_of(world) if each.role == "limb" and each.kind == "capsule"]

    assert [each.position_m for each in struts] == [(0.0, 0.1, 0.0)]
    assert struts[0].size_m == pytest.approx((0.008, 0.2))


def test_the_observed_body_is_marked_in_place_of_the_base() -> None:
    world = replace(chain(2), observed="l0_1")
    free = replace(world, bodies=(world.bodies[0], *(replace(each, shape=_light(each)) for each in world.bodies[1:])))

    assert observed_of(world) == 2
    assert {shape.body for shape in shapes_of(free) if shape.role == "trunk"} == {2}


def _light(body: Body) -> tuple[Part, ...]:
    return tuple(replace(part, collides=False) for part in body.parts)


def extent(shape: Any, turn: Any = UPRIGHT) -> tuple[Any, Any]:
    body = Body("one", 1.0, (Part(shape, (0.1, 0.0, 0.0)),), inertia=EVEN)
    return extent_of(shapes_of(World((body,))), np.array([[0.0, 0.0, 1.0]]), np.array([turn]))


def test_the_extent_is_that_of_turned_shapes() -> None:
    quarter = about(np.array([0.0, 1.0, 0.0]), np.array([np.pi / 2]))[0]

    low, high = extent(Cylinder(0.1, 0.6), quarter)
    assert high - low == pytest.approx([0.6, 0.2, 0.2])
    assert (low + high) / 2 == pytest.approx([0, 0, 0.9])
    low, high = extent(Capsule(0.1, 0.6))
    assert high - low == pytest.approx([0.2, 0.2, 0.8])
    low, high = extent(Hull(CUBE))
    assert high - low == pytest.approx([1, 1, 1])


@pytest.mark.parametrize(("size", "scale"), [(0.6, 1.0), (0.1, 0.125), (3.0, 4.0)])
def test_the_camera_is_as_far_away_as_a_robot_is_large(size: float, scale: float) -> None:
    edge = size / np.sqrt(3)

    framing = framing_of(np.zeros(3), np.full(3, edge))

    assert framing.scale == scale
    assert framing.height_m >= edge / 2 - 1e-4


def test_the_quadruped_is_seen_as_ever() -> None:
    world = Quadruped().world
    shapes = shapes_of(world)
    positions = np.array([[0.0, 0.0, 0.175]] + [[0.15, 0.2, 0.175]] * 12)

    framing = framing_of(*extent_of(shapes, positions, np.tile(UPRIGHT, (13, 1))))

    assert (framing.scale, framing.height_m) == (1.0, 0.12)
