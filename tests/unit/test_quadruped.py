"""The quadruped's genes, pulses and fitness, without physics."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gaplab.services.core.arrays import FloatArray
from gaplab.services.world.controllers import pulses
from gaplab.services.world.motions import Motion, Trajectory, open_loop
from gaplab.services.world.robots import quadruped
from gaplab.services.world.robots.quadruped import Quadruped

ROBOT = Quadruped()


def target(motion: Motion, actuator: int, time_s: float) -> float:
    row = int(np.searchsorted(motion.times_s, time_s, side="right")) - 1
    return float(motion.targets[row, actuator])


def path(*points: tuple[float, float]) -> Trajectory:
    count = len(points)
    positions = np.array([(x, y, 0.17) for x, y in points])
    return Trajectory(np.linspace(1.0, 3.0, count), positions, np.tile([0.0, 0.0, 0.0, 1.0], (count, 1)))


def test_it_has_twelve_actuators_of_two_genes_each() -> None:
    assert len(ROBOT.world.actuators) == 12
    assert ROBOT.space.size == 24
    assert ROBOT.known.shape == (24,)


def test_its_known_genome_lies_in_its_space_which_is_the_unit_box() -> None:
    assert np.array_equal(ROBOT.space.lower, np.zeros(24))
    assert np.array_equal(ROBOT.space.upper, np.ones(24))
    assert np.array_equal(ROBOT.space.contain(ROBOT.known), ROBOT.known)


def test_phases_wrap_and_widths_clip() -> None:
    assert ROBOT.space.periodic.tolist() == [True, False] * 12


def test_its_reality_is_the_papers() -> None:
    material = ROBOT.world.material

    assert (material.static_friction, material.dynamic_friction, material.restitution) == (1.0, 0.8, 0.0)


@given(st.floats(0, 1), st.floats(0, 1), st.integers(0, 11), st.floats(0, 0.999))
def test_a_pulse_starts_at_its_phase_and_lasts_for_its_width(
    phase: float, width: float, actuator: int, when: float
) -> None:
    genome = np.full(24, 0.5)
    genome[2 * actuator], genome[2 * actuator + 1] = phase, width
    share = pulses.NARROWEST + (pulses.WIDEST - pulses.NARROWEST) * width
    since = (when - phase) % 1.0
    if min(since, abs(since - share), 1.0 - since) < 1e-6:
        return  # on an edge, where rounding decides

    motion = open_loop(ROBOT.motion(genome))

    amplitude = quadruped.AMPLITUDES_RAD[actuator % 3]
    expected = amplitude if since < share else -amplitude
    for period in (0, 1, 3):
        assert target(motion, actuator, (period + when) * quadruped.PERIOD_S) == expected


@pytest.mark.parametrize("counted_s", [0.3, 2.5, 11.37])
def test_motions_equal_the_plain_formula_to_the_last_bit(counted_s: float) -> None:
    robot, rng = Quadruped(Quadruped.Options(counted_s=counted_s)), np.random.default_rng(0)
    nearly = np.minimum(rng.choice([0.0, 0.1, 0.5, 1.0], (50, 24)) + rng.choice([0.0, 1e-16, 3e-16], (50, 24)), 1.0)
    tenths, anywhere = rng.integers(0, 11, (50, 24)) / 10, robot.space.draw(50, rng)

    for genome in (robot.known, *nearly, *tenths, *anywhere):
        times_s, targets = plainly(genome, quadruped.SETTLING_S + counted_s)
        motion = open_loop(robot.motion(genome))
        assert motion.times_s.tobytes() == times_s.tobytes()
        assert motion.targets.tobytes() == targets.tobytes()
        assert not motion.times_s.flags.writeable
        assert not motion.targets.flags.writeable


def plainly(genome: FloatArray, duration_s: float) -> tuple[FloatArray, FloatArray]:
    """Return times and targets of a motion by the formula, without regard to speed."""
    phases, widths = (
        genome[0::2],
        pulses.NARROWEST + (pulses.WIDEST - pulses.NARROWEST) * genome[1::2],
    )
    edges = np.mod(np.concatenate([phases, phases + widths]), 1.0)
    cycles = np.arange(np.ceil(duration_s / quadruped.PERIOD_S))
    times = np.unique(np.append(0.0, np.add.outer(cycles, edges)))
    middles = (times + np.append(times[1:], times[-1] + 1e-9)) / 2
    inside = np.mod(middles[:, None] - phases, 1.0) < widths
    amplitudes = np.tile(quadruped.AMPLITUDES_RAD, 4)
    return times * quadruped.PERIOD_S, np.where(inside, amplitudes, -amplitudes)


def test_phases_of_zero_and_one_are_the_same_controller() -> None:
    low, high = np.full(24, 0.3), np.full(24, 0.3)
    low[0::2], high[0::2] = 0.0, 1.0

    assert np.array_equal(open_loop(ROBOT.motion(low)).targets, open_loop(ROBOT.motion(high)).targets)
    assert open_loop(ROBOT.motion(low)).times_s == pytest.approx(open_loop(ROBOT.motion(high)).times_s)


def test_the_motion_starts_at_zero_and_ascends() -> None:
    motion = open_loop(ROBOT.motion(ROBOT.known))

    assert motion.times_s[0] == 0.0
    assert np.all(np.diff(motion.times_s) > 0)


def test_the_settling_time_does_not_count() -> None:
    motion = ROBOT.motion(ROBOT.known)

    assert motion.observe_s[0] == quadruped.SETTLING_S
    assert motion.observe_s[-1] == pytest.approx(quadruped.SETTLING_S + quadruped.COUNTED_S)


def test_fitness_is_the_speed_as_the_crow_flies_in_whatever_direction() -> None:
    assert ROBOT.fitness(path((0.0, 0.0), (3.0, 4.0))) == pytest.approx(2.5)
    assert ROBOT.fitness(path((1.0, 1.0), (1.0, -1.0))) == pytest.approx(1.0)
    assert ROBOT.fitness(path((0.0, 0.0), (9.0, 9.0), (0.0, 0.0))) == 0.0


def test_a_failed_rollout_has_no_fitness() -> None:
    assert np.isnan(ROBOT.fitness(path((0.0, 0.0), (np.nan, np.nan))))


def test_fitness_keeps_the_leading_axes_of_a_batch() -> None:
    single = path((0.0, 0.0), (1.0, 0.0))
    batch = Trajectory(
        single.times_s, np.tile(single.positions_m, (4, 3, 1, 1)), np.tile(single.orientations, (4, 3, 1, 1))
    )

    assert ROBOT.fitness(batch).shape == (4, 3)


def test_left_and_right_legs_are_mirror_images() -> None:
    hinges = {joint.name: joint for joint in ROBOT.world.joints}

    for joint in ("yaw", "roll", "knee"):
        left, right = hinges[f"front_left_{joint}"], hinges[f"front_right_{joint}"]
        assert left.axis == tuple(-each for each in right.axis)
        assert (left.origin_m[0], left.origin_m[1]) == (right.origin_m[0], -right.origin_m[1])
