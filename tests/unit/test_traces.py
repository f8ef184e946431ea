"""Traces of a physical robot: their clock, their place on the ground, and what is wrong with them."""

import tracemalloc
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gaplab.schemas.traces import TRACE_COLUMNS
from gaplab.services.core.arrays import frozen
from gaplab.services.core.errors import InvalidSpec
from gaplab.services.engines.mujoco.engine import MuJoCo
from gaplab.services.world.logs import MOST_ERRORS, Trace, read_trace
from gaplab.services.world.motions import open_loop
from gaplab.services.world.robots.quadruped import Quadruped
from gaplab.services.world.traces import TooShort, align, placed, unlikely

ROBOT = Quadruped()
MOTION = open_loop(ROBOT.motion(ROBOT.known))
END_S = float(MOTION.observe_s[-1])


@pytest.fixture(scope="module")
def expected() -> Trace:
    """The known gait in the simulator."""
    times = frozen(np.arange(151) * 0.02)
    poses = MuJoCo().record(ROBOT.world, MOTION, times).poses
    return Trace(times, poses[:, :3], poses[:, 3:])


def shifted(trace: Trace, lag_s: float, turn_rad: float = 0.0, noise: float = 0.0) -> Trace:
    """The same motion on a clock on which it begins at `lag_s`, elsewhere, with rest before and after it."""
    times = frozen(np.arange(-100, 251) * 0.02)
    seen = trace.at(np.clip(times, 0.0, END_S))
    turn = Rotation.from_rotvec([0.0, 0.0, turn_rad])
    rng = np.random.default_rng(1)
    positions = turn.apply(seen.positions_m) + [3.0, -2.0, 0.0] + noise * rng.standard_normal((len(times), 3))
    return Trace(frozen(times + lag_s), positions, (turn * Rotation.from_quat(seen.orientations)).as_quat())


def cut(trace: Trace, begin_s: float, end_s: float) -> Trace:
    kept = (trace.times_s <= begin_s + 1e-9) | (trace.times_s >= end_s - 1e-9)
    return Trace(trace.times_s[kept], trace.positions_m[kept], trace.orientations[kept])


def jumping(trace: Trace, at_s: float) -> Trace:
    """As a tracker that takes another marker for the base."""
    away = np.outer(trace.times_s > at_s - 0.001, [0.3, 0.0, 0.0])
    return Trace(trace.times_s, frozen(trace.positions_m + away), trace.orientations)


def frozen_from(trace: Trace, begin_s: float, end_s: float) -> Trace:
    held = np.clip(trace.times_s, None, begin_s)
    inside = (trace.times_s > begin_s) & (trace.times_s <= end_s)
    times = frozen(np.where(inside, held, trace.times_s))
    seen = trace.at(times)
    return Trace(trace.times_s, seen.positions_m, seen.orientations)


def moved(trace: Trace, by_m: Any) -> Trace:
    return replace(trace, positions_m=trace.positions_m + by_m)


def scaled(trace: Trace, factor: float) -> Trace:
    return replace(trace, positions_m=trace.positions_m * factor)


def on_its_side(trace: Trace) -> Trace:
    side = Rotation.from_rotvec([np.pi / 2, 0.0, 0.0])
    return replace(trace, orientations=(side * Rotation.from_quat(trace.orientations)).as_quat())


def still(trace: Trace) -> Trace:
    count = len(trace.times_s)
    return Trace(trace.times_s, np.tile(trace.positions_m[:1], (count, 1)), np.tile(trace.orientations[:1], (count, 1)))


def without_joints(trace: Trace) -> Trace:
    """As of a recording whose joints have no column."""
    return replace(trace, angles_rad=np.full((len(trace.times_s), len(ROBOT.world.joints)), np.nan))


@pytest.mark.parametrize(("lag_s", "noise"), [(0.0, 0.0), (12.34, 0.0), (1.7e9, 0.0), (-3.0, 0.0005)])
def test_the_clock_of_a_trace_is_found(expected: Trace, lag_s: float, noise: float) -> None:
    found = align(shifted(expected, lag_s, 1.0, noise), expected)

    assert found.lag_s == pytest.approx(lag_s, abs=0.011, rel=0)
    assert found.match is not None
    assert 0.5 < found.match <= 1.0


def test_the_start_is_where_a_base_at_rest_begins_to_move_however_it_moves_then(expected: Trace) -> None:
    """A gait repeats itself: what a wrong simulator expects fits a later step better."""
    slower = Trace(frozen(expected.times_s * 1.3), expected.positions_m, expected.orientations)
    trace = shifted(expected, 5.0)

    until = slower.times_s <= END_S
    found = align(trace, Trace(slower.times_s[until], slower.positions_m[until], slower.orientations[until]))

    assert found.after_rest
    assert found.lag_s == pytest.approx(5.0, abs=0.06)


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        (lambda trace: trace, ""),
        (lambda trace: cut(trace, 6.0, 7.0), "there is no row from 6 to 7 s"),
        (lambda trace: cut(trace, 4.98, 6.0), "there is no row from 4.98 to 6 s"),
        (lambda trace: cut(trace, 7.2, 8.2), "there is no row from 7.2 to 8.2 s"),
        (lambda trace: cut(trace, 4.9, 8.2), "there is no row from 4.9 to 8.2 s"),
        (lambda trace: cut(trace, 3.0, 5.0), ""),
        (lambda trace: frozen_from(trace, 6.0, 7.0), "everything stays the same from 6 s for 1 s"),
        (lambda trace: moved(trace, [0.0, 0.0, 230.0]), "the base begins 230 m high, and the simulators expect 0.17 m"),
        (lambda trace: scaled(trace, 1000.0), "are these millimetres (`x [mm]`)?"),
        (lambda trace: jumping(trace, 6.5), "the base jumps by 0.3 m at 6.5 s"),
        (lambda trace: on_its_side(trace), "the base begins tilted by 90° from what the simulators expect"),
        (lambda trace: still(trace), "nothing moves"),
        (lambda trace: without_joints(still(trace)), "nothing moves"),
        (lambda trace: without_joints(frozen_from(trace, 6.0, 7.0)), "everything stays the same from 6 s for 1 s"),
    ],
)
def test_what_is_unlikely_beside_the_expected_motion_is_said(expected: Trace, wrong: Any, said: str) -> None:
    trace = wrong(shifted(expected, 5.0))

    told = list(unlikely(trace, expected, align(trace, expected, 5.0), ROBOT.world))

    assert bool(told) == bool(said)
    assert any(said in each for each in told or [""])


def test_a_weak_match_without_rest_is_uncertain(expected: Trace) -> None:
    times = frozen(np.arange(0.0, 6.0, 0.02))
    driven = np.stack([0.3 * times, 0.01 * np.sin(9.0 * times), np.full(len(times), 0.17)], axis=-1)
    trace = Trace(times, driven, np.tile([0.0, 0.0, 0.0, 1.0], (len(times), 1)))

    found = align(trace, expected)

    assert not found.after_rest
    assert any("the recording does not begin at rest" in each for each in unlikely(trace, expected, found, ROBOT.world))


def test_a_robot_without_joints_has_traces(expected: Trace) -> None:
    simulated = replace(expected, angles_rad=np.empty((len(expected.times_s), 0)))

    assert align(shifted(expected, 5.0), simulated) == align(shifted(expected, 5.0), expected)


@pytest.mark.parametrize("turn_rad", [0.0, 2.5, -1.0])
def test_fitness_and_readings_depend_on_no_place_and_no_heading(expected: Trace, turn_rad: float) -> None:
    trace = shifted(expected, 5.0, turn_rad)
    lag_s = align(trace, expected).lag_s
    moved = placed(trace, lag_s, MOTION.observe_s, ROBOT.world)
    world_s = ROBOT.sensors.times_s

    real = float(ROBOT.fitness(MuJoCo().rollout(ROBOT.world, MOTION)))
    assert float(ROBOT.fitness(moved)) == pytest.approx(real, abs=0.01)
    told = ROBOT.sense(placed(trace, lag_s, world_s, ROBOT.world))
    assert told == pytest.approx(ROBOT.sense(expected.at(world_s)), abs=0.03)


@pytest.mark.parametrize("axis", [[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [0.6, 0.0, 0.8]])
@pytest.mark.parametrize("turn_rad", [0.0, 2.5])
def test_a_base_that_begins_turned_moves_in_a_trace_as_in_its_simulation(
    expected: Trace, axis: list[float], turn_rad: float
) -> None:
    start = Rotation.from_rotvec(np.pi / 2 * np.array(axis))
    world = replace(ROBOT.world, start_turn=tuple(start.as_quat().tolist()))
    turned = (Rotation.from_quat(expected.orientations) * start).as_quat()
    simulated = Trace(expected.times_s, expected.positions_m, frozen(turned))

    found = placed(shifted(simulated, 5.0, turn_rad), 5.0, MOTION.observe_s, world)

    as_simulated = simulated.at(MOTION.observe_s)
    heading = placed(simulated, 0.0, MOTION.observe_s, world)
    assert found.positions_m == pytest.approx(heading.positions_m, abs=1e-9)
    assert found.positions_m == pytest.approx(as_simulated.positions_m, abs=0.02)
    assert abs((found.orientations * as_simulated.orientations).sum(axis=-1)) == pytest.approx(1.0, abs=1e-3)


def test_a_given_lag_is_kept_and_a_motion_without_change_begins_with_its_trace(expected: Trace) -> None:
    assert align(shifted(expected, 5.0), expected, 5.1).lag_s == 5.1
    still = Trace(frozen([2.0, 4.0]), np.zeros((2, 3)), np.tile([0.0, 0.0, 0.0, 1.0], (2, 1)))
    found = align(still, Trace(frozen([0.0, 1.0]), still.positions_m, still.orientations))
    assert (found.lag_s, found.match) == (2.0, None)
    unknown = Trace(expected.times_s, expected.positions_m * np.nan, expected.orientations)
    assert align(shifted(expected, 5.0), unknown).match is None


def test_a_trace_that_lacks_a_part_of_the_motion_is_refused(expected: Trace) -> None:
    short = Trace(expected.times_s[:100], expected.positions_m[:100], expected.orientations[:100])
    with pytest.raises(TooShort, match=r"it lasts 1.98 s, and the motion 3 s"):
        align(short, expected)
    with pytest.raises(TooShort, match="would begin at 9 s"):
        align(shifted(expected, 0.0), expected, 9.0)


def table(**changes: Any) -> str:
    rows = [dict(zip(TRACE_COLUMNS, [place * 0.1, 0, 0, 0.2, 0, 0, 0, 1], strict=True)) for place in range(3)]
    rows[1] |= changes
    return "\n".join([",".join(TRACE_COLUMNS), *(",".join(str(cell) for cell in row.values()) for row in rows)])


def test_a_trace_is_read_with_any_order_units_and_more_columns() -> None:
    text = "qw;qx;qy;qz;note;time_s [ms];x (m);y [cm];z[mm]\n1;0;0;0;begins;500;1;200;3000\n1;0;0;0;;750;2;200;3000\n"
    trace = read_trace(text, "/traces/0", ROBOT.world)

    assert trace.times_s.tolist() == [0.5, 0.75]
    assert trace.positions_m.tolist() == [[1, 2, 3], [2, 2, 3]]
    assert trace.at(frozen([0.625])).positions_m.tolist() == [[1.5, 2, 3]]


def test_a_trace_of_rounded_times_is_aligned_to_its_last_row(expected: Trace) -> None:
    """390.97 + 1046 · 0.005 lies one rounding after 396.2."""
    times = frozen(np.round(390.97 + np.arange(524) * 0.01, 2))
    seen = expected.at(times - 392.0)

    found = align(Trace(times, seen.positions_m, seen.orientations), expected)

    assert times[0] + 1046 * 0.005 > times[-1]
    assert found.lag_s == pytest.approx(392.0, abs=0.011)


ENDLESS = '"' + "0123456789\n" * 20_000
"""A cell whose quote is not closed."""


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "one column each of time_s, x, y, z, qx, qy, qz, qw"),
        ("time_s,x,y,z\n0,0,0,0\n", "one column each of qx, qy, qz, qw"),
        (table(x="left"), "line 3, x: 'left' is not a finite number"),
        (table(z="nan"), "line 3, z: 'nan' is not a finite number"),
        (table(qw=""), "line 3, qw: '' is not a finite number"),
        (table(time_s=0.0), "line 3: time_s must ascend, and 0.0 follows 0.0"),
        (
            table().replace("time_s", "time_s [min]").replace("x,", "x (ft),", 1).replace("qw", "qw [rad]"),
            "line 1, time_s: the unit 'min' is not known; permitted: s, ms; .*x: the unit 'ft' is not known; permitted:"
            " m, cm, mm; .*qw: the unit 'rad'",
        ),
        (table(time_s=1700000000.02), "line 4: time_s must ascend, and 0.2 follows 1700000000.02"),
        (table(time_s=9e9), "line 4: time_s must ascend"),
        (table(qw=2), "line 3: qx, qy, qz, qw have norm 2; permitted: 1"),
        (",".join(TRACE_COLUMNS), "the trace has 0 rows; at least 2 are needed"),
        (table().replace("0.2,0.0,0", "5000,0,0").replace("\n0.2", "\n5000"), "at most 3600 s are permitted"),
        (f"{table()}\n{ENDLESS}", r"line 13112: the line is not CSV: field larger than field limit \(131072\)"),
        (ENDLESS, r"line 13108: the line is not CSV: field larger than field limit"),
    ],
)
def test_what_is_no_trace_is_refused_with_its_line(text: str, message: str) -> None:
    with pytest.raises(InvalidSpec, match=message) as refused:
        read_trace(text, "/traces/0", ROBOT.world)
    assert {each.pointer for each in refused.value.violations} == {"/traces/0"}


def test_a_hostile_trace_gives_few_errors_and_takes_little_memory() -> None:
    """The errors of 50,000 lines of eight cells took 40 MB."""
    text = ",".join(TRACE_COLUMNS) + "\n" + "x\n" * 50_000
    tracemalloc.start()

    with pytest.raises(InvalidSpec) as refused:
        read_trace(text, "/traces/0", ROBOT.world)

    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert len(refused.value.violations) == MOST_ERRORS
    assert peak < 10e6
