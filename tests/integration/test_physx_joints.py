"""PhysX's drives, dry friction and surfaces, beyond what the contract asks of every engine."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from gaplab.services.engines.physx import PhysX
from gaplab.services.engines.physx.robot import MOST_SURFACES
from gaplab.services.world.motions import Motion
from gaplab.services.world.world import (
    Body,
    Box,
    Capsule,
    Cylinder,
    Hull,
    Inertia,
    Joint,
    Material,
    Motor,
    Part,
    PDMotor,
    Shape,
    Sphere,
    World,
)
from tests.contract.textbook import LOAD, STEP_S, G, X, Y, Z, angles, changing, held, rig, times

if not PhysX.available():
    pytest.skip(PhysX.install, allow_module_level=True)

KG = LOAD.mass_kg


@pytest.fixture
def engine() -> Iterator[PhysX]:
    engine = PhysX()
    yield engine
    engine.close()


@pytest.mark.parametrize("push", [7.0, 30.0])
def test_damping_acts_beside_the_limit_of_a_motor(engine: PhysX, push: float) -> None:
    """A motor at its limit ends at the speed limit / damping, also if it asks for a thousand times its limit."""
    motor = PDMotor("position", push, kp=1e4, kd=1.0)
    world = rig(axis=X, slides=True, damping=4.0, motor=motor)

    x = angles(engine, world, held(np.array([3.0, 4.0]), 1000.0))

    assert x[1] - x[0] == pytest.approx(push / 4.0, rel=0.01)


def test_a_velocity_motor_at_its_limit_and_below_it_is_damped(engine: PhysX) -> None:
    world = rig(axis=X, slides=True, damping=4.0, motor=PDMotor("velocity", 2.0, kd=100.0))
    seen = np.array([3.0, 4.0, 7.0, 8.0])

    x = angles(engine, world, changing(seen, {0.0: 0.3, 5.0: 3.0}))

    assert x[1] - x[0] == pytest.approx(100.0 * 0.3 / 104.0, rel=0.01)
    assert x[3] - x[2] == pytest.approx(2.0 / 4.0, rel=0.01)


def test_a_position_motor_within_its_dry_friction_stays_off_its_target(engine: PhysX) -> None:
    world = rig(axis=X, slides=True, dry_friction=3.0, motor=PDMotor("position", 1e3, kp=100.0, kd=30.0))

    stuck = angles(engine, world, held(np.array([2.0, 3.0]), 0.02))
    moved = angles(engine, world, held(np.array([4.0, 5.0]), 0.2))

    assert stuck == pytest.approx(0.0, abs=1e-4)
    assert 0.2 - moved == pytest.approx(0.03, abs=2e-3)  # friction / kp
    assert moved[1] == pytest.approx(moved[0], abs=1e-5)


@pytest.mark.parametrize("friction", [15.0, 25.0])
def test_dry_friction_carries_a_weight_up_to_its_threshold(engine: PhysX, friction: float) -> None:
    world = rig(gravity_m_s2=G, axis=Z, slides=True, dry_friction=friction)
    seen = times(0.5)

    z = angles(engine, world, held(seen))

    fall = max(0.0, G - friction / KG)
    late = friction / KG * STEP_S * seen if fall else 0.0  # no load is known in the first step
    assert z == pytest.approx(-0.5 * fall * seen * (seen + STEP_S) - late, rel=0.03, abs=1e-3)


@pytest.mark.parametrize("resistance", [{"damping": 2.0}, {"dry_friction": 2.0}])
def test_a_servo_is_slowed_only_if_resistance_takes_its_torque(engine: PhysX, resistance: dict[str, Any]) -> None:
    strong, weak = (rig(axis=X, slides=True, motor=Motor(0.5, force, 1.0), **resistance) for force in (100.0, 1.5))

    reached = angles(engine, strong, held(np.array([2.0]), 0.5))
    ending = angles(engine, weak, held(np.array([5.0, 6.0]), 100.0))

    assert reached == pytest.approx([0.5], abs=2e-3)
    assert ending[1] - ending[0] == pytest.approx(0.75 if "damping" in resistance else 0.0, abs=0.01)


def test_a_servos_recorded_torque_is_what_it_gives_against_dry_friction(engine: PhysX) -> None:
    world = rig(axis=X, slides=True, motor=Motor(0.5, 100.0, 1.0), dry_friction=2.0)

    torques = engine.record(world, held(np.array([1.0]), 5.0), np.array([1.0])).torques_nm

    assert torques is not None
    assert torques[0, 0] == pytest.approx(2.0, rel=0.05)


def cart(surface: str, mass_kg: float = 1.0) -> Body:
    return Body(f"cart {surface}", mass_kg, Box((0.2, 0.2, 0.1)), surface=surface)


def test_each_surface_has_its_own_ground(engine: PhysX) -> None:
    """Three bodies on slides in one robot, each on a material of its own, are braked by it."""
    beam = Body("beam", 100.0, Sphere(0.1), collides=False)
    carts = [cart(name) for name in ("", "ice", "tar")]
    joints = []
    bodies = [beam]
    for place, body in enumerate(carts):
        lift = Body(f"lift {place}", 0.1, Sphere(0.02), collides=False)
        bodies += [lift, body]
        joints += [
            Joint(f"up {place}", "beam", lift.name, (0.0, float(place), 0.0), Z, slides=True),
            Joint(f"along {place}", lift.name, body.name, (0.0, 0.0, -0.95), X, slides=True),
        ]
    world = World(
        bodies=tuple(bodies),
        joints=tuple(joints),
        material=Material(0.3, 0.3),
        surfaces=(("ice", Material(0.05, 0.05)), ("tar", Material(0.8, 0.8))),
        start_height_m=1.0,
        slope_rad=0.6,
        fixed=True,
        time_step_s=STEP_S,
    )

    places = engine.record(world, held(np.array([0.5])), np.array([0.25, 0.5])).angles_rad

    assert places is not None
    gained = (places[1] - 2 * places[0])[1::2] / 0.25**2
    expected = [-(G * np.sin(0.6) - mu * 1.1 * G * np.cos(0.6)) for mu in (0.3, 0.05)]  # a cart carries its lift
    assert gained[:2] == pytest.approx(expected, rel=0.05)
    assert places[1][5] == pytest.approx(0.0, abs=5e-3)


def test_more_surfaces_than_collision_groups_are_not_simulated() -> None:
    def with_surfaces(count: int) -> World:
        return World(bodies=tuple(cart(str(number)) for number in range(count)))

    assert PhysX.runs(with_surfaces(MOST_SURFACES))
    assert not PhysX.runs(with_surfaces(MOST_SURFACES + 1))
    assert (
        PhysX.exceeded(with_surfaces(MOST_SURFACES + 1)) == f"it has {MOST_SURFACES + 1} special surfaces, and PhysX 31"
    )


FEET: list[Shape | tuple[Part, ...]] = [
    Box((0.1, 0.08, 0.05)),
    Capsule(0.05, 0.1),
    Cylinder(0.05, 0.1),
    Hull(tuple((x, y, z) for x in (-0.05, 0.06) for y in (-0.04, 0.05) for z in (-0.03, 0.04))),
    tuple(Part(Sphere(0.03), (x, y, 0.0)) for x in (-0.05, 0.0, 0.05) for y in (-0.03, 0.0, 0.03)),
]


@pytest.mark.parametrize("foot", FEET, ids=lambda foot: "parts" if isinstance(foot, tuple) else foot.kind)
def test_a_rollout_after_any_others_is_that_of_a_fresh_engine(engine: PhysX, foot: Shape | tuple[Part, ...]) -> None:
    """Also if many pairs of shapes touch the ground: PhysX solves them in the order of all earlier contacts."""
    inertia = Inertia((0.001, 0.001, 0.001))
    feet = tuple(Body(f"foot {name}", 0.3, foot, inertia=inertia) for name in "abcd")
    places = ((0.2, 0.15, -0.3), (0.2, -0.15, -0.3), (-0.2, 0.15, -0.3), (-0.2, -0.15, -0.3))
    motor = PDMotor("position", 20.0, kp=30.0, kd=1.0)
    joints = tuple(
        Joint(body.name, "trunk", body.name, place, Y, motor) for body, place in zip(feet, places, strict=True)
    )
    world = World((Body("trunk", 3.0, Box((0.5, 0.3, 0.1))), *feet), joints, start_height_m=0.36, time_step_s=1 / 240)
    rng = np.random.default_rng(0)
    at_s, seen = np.linspace(0.0, 1.0, 6), np.array([0.5, 1.0, 1.5])
    motions = [Motion(at_s, rng.uniform(-1.5, 1.5, (6, 4)), seen) for _ in range(4)]
    expected = [PhysX().rollout(world, motion).positions_m for motion in motions]

    for number in rng.permutation(np.repeat(np.arange(4), 4)):
        assert np.array_equal(engine.rollout(world, motions[number]).positions_m, expected[number])


def test_principal_axes_that_turn_in_place_are_those_of_a_fresh_engine(engine: PhysX) -> None:
    body = Body("bar", 1.0, Box((0.4, 0.1, 0.1)), inertia=Inertia((0.002, 0.014, 0.014)))
    turned = replace(body, inertia=Inertia((0.002, 0.014, 0.014), (0.0, np.sin(0.3), 0.0, np.cos(0.3))))
    world = World((body,), start_height_m=0.5, start_turn=(np.sin(0.2), 0.0, 0.0, np.cos(0.2)), time_step_s=STEP_S)
    edited = world.edited("body.inertia", bodies=(turned,))
    motion = held(np.array([1.0]))
    before = engine.rollout(world, motion).positions_m

    found = engine.rollout(edited, motion).positions_m

    assert np.array_equal(found, PhysX().rollout(replace(edited, origin=None, edits=frozenset()), motion).positions_m)
    assert not np.array_equal(found, before)
    assert np.array_equal(engine.rollout(world, motion).positions_m, before)
