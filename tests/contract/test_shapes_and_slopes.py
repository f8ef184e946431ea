"""Shapes on the ground, slopes and surfaces in every engine, against the textbook."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gaplab.services.core.arrays import FloatArray
from gaplab.services.engines.base import Engine
from gaplab.services.world.kinematics import about, clearances_m, inverse, product
from gaplab.services.world.motions import Motion
from gaplab.services.world.world import (
    UNTURNED,
    Body,
    Box,
    Capsule,
    Cylinder,
    Hull,
    Inertia,
    Material,
    Noise,
    Part,
    Shape,
    Sphere,
    World,
)
from tests.contract.textbook import STEP_S, G, X, Y, block, engine, held, honoured, positions, times

__all__ = ["engine"]

QUARTER = tuple(about(np.array(X), np.array([np.pi / 2]))[0].tolist())
CUBE = Hull(tuple((x, y, z) for x in (-0.1, 0.1) for y in (-0.1, 0.1) for z in (-0.1, 0.1)))
WEDGE = Hull(
    ((0.2, 0.2, -0.1), (0.2, -0.2, -0.1), (-0.2, 0.2, -0.1), (-0.2, -0.2, -0.1), (0.0, 0.1, 0.1), (0.0, -0.1, 0.1))
)
TABLE = (
    Part(Box((0.5, 0.5, 0.1)), (0.0, 0.0, 0.2), collides=False),
    *(Part(Cylinder(0.03, 0.2), (x, y, 0.1)) for x in (-0.2, 0.2) for y in (-0.2, 0.2)),
)
SLED = (
    Part(Capsule(0.05, 0.4), (0.0, 0.15, 0.05), tuple(about(np.array(Y), np.array([np.pi / 2]))[0].tolist())),
    Part(Hull(CUBE.points_m), (0.15, -0.15, 0.1)),
    Part(Sphere(0.04), (-0.2, -0.15, 0.04)),
)
RESTING: dict[str, tuple[Body, tuple[float, ...]]] = {
    "box": (Body("b", 1.0, Box((0.2, 0.3, 0.4))), UNTURNED),
    "turned box": (Body("b", 1.0, Box((0.2, 0.3, 0.4))), QUARTER),
    "sphere": (Body("b", 1.0, Sphere(0.1)), UNTURNED),
    "capsule lying": (Body("b", 1.0, Capsule(0.1, 0.3)), QUARTER),
    "cylinder upright": (Body("b", 1.0, Cylinder(0.15, 0.2)), UNTURNED),
    "cylinder lying": (Body("b", 1.0, Cylinder(0.1, 0.4)), QUARTER),
    "hull": (Body("b", 1.0, CUBE), UNTURNED),
    "wedge": (Body("b", 1.0, WEDGE), UNTURNED),
    "hull beside its frame": (Body("b", 1.0, CUBE, (0.1, 0.2, 0.3)), UNTURNED),
    "parts": (Body("b", 5.0, TABLE, (0.0, 0.0, 0.15), inertia=Inertia((0.1, 0.1, 0.15))), UNTURNED),
    "parts of many shapes": (
        Body("b", 2.0, SLED, (0.0, 0.0, 0.08), inertia=Inertia((0.02, 0.05, 0.04), QUARTER)),
        UNTURNED,
    ),
}


def at_rest(body: Body, turn: tuple[float, ...]) -> World:
    """A body that touches the ground with its lowest point."""
    depth = clearances_m(body, np.zeros((1, 3)), np.array([turn]))[0]
    return block(body, start_height_m=-depth, start_turn=turn)


@pytest.mark.parametrize("name", RESTING)
def test_a_body_rests_with_its_lowest_point_on_the_ground(engine: Engine, name: str) -> None:
    world = at_rest(*RESTING[name])
    honoured(engine, world)

    seen = engine.rollout(world, held(np.array([0.0, 1.0, 2.0])))

    assert seen.positions_m[0] == pytest.approx([0, 0, world.start_height_m], abs=1e-6)
    clear = clearances_m(world.bodies[0], seen.positions_m, seen.orientations)
    assert clear == pytest.approx(0.0, abs=1.5e-3)
    assert np.abs(seen.orientations @ np.array(world.start_turn)) == pytest.approx(1.0, abs=1e-4)
    assert np.ptp(seen.positions_m, axis=0) == pytest.approx(0.0, abs=2e-3)


@pytest.mark.parametrize("name", RESTING)
def test_a_dropped_body_never_sinks_into_the_ground(engine: Engine, name: str) -> None:
    body, _ = RESTING[name]
    tilted = tuple(about(np.array([0.6, 0.8, 0.0]), np.array([0.5]))[0].tolist())
    dropped = replace(at_rest(body, tilted), start_height_m=at_rest(body, tilted).start_height_m + 0.1)
    honoured(engine, dropped)

    seen = engine.rollout(dropped, held(np.arange(1, 40) * 0.05))

    clear = clearances_m(body, seen.positions_m, seen.orientations)
    assert clear[0] > 0.08
    assert clear.min() > -0.01
    assert clear[-1] < 0.05


GRIP = Material(1.0, 1.0)
ROLLING: dict[str, tuple[Shape, tuple[float, ...], float]] = {
    "sphere": (Sphere(0.1), UNTURNED, 2 / 5),
    "cylinder": (Cylinder(0.1, 0.4), QUARTER, 1 / 2),
    "capsule": (Capsule(0.1, 0.4), QUARTER, 0.475),
}


@pytest.mark.parametrize("name", ROLLING)
@pytest.mark.parametrize("slope", [0.1, -0.2])
def test_what_is_round_rolls_down_a_slope(engine: Engine, name: str, slope: float) -> None:
    shape, turn, share = ROLLING[name]
    world = replace(at_rest(Body("roller", 1.0, shape), turn), slope_rad=slope, material=GRIP)
    seen = np.array([0.5, 1.0])

    x = positions(engine, world, held(seen))[:, 0]

    expected = -0.5 * G * np.sin(slope) / (1 + share) * seen * (seen + STEP_S)
    prism = engine.name == "physx" and name == "cylinder"  # its edges hit the ground one by one
    assert x == pytest.approx(expected, rel=0.18 if prism else 0.08)  # lines of contact are a few points, which wander


def slid(engine: Engine, world: World) -> FloatArray:
    """Places along the slope after 0.5, 0.75 and 1 s, after a check that the world stays on the ground."""
    found = positions(engine, world, held(np.array([0.5, 0.75, 1.0])))
    assert found[:, 2] == pytest.approx(world.start_height_m, abs=6e-3)  # Bullet's boxes sink by 5 mm as they slide
    return found[:, 0]


BLOCK = Body("block", 2.0, Box((0.4, 0.4, 0.1)))


FEET = tuple(Part(Sphere(0.05), (x, y, -0.05)) for x in (-0.2, 0.2) for y in (-0.2, 0.2))
STOOL = Body("stool", 2.0, FEET, inertia=Inertia((0.05, 0.05, 0.1)))


@pytest.mark.parametrize(
    ("body", "dynamic"), [(BLOCK, 0.5), (STOOL, 0.5), (STOOL, 0.2)], ids=lambda each: getattr(each, "name", each)
)
@pytest.mark.parametrize("slope", [0.3, -0.3])
def test_a_body_stays_on_a_slope_below_the_angle_of_its_static_friction(
    engine: Engine, body: Body, dynamic: float, slope: float
) -> None:
    world = replace(at_rest(body, UNTURNED), slope_rad=slope, material=Material(0.5, dynamic))

    assert slid(engine, world) == pytest.approx(0.0, abs=5e-3)


@pytest.mark.parametrize("body", [BLOCK, STOOL], ids=lambda body: body.name)
@pytest.mark.parametrize("slope", [0.55, -0.55])
def test_a_body_slides_down_a_steeper_slope_against_its_dynamic_friction(
    engine: Engine, body: Body, slope: float
) -> None:
    world = replace(at_rest(body, UNTURNED), slope_rad=slope, material=Material(0.5, 0.2))

    x = slid(engine, world)

    downwards = G * (np.sin(abs(slope)) - 0.2 * np.cos(slope))
    assert (x[2] - 2 * x[1] + x[0]) / 0.25**2 == pytest.approx(-np.sign(slope) * downwards, rel=0.06)


def test_a_body_has_the_friction_of_its_own_surface(engine: Engine) -> None:
    icy = replace(BLOCK, surface="ice")
    world = replace(at_rest(icy, UNTURNED), slope_rad=0.2, material=GRIP, surfaces=(("ice", Material(0.05, 0.05)),))
    gripping = replace(world, surfaces=())

    x = slid(engine, world)

    assert (x[2] - 2 * x[1] + x[0]) / 0.25**2 == pytest.approx(-G * (np.sin(0.2) - 0.05 * np.cos(0.2)), rel=0.05)
    assert slid(engine, gripping) == pytest.approx(0.0, abs=5e-3)


def test_a_slope_turns_the_fall(engine: Engine) -> None:
    world = block(Body("ball", 1.0, Sphere(0.05)), start_height_m=5.0, slope_rad=0.3)
    seen = times(0.5)

    path = positions(engine, world, held(seen))

    fall = 0.5 * G * seen * (seen + STEP_S)
    assert path[:, 0] == pytest.approx(-fall * np.sin(0.3), rel=0.02, abs=1e-3)
    assert path[:, 2] == pytest.approx(5.0 - fall * np.cos(0.3), rel=0.02)


def test_a_base_begins_turned(engine: Engine) -> None:
    turn = tuple(about(np.array([0.0, 0.6, 0.8]), np.array([1.1]))[0].tolist())
    body = Body("body", 1.0, Box((0.1, 0.2, 0.3)), (0.05, 0.0, 0.02), inertia=Inertia((0.02, 0.03, 0.04), QUARTER))
    world = block(body, start_height_m=3.0, start_turn=turn)
    honoured(engine, world)

    seen = engine.rollout(world, Motion(np.zeros(1), np.zeros((1, 0)), np.array([0.0, 0.25])))

    assert seen.positions_m[0] == pytest.approx([0, 0, 3.0], abs=1e-6)
    assert seen.orientations == pytest.approx(np.array([turn, turn]), abs=1e-4)
    assert seen.positions_m[1, :2] == pytest.approx(0.0, abs=1e-4)


def test_a_tilted_start_is_on_the_ground_and_is_forgotten_afterwards(engine: Engine) -> None:
    body = Body("body", 1.0, Box((0.4, 0.2, 0.1)), (0.03, 0.0, 0.02), inertia=Inertia((0.02, 0.03, 0.04), QUARTER))
    world = block(body, start_height_m=0.1, start_turn=QUARTER)
    tilted = replace(world, noise=Noise(start_tilt_rad=0.1))
    honoured(engine, tilted)
    level = held(np.array([0.0, 0.5]))
    tilts = (0.1, 0.0), (0.0, -0.3), (0.2, 0.1)
    motions = [level, *(replace(level, start_tilt_rad=tilt) for tilt in tilts), level]

    seen = engine.rollouts([world, tilted], motions)

    for row, motion in enumerate(motions):
        alone = engine.rollout(world, motion)
        assert np.array_equal(seen.positions_m[row], [alone.positions_m] * 2)
        turn = product(alone.orientations[0], inverse(np.array(QUARTER)))
        x, y = motion.start_tilt_rad
        assert Rotation.from_quat(turn).as_rotvec() == pytest.approx([x, y, 0.0], abs=1e-6)
        height = clearances_m(world.bodies[0], alone.positions_m[:1], alone.orientations[:1])
        assert height == pytest.approx(
            clearances_m(world.bodies[0], np.array([[0, 0, 0.1]]), np.array([QUARTER])), abs=1e-6
        )
    assert np.array_equal(seen.positions_m[0], seen.positions_m[-1])
    assert np.abs(seen.positions_m[1:-1, :, 1] - seen.positions_m[1:-1, :, 0]).max() > 0.005
