"""Traces: the recorded motion of a physical robot's base, from which the robot's code computes fitness and readings.

A trace in CSV has a line for each moment, with the pose of the base.

A trace has its own clock and its own place on the ground. A recording that begins at rest shows when the motion
begins; around that moment, else anywhere, the clock is aligned by cross-correlation with the motion that a simulator
expects. The place is aligned by the pose at the start of the motion. Heights are above the ground, and z points up.

Source: gaplab.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy

from gaplab.schemas.traces import TRACE_COLUMNS
from gaplab.services.core.arrays import FloatArray, frozen
from gaplab.services.core.errors import InvalidSpec, Violation
from gaplab.services.csv_tables import CsvRow, finite, read_csv
from gaplab.services.world.kinematics import from_start
from gaplab.services.world.motions import Trajectory
from gaplab.services.world.world import World

STEP_S = 0.005
"""Resolution of the alignment."""

REST_S = 0.2
"""Shortest rest before a motion that shows when it begins."""

MOVED_M, MOVED_RAD = 0.005, 0.03
"""How far a base has moved, or turned, since its rest, from which it moves; and as much noise as rest may have."""

AROUND_S = 0.03
"""Longest time between the start that rest shows and the one with the best match; half a period of a gait is more."""

LEAST_CHANGE = 1e-9
"""Standard deviation of a feature below which it says nothing about time."""

_UNITS: dict[str, tuple[str, ...]] = {"time_s": ("", "s", "ms")} | dict.fromkeys("xyz", ("", "m", "cm", "mm"))
_UNITS |= dict.fromkeys(TRACE_COLUMNS[4:], ("", "1"))
"""Units that a heading may state, by column; without one, seconds and metres."""

_SHARES = {"": 1.0, "1": 1.0, "s": 1.0, "ms": 1000.0, "m": 1.0, "cm": 100.0, "mm": 1000.0}
"""How many of a unit are a second or a metre."""

MOST_LINES = 500_000
"""Most lines of a trace: 500 s at a kilohertz."""

LONGEST_S = 3_600.0
"""Longest trace."""

MOST_ERRORS = 100
"""Most errors that are told of one trace."""


LONGEST_GAP_S = 0.25
"""Longest time without a pose, or with the same one, that is not remarked on; gaps also exceed four usual distances."""

FARTHER, FARTHER_M = 5.0, 0.5
"""How many times as far as expected a base moves, and how much farther, from which it is remarked on."""

HIGHER_M = 0.1
"""Difference from the expected height at the start, as a share of it too if that is more, that is remarked on."""

TILTED_RAD = 0.5
"""Difference from the expected tilt at the start that is remarked on."""

WEAK, WEAKEST = 0.8, 0.1
"""Match below which a start is uncertain: where it was found by correlation alone, and after rest."""


@dataclass(frozen=True, eq=False)
class Trace:
    """The recorded motion of a base.

    Attributes:
        times_s: `(k,)`, ascending, on a clock of its own.
        positions_m: `(k, 3)`.
        orientations: `(k, 4)`: quaternions x, y, z, w.
    """

    times_s: FloatArray
    positions_m: FloatArray
    orientations: FloatArray

    @cached_property
    def _turns(self) -> "scipy.spatial.transform.Slerp":
        transform = scipy.spatial.transform
        return transform.Slerp(self.times_s, transform.Rotation.from_quat(self.orientations))

    def at(self, times_s: FloatArray) -> Trajectory:
        """Return the poses at times `(t,)` within the trace, interpolated."""
        position = [np.interp(times_s, self.times_s, column) for column in self.positions_m.T]
        return Trajectory(times_s, np.stack(position, axis=-1), self._turns(times_s).as_quat())


@dataclass(frozen=True)
class Alignment:
    """When a motion began on the clock of a trace.

    Attributes:
        lag_s: time on that clock.
        match: correlation with the expected motion, at most 1; None if nothing was correlated.
        after_rest: whether the trace begins at rest, so that its start is where the base begins to move.
    """

    lag_s: float
    match: float | None = None
    after_rest: bool = False


class TooShort(ValueError):
    """A trace does not contain the whole motion."""


def align(trace: Trace, expected: Trace, lag_s: float | None = None) -> Alignment:
    """Return when the motion began on the clock of a trace, which must contain the whole motion.

    Args:
        trace: as recorded.
        expected: what a simulator expects, from the start of the motion to its last observation; nan if its physics
            failed.
        lag_s: the lag if it is known; None: it is found. If the expected motion does not change, the trace begins with
            the motion.

    Raises:
        TooShort: the trace does not contain the whole motion.
    """
    first, last = trace.times_s[0], trace.times_s[-1]
    duration = float(expected.times_s[-1])
    latest = last - duration
    if lag_s is not None:
        if not first - STEP_S <= lag_s <= latest + STEP_S:
            when = f"it begins at {first:.10g} s and ends at {last:.10g} s"
            raise TooShort(f"{when}; the motion of {duration:g} s would begin at {lag_s:.10g} s")
        return Alignment(float(np.clip(lag_s, first, max(first, latest))))
    if latest < first - STEP_S:
        raise TooShort(f"it lasts {last - first:g} s, and the motion {duration:g} s")
    count = int((last - first) / STEP_S + 1e-6) + 1
    moving = _features(trace, frozen(first + np.arange(count) * STEP_S))
    length = min(count, int(duration / STEP_S + 1e-6) + 1)
    template = _features(expected, frozen(np.arange(length) * STEP_S))
    scores = _correlations(moving, template)
    if scores is None:
        return Alignment(float(first))
    near, begun = np.ones(len(scores), dtype=bool), _onset(trace)
    if begun is not None and (expected_to := _onset(expected, at_once=True)) is not None:
        away = np.abs(first + np.arange(len(scores)) * STEP_S - (begun - expected_to))
        near = away <= max(AROUND_S, float(away.min()))
    best = int(np.argmax(np.where(near, scores, -np.inf)))
    lag_s = float(min(first + best * STEP_S, max(first, latest)))
    return Alignment(lag_s, float(min(scores[best], 1.0)), after_rest=not near.all())


def _onset(trace: Trace, *, at_once: bool = False) -> float | None:
    """Return when a base begins to move, on the clock of its trace; None if it does not, or not after rest.

    There is no rest if the motion begins `at_once`, with the trace.
    """
    resting = trace.times_s <= trace.times_s[0] + (0.0 if at_once else REST_S)
    away_m = np.linalg.norm(trace.positions_m - trace.positions_m[resting].mean(axis=0), axis=1)
    cosine = np.abs(trace.orientations @ trace.orientations[0])
    away_rad = 2.0 * np.arccos(np.clip(cosine, 0.0, 1.0))
    moved = (away_m > MOVED_M) | (away_rad > MOVED_RAD)
    if np.any(moved[resting]) or not np.any(moved):
        return None
    return float(trace.times_s[int(np.argmax(moved))])


def placed(trace: Trace, lag_s: float, times_s: FloatArray, world: World) -> Trajectory:
    """Return the poses of a trace at times `(t,)` of the motion, which began at the lag, as in a simulation.

    There a motion begins above the origin, with the base turned as `world.start_turn`; only a turn about z is removed.
    """
    seen = trace.at(np.clip(times_s + lag_s, trace.times_s[0], trace.times_s[-1]))
    start = trace.at(frozen([lag_s]))
    rotation = scipy.spatial.transform.Rotation
    heading = rotation.from_quat(from_start(world, start.orientations)[0]).apply([1.0, 0.0, 0.0])
    back = rotation.from_rotvec([0.0, 0.0, -np.arctan2(heading[1], heading[0])])
    moved = seen.positions_m - start.positions_m[0] * [1.0, 1.0, 0.0]
    turned = (back * rotation.from_quat(seen.orientations)).as_quat()
    return Trajectory(times_s, back.apply(moved), turned)


def _features(trace: Trace, times_s: FloatArray) -> FloatArray:
    """Return features `(3, t)` that depend on no place and no heading: speed over ground, vertical speed, and tilt."""
    if not np.all(np.isfinite(trace.positions_m)):
        return np.zeros((3, len(times_s)))
    seen = trace.at(np.clip(times_s, trace.times_s[0], trace.times_s[-1]))
    speeds = np.gradient(seen.positions_m, axis=0) if len(times_s) > 1 else np.zeros_like(seen.positions_m)
    x, y = seen.orientations[:, 0], seen.orientations[:, 1]
    tilts = np.arccos(np.clip(1.0 - 2.0 * (x**2 + y**2), -1.0, 1.0))
    return np.stack([np.linalg.norm(speeds[:, :2], axis=1), speeds[:, 2], tilts])


def _correlations(moving: FloatArray, template: FloatArray) -> FloatArray | None:
    """Return the mean Pearson correlation of features at each shift, `(shifts,)`; None if no feature changes."""
    found, length = [], template.shape[1]
    for recorded, wanted in zip(moving, template, strict=True):
        if wanted.std() < LEAST_CHANGE or recorded.std() < LEAST_CHANGE:
            continue
        centred, recorded_too = wanted - wanted.mean(), recorded - recorded.mean()
        shared = scipy.signal.correlate(recorded_too, centred, mode="valid")
        sums = np.concatenate([[0.0], np.cumsum(recorded_too)])
        squares = np.concatenate([[0.0], np.cumsum(recorded_too**2)])
        inside = squares[length:] - squares[:-length] - (sums[length:] - sums[:-length]) ** 2 / length
        size = np.sqrt(np.maximum(inside, 0.0) * (centred**2).sum())
        floor = 1e-6 * np.sqrt((recorded_too**2).sum() * (centred**2).sum())
        found.append(np.where(size > floor, shared / np.maximum(size, floor), 0.0))
    return np.mean(found, axis=0) if found else None


def read_trace(text: str, pointer: str) -> Trace:
    """Return the trace of a CSV file.

    A heading may state another unit than seconds and metres: `x [mm]`; further columns do not matter.

    Raises:
        InvalidSpec: with every error, each with its line and column, at the pointer.
    """
    header, rows, lines = read_csv(text)
    if lines > MOST_LINES:
        message = f"the trace has {lines:,} lines"
        raise InvalidSpec([Violation(pointer, f"{lines:,} lines", message, f"at most {MOST_LINES:,}")])
    names, units = zip(*map(_named, header.cells or [""]), strict=True)
    if missing := [name for name in TRACE_COLUMNS if names.count(name) != 1]:
        message = header.error or f"the trace needs one column each of {', '.join(missing)}"
        found = ",".join(header.cells)[:200]
        raise InvalidSpec([Violation(pointer, found, f"line {header.line}: {message}", ", ".join(TRACE_COLUMNS))])
    places = {name: names.index(name) for name in TRACE_COLUMNS}
    numbers, errors = _table(rows, places)
    errors = [*_unknown(header.line, {name: units[place] for name, place in places.items()}), *errors]
    if not errors:
        table = np.array(numbers).reshape(-1, len(places)) / [_SHARES[units[place]] for place in places.values()]
        errors = list(_nonsense(table))
    if errors:
        raise InvalidSpec([Violation(pointer, None, message) for message in errors[:MOST_ERRORS]])
    return Trace(frozen(table[:, 0]), frozen(table[:, 1:4]), frozen(table[:, 4:]))


def _named(heading: str) -> tuple[str, str]:
    """Return the name and the unit of a column: `x [mm]`, `x (mm)` or `x`."""
    name, _, unit = heading.replace("(", "[").partition("[")
    return name.strip(), unit.strip(" ])")


def _unknown(line: int, units: Mapping[str, str]) -> Iterator[str]:
    for name, unit in units.items():
        if unit not in (permitted := _UNITS[name]):
            known = ", ".join(filter(None, permitted))
            yield f"line {line}, {name}: the unit {unit!r} is not known; permitted: {known}"


def _table(rows: Iterable[CsvRow], places: Mapping[str, int]) -> tuple[list[list[float]], list[str]]:
    """Return the numbers of all poses, and what is wrong; nothing is read after `MOST_ERRORS`.

    Rows are those below the header, places those of `TRACE_COLUMNS`.
    """
    numbers, errors = list[list[float]](), list[str]()
    for line, cells, error in rows:
        found = [finite(cells[place]) if place < len(cells) else None for place in places.values()]
        known = [number for number in found if number is not None]
        if error:
            errors.append(f"line {line}: {error}")
        elif len(known) == len(found):
            numbers.append(known)
        else:
            wrong = (name for name, number in zip(places, found, strict=True) if number is None)
            shown = ((name, "".join(cells[places[name] : places[name] + 1])[:50]) for name in wrong)
            errors += [f"line {line}, {name}: {cell!r} is not a finite number" for name, cell in shown]
        if len(errors) >= MOST_ERRORS:
            break
    return numbers, errors


def _nonsense(table: FloatArray) -> Iterator[str]:
    """Yield what is wrong with poses `(k, 8)`: too few, times that do not ascend, quaternions whose norm is not 1."""
    if len(table) < 2:
        yield f"the trace has {len(table)} poses; at least 2 are needed"
        return
    backwards = np.nonzero(np.diff(table[:, 0]) <= 0)[0]
    for place in backwards[:3]:
        before, after = table[place : place + 2, 0].tolist()
        yield f"pose {place + 2}: time_s must ascend, and {after} follows {before}"
    duration = table[-1, 0] - table[0, 0]
    if duration > LONGEST_S:
        yield f"the trace lasts {duration:g} s; at most {LONGEST_S:g} s are permitted"
    sizes = np.linalg.norm(table[:, 4:], axis=1)
    for place in np.nonzero(np.abs(sizes - 1.0) > 0.01)[0][:3]:
        yield f"pose {place + 1}: qx, qy, qz, qw have norm {sizes[place]:.3g}; permitted: 1, as of a rotation"


def unlikely(trace: Trace, expected: Trace, alignment: Alignment) -> Iterator[str]:
    """Yield what is unlikely about a trace, each as a clause.

    The expected motion, of a simulator, is nan if its physics failed.
    """
    inside = (trace.times_s >= alignment.lag_s) & (trace.times_s <= alignment.lag_s + expected.times_s[-1])
    yield from _holes(trace.times_s[inside], np.hstack([trace.positions_m, trace.orientations])[inside])
    if not np.all(np.isfinite(expected.positions_m)):
        return
    yield from _jump(trace.times_s[inside], trace.positions_m[inside], expected)
    seen = trace.at(np.clip(alignment.lag_s + expected.times_s, trace.times_s[0], trace.times_s[-1]))
    yield from _start(seen.positions_m[0, 2], expected.positions_m[0, 2], seen.orientations, expected.orientations)
    far, wanted = (
        float(np.linalg.norm(positions_m[:, :2] - positions_m[0, :2], axis=1).max())
        for positions_m in (seen.positions_m, expected.positions_m)
    )
    if far > FARTHER * wanted + FARTHER_M:
        yield f"the base moves {far:.2g} m, and the simulators expect {wanted:.2g} m"
    if alignment.match is None or alignment.match >= (WEAKEST if alignment.after_rest else WEAK):
        return
    why = "" if alignment.after_rest else " and the recording does not begin at rest"
    yield f"the match with the expected motion is {alignment.match:.2f}{why}: state when it began, or look at the plot"


def _holes(times_s: FloatArray, poses: FloatArray) -> Iterator[str]:
    """Yield sentences: where poses are missing or stay the same for too long, or that the base never moves."""
    if len(times_s) < 2:
        return
    steps = np.diff(times_s)
    at = int(np.argmax(steps))
    if steps[at] > max(LONGEST_GAP_S, 4.0 * float(np.median(steps))):
        yield f"there is no pose from {times_s[at]:.10g} to {times_s[at + 1]:.10g} s"
    changes = np.flatnonzero(np.any(np.diff(poses, axis=0) != 0.0, axis=1))
    if not changes.size:
        yield "the base does not move"
        return
    begins, ends = times_s[changes[:-1] + 1], times_s[changes[1:]]
    still = ends - begins
    if still.size and still.max() > 2 * LONGEST_GAP_S:
        yield f"the pose stays the same from {begins[int(np.argmax(still))]:.10g} s for {still.max():.2g} s"


def _jump(times_s: FloatArray, positions_m: FloatArray, expected: Trace) -> Iterator[str]:
    """Yield the largest step that the base cannot make between two poses."""
    (steps, durations), (wanted, times) = (
        (np.linalg.norm(np.diff(places, axis=0), axis=1), np.diff(at))
        for places, at in ((positions_m, times_s), (expected.positions_m, expected.times_s))
    )
    excess = steps - HIGHER_M - FARTHER * (wanted / times).max() * durations
    if excess.max(initial=0.0) > 0:
        at = int(np.argmax(excess))
        yield f"the base jumps by {steps[at]:.2g} m at {times_s[at + 1]:.10g} s"


def _start(height_m: float, wanted_m: float, seen: FloatArray, wanted: FloatArray) -> Iterator[str]:
    if abs(height_m - wanted_m) > max(HIGHER_M, 0.5 * abs(wanted_m)):
        is_mm = 300.0 * wanted_m < height_m < 3000.0 * wanted_m
        what = "are these millimetres (`x [mm]`)?" if is_mm else "is z upwards, in metres, from the ground?"
        yield f"the base begins {height_m:.3g} m high, and the simulators expect {wanted_m:.2g} m: {what}"
    tilts = [scipy.spatial.transform.Rotation.from_quat(each[0]).apply([0.0, 0.0, 1.0]) for each in (seen, wanted)]
    angle = float(np.arccos(np.clip(tilts[0] @ tilts[1], -1.0, 1.0)))
    if angle > TILTED_RAD:
        what = "is z upwards, and is qw the last of the quaternion?"
        yield f"the base begins tilted by {np.degrees(angle):.0f}° from what the simulators expect: {what}"
