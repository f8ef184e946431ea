"""The MuJoCo engine's law of motors and contacts, as plain functions."""

from typing import Any

import numpy as np
import pytest

from gaplab.services.engines.mujoco.law import (
    PD,
    Servo,
    apply_impulses,
    coast,
    damp,
    drive,
    press,
    settings,
    stop,
    touch,
)
from gaplab.services.world.robots.quadruped import Quadruped
from gaplab.services.world.world import PDLaw

WORLD = Quadruped().world
STEP_S = WORLD.time_step_s
KNOWN = settings(WORLD, 7)
NO_SINGLES = (0, 0)
SURFACE = np.array([1.0, 1.0, 0.8, 0.5, 0.0])


def pressed(inverse: Any, excess: Any, friction: Any, sweeps: Any = 50) -> Any:
    impulses = np.zeros(len(excess))
    press(sweeps, NO_SINGLES, inverse, excess, np.full(len(excess), friction), impulses)
    return impulses


def mass(rows: Any, seed: Any = 0) -> Any:
    """Some inverse inertia: symmetric, positive definite."""
    square = np.random.default_rng(seed).normal(size=(rows, rows))
    return square @ square.T + np.eye(rows)


def test_a_contact_that_leaves_is_let_go() -> None:
    assert np.array_equal(pressed(mass(3), np.array([0.5, 0.0, 0.0]), 1.0), np.zeros(3))


def test_a_contact_that_grips_has_the_speed_that_it_wants() -> None:
    excess = np.array([-1.0, 0.1, -0.1])

    pressed(mass(3), excess, 10.0)

    assert excess == pytest.approx(np.zeros(3), abs=1e-9)


def test_friction_stays_in_its_cone_and_opposes_the_slide() -> None:
    excess = np.array([-1.0, 3.0, 4.0])

    normal, *friction = pressed(np.eye(3), excess, 0.5)

    assert np.hypot(*friction) == pytest.approx(0.5 * normal)
    assert friction == pytest.approx([-0.3, -0.4])
    assert excess[0] == pytest.approx(0.0)


@pytest.mark.parametrize("seed", range(5))
def test_many_contacts_obey_the_law_all_at_once(seed: Any) -> None:
    inverse, free = mass(12, seed), np.random.default_rng(seed).normal(size=12)
    after = free.copy()

    impulses = pressed(inverse, after, 0.7, sweeps=2000)

    assert after == pytest.approx(free + inverse @ impulses)
    for row in range(0, 12, 3):
        normal, *friction = impulses[row : row + 3]
        assert normal >= 0
        assert normal == pytest.approx(0, abs=1e-6) or after[row] == pytest.approx(0, abs=1e-6)
        assert after[row] >= -1e-6
        assert np.hypot(*friction) <= 0.7 * normal + 1e-9
        grips = np.hypot(*friction) < 0.7 * normal - 1e-6
        assert not grips or after[row + 1 : row + 3] == pytest.approx(np.zeros(2), abs=1e-6)


@pytest.mark.parametrize(("sliding", "friction"), [(0.0, 1.0), (0.005, 1.0), (0.02, 0.8), (3.0, 0.8)])
def test_what_slides_has_the_dynamic_coefficient(sliding: Any, friction: Any) -> None:
    assert touch(KNOWN, 0.0, np.array([0.0, 0.6 * sliding, 0.8 * sliding]), SURFACE, np.zeros(3)) == friction


@pytest.mark.parametrize(("approach", "leaves"), [(3.0, 1.5), (0.3, 0.15), (0.15, 0.0)])
def test_only_fast_approaches_bounce(approach: Any, leaves: Any) -> None:
    excess = np.zeros(3)

    touch(KNOWN, 0.0, np.array([-approach, 0.0, 0.0]), SURFACE, excess)

    assert -excess[0] == pytest.approx(leaves)


def test_what_is_in_the_ground_is_pushed_out_a_fifth_of_its_depth_in_a_step() -> None:
    excess = np.zeros(3)

    touch(KNOWN, 0.01, np.zeros(3), SURFACE, excess)

    assert -excess[0] * STEP_S == pytest.approx(0.002)


def test_a_motor_that_is_told_no_number_gives_none() -> None:
    known = settings(WORLD, 7, [Servo(6, 0.1, 20.0, 8.0, 0.01)])
    forces = np.array([*np.zeros(6), np.nan])

    drive(known, forces, np.zeros(8), np.zeros(7), np.zeros(7))

    assert np.isnan(forces[6])


def test_impulses_act_on_the_degrees_of_freedom_as_these_move_the_contacts() -> None:
    rng = np.random.default_rng(0)
    jacobian, accelerations, impulses, before = (
        rng.normal(size=(3, 7)),
        rng.normal(size=7),
        rng.normal(size=3),
        np.ones(3),
    )
    excess, cleared, forces = np.empty(3), np.ones(3), np.zeros(7)

    coast(STEP_S, jacobian, before, accelerations, excess, cleared)
    apply_impulses(STEP_S, jacobian, impulses, forces)

    assert excess == pytest.approx(before + STEP_S * jacobian @ accelerations)
    assert np.array_equal(cleared, np.zeros(3))
    assert forces == pytest.approx(jacobian.T @ impulses / STEP_S)


def test_a_limit_lets_a_joint_close_its_gap_and_pushes_it_back_from_beyond() -> None:
    assert stop(KNOWN, 0.1) * STEP_S == pytest.approx(-0.1)
    assert stop(KNOWN, -0.1) * STEP_S == pytest.approx(0.02)


@pytest.mark.parametrize(("speed", "left"), [(0.05, 0.0), (0.3, 0.2), (-0.3, -0.2)])
def test_dry_friction_brakes_at_most_with_its_torque(speed: Any, left: Any) -> None:
    excess, impulses = np.array([speed]), np.zeros(1)

    press(1, (1, 1), np.eye(1), excess, np.array([0.1]), impulses)

    assert excess[0] == pytest.approx(left)
    assert abs(impulses[0]) <= 0.1


@pytest.mark.parametrize(("speed", "left"), [(-0.3, 0.0), (0.3, 0.3)])
def test_a_limit_pushes_and_never_pulls(speed: Any, left: Any) -> None:
    excess, impulses = np.array([speed]), np.zeros(1)

    press(1, (0, 1), np.eye(1), excess, np.array([np.inf]), impulses)

    assert excess[0] == pytest.approx(left)
    assert impulses[0] >= 0


@pytest.mark.parametrize("seed", range(5))
def test_friction_limits_and_contacts_obey_their_laws_all_at_once(seed: Any) -> None:
    inverse, free = mass(8, seed), np.random.default_rng(seed).normal(size=8)
    after, impulses = free.copy(), np.zeros(8)

    press(2000, (1, 2), inverse, after, np.array([0.2, np.inf, 0.7, 0, 0, 0.7, 0, 0]), impulses)

    assert after == pytest.approx(free + inverse @ impulses)
    assert abs(impulses[0]) <= 0.2
    assert abs(impulses[0]) == pytest.approx(0.2) or after[0] == pytest.approx(0, abs=1e-6)
    assert np.sign(impulses[0]) != np.sign(after[0]) or abs(after[0]) < 1e-6
    for row in (1, 2, 5):
        assert impulses[row] == pytest.approx(0, abs=1e-6) or after[row] == pytest.approx(0, abs=1e-6)
        assert impulses[row] >= 0


def test_damping_slows_the_joints_that_have_it() -> None:
    motor = PD(6, PDLaw(1.0, 0.0, 0.0, 9.0), 0.0)
    known, forces = settings(WORLD, 7, [], [motor], [(5, 0.5)]), np.ones(7)

    damp(known, forces, np.full(7, 4.0))

    assert np.array_equal(forces, [1.0, 1.0, 1.0, 1.0, 1.0, -1.0, 1.0])


@pytest.mark.parametrize(
    ("target", "took", "torque"), [(0.3, 0.0, 1.2), (9.0, 0.0, 2.0), (9.0, 5.0, 2.5), (-9.0, 5.0, -2.0)]
)
def test_a_pd_motor_adds_what_its_rotor_took_to_its_limit(target: Any, took: Any, torque: Any) -> None:
    known = settings(WORLD, 7, [], [PD(6, PDLaw(10.0, 1.0, 0.0, 2.0), 0.1)])
    forces, angles = np.array([*np.zeros(6), target]), np.array([*np.zeros(7), 0.1])

    drive(known, forces, angles, np.full(7, 0.8), np.full(7, took))

    assert forces[6] == pytest.approx(torque)
