"""Traces: the recorded motion of a physical robot, from which the robot's code computes fitness and readings.

A trace has a line for each moment, with the pose of the base, the angles of the joints, or both.

A trace has its own clock and its own place on the ground. A recording that begins at rest shows when the motion
begins; around that moment, else anywhere, the clock is aligned by cross-correlation with the motion that a simulator
expects. The place is aligned by the pose at the start of the motion. Heights are above the ground, and z points up.

Source: gaplab.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy
from numpy.typing import NDArray

from gaplab.services.core.arrays import FloatArray, frozen
from gaplab.services.world.kinematics import from_start, observed_poses
from gaplab.services.world.logs import TICKS, Trace
from gaplab.services.world.motions import Loop, Motion, Trajectory, commands_at
from gaplab.services.world.world import Joint, World

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

LONGEST_GAP_S = 0.25
"""Longest time without a pose, or with the same one, that is not remarked on; gaps also exceed four usual distances."""

FARTHER, FARTHER_M = 5.0, 0.5
"""How many times as far as expected a base moves, and how much farther, from which it is remarked on."""

HIGHER_M = 0.1
"""Difference from the expected height at the start, as a share of it too if that is more, that is remarked on."""

TILTED_RAD = 0.5
"""Difference from the expected tilt at the start that is remarked on."""

BEYOND = 0.05
"""How far beyond its limits a joint may be, as a share of their distance: files and calibrations differ."""

AGAINST, SCALED, AWAY_RAD = 0.5, 8.0, 0.5
"""Correlation with the commands, either way, from which a sign is judged; and then the ratio of their deviations, and
the mean difference, that are remarked on: springs and loads explain less."""

WEAK, WEAKEST = 0.8, 0.1
"""Match below which a start is uncertain: where it was found by correlation alone, and after rest."""


@dataclass(frozen=True)
class Alignment:
    """When a motion began on the clock of a trace.

    Attributes:
        lag_s: time on that clock.
        match: correlation with the expected motion, at most 1; None if nothing was correlated.
        after_rest: whether the trace begins at rest, so that its start is where the base or a joint begins to move.
    """

    lag_s: float
    match: float | None = None
    after_rest: bool = False


class TooShort(ValueError):
    """A trace does not contain the whole motion."""


def align(trace: Trace, expected: Trace, lag_s: float | None = None, motion: Motion | Loop | None = None) -> Alignment:
    """Return when the motion began on the clock of a trace, which must contain the whole motion.

    Args:
        trace: as recorded.
        expected: what a simulator expects, from the start of the motion to its last observation; nan if its physics
            failed.
        lag_s: the lag if it is known; None: it is found. If the expected motion does not change, the trace begins with
            the motion.
        motion: that of the robot; if the trace has commands that change, they alone show when it began.

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
    scores, by_commands = _scores(trace, expected, motion)
    if scores is None:
        return Alignment(float(first))
    near, begun = np.ones(len(scores), dtype=bool), None if by_commands else _onset(trace)
    if begun is not None and (expected_to := _onset(expected, at_once=True)) is not None:
        away = np.abs(first + np.arange(len(scores)) * STEP_S - (begun - expected_to))
        near = away <= max(AROUND_S, float(away.min()))
    best = int(np.argmax(np.where(near, scores, -np.inf)))
    lag_s = float(min(first + best * STEP_S, max(first, latest)))
    return Alignment(lag_s, float(min(scores[best], 1.0)), after_rest=not near.all())


def _scores(trace: Trace, expected: Trace, motion: Motion | Loop | None) -> tuple[FloatArray | None, bool]:
    """Return how well each shift `(shifts,)` fits, None if nothing changes, and whether that is of the commands."""
    first, last = trace.times_s[0], trace.times_s[-1]
    count = int((last - first) / STEP_S + 1e-6) + 1
    length = min(count, int(float(expected.times_s[-1]) / STEP_S + 1e-6) + 1)
    times_s, elapsed_s = frozen(first + np.arange(count) * STEP_S), frozen(np.arange(length) * STEP_S)
    sent, logged = None if motion is None else commands_at(motion, elapsed_s), trace.at(times_s).commands
    if sent is not None and logged is not None and (found := _correlations(logged.T, sent.T)) is not None:
        return found, True
    return _correlations(_features(trace, times_s, expected), _features(expected, elapsed_s, trace)), False


def _onset(trace: Trace, *, at_once: bool = False) -> float | None:
    """Return when a robot begins to move, on the clock of its trace; None if it does not, or not after rest.

    There is no rest if the motion begins `at_once`, with the trace.
    """
    resting = trace.times_s <= trace.times_s[0] + (0.0 if at_once else REST_S)
    moved = np.zeros(len(trace.times_s), dtype=bool)
    if trace.positions_m is not None and trace.orientations is not None:
        away_m = np.linalg.norm(trace.positions_m - trace.positions_m[resting].mean(axis=0), axis=1)
        cosine = np.abs(trace.orientations @ trace.orientations[0])
        away_rad = 2.0 * np.arccos(np.clip(cosine, 0.0, 1.0))
        moved = (away_m > MOVED_M) | (away_rad > MOVED_RAD)
    if trace.angles_rad is not None:
        moved |= np.any(np.abs(trace.angles_rad - trace.angles_rad[resting].mean(axis=0)) > MOVED_RAD, axis=1)
    if np.any(moved[resting]) or not np.any(moved):
        return None
    return float(trace.times_s[int(np.argmax(moved))])


def placed(
    trace: Trace, lag_s: float, times_s: FloatArray, world: World, motion: Motion | Loop | None = None
) -> Trajectory:
    """Return a trace at times `(t,)` of the motion, which began at the lag, as in a simulation of it.

    There a motion begins above the origin, with the base turned as `world.start_turn`; only a turn about z is removed.
    What the trace does not say is nan.
    """
    seen = trace.at(times_s + lag_s)
    if world.fixed:
        poses = np.tile([0.0, 0.0, world.start_height_m, *world.start_turn], (len(times_s), 1))
    elif trace.positions_m is None:
        poses = np.full((len(times_s), 7), np.nan)
    else:
        poses = _level(trace, lag_s, seen, world)
    angles = np.full((len(times_s), len(world.joints)), np.nan) if seen.angles_rad is None else seen.angles_rad
    poses = observed_poses(world, poses, angles)
    commands = None if motion is None else commands_at(motion, times_s)
    return replace(seen, times_s=times_s, positions_m=poses[:, :3], orientations=poses[:, 3:], commands=commands)


def _level(trace: Trace, lag_s: float, seen: Trajectory, world: World) -> FloatArray:
    """Return the poses `(t, 7)` of a base as if its motion had begun above the origin, in the heading of the start."""
    start = trace.at(frozen([lag_s]))
    rotation = scipy.spatial.transform.Rotation
    heading = rotation.from_quat(from_start(world, start.orientations)[0]).apply([1.0, 0.0, 0.0])
    back = rotation.from_rotvec([0.0, 0.0, -np.arctan2(heading[1], heading[0])])
    moved = seen.positions_m - start.positions_m[0] * [1.0, 1.0, 0.0]
    turned = (back * rotation.from_quat(seen.orientations)).as_quat()
    return np.hstack([back.apply(moved), turned])


def _features(trace: Trace, times_s: FloatArray, other: Trace) -> FloatArray:
    """Return features `(f, t)` that both traces have, and that depend on no place and no heading.

    They are speed over ground, vertical speed and tilt of the base, and the angles of the joints.
    """
    seen = trace.at(times_s)
    angles = None if other.angles_rad is None else seen.angles_rad
    joints = np.empty((0, len(times_s))) if angles is None else angles.T
    if trace.positions_m is None or other.positions_m is None or not np.all(np.isfinite(trace.positions_m)):
        return np.vstack([np.zeros((3, len(times_s))), joints])
    speeds = np.gradient(seen.positions_m, axis=0) if len(times_s) > 1 else np.zeros_like(seen.positions_m)
    x, y = seen.orientations[:, 0], seen.orientations[:, 1]
    tilts = np.arccos(np.clip(1.0 - 2.0 * (x**2 + y**2), -1.0, 1.0))
    return np.vstack([np.linalg.norm(speeds[:, :2], axis=1), speeds[:, 2], tilts, joints])


def _correlations(moving: FloatArray, template: FloatArray) -> FloatArray | None:
    """Return the mean Pearson correlation of features at each shift, `(shifts,)`; None if no feature changes."""
    found, length = [], template.shape[1]
    for recorded, wanted in zip(moving, template, strict=True):
        if not (wanted.std() >= LEAST_CHANGE and recorded.std() >= LEAST_CHANGE):  # or nan: no column says it
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


def unlikely(
    trace: Trace, expected: Trace, alignment: Alignment, world: World, commands: FloatArray | None = None
) -> Iterator[str]:
    """Yield what is unlikely about a trace, each as a clause.

    The expected motion, of a simulator, is nan if its physics failed. Commands `(k, a)` are those of the motion at the
    trace's times, by default the trace's own; they count during the motion alone.
    """
    begin_s, end_s = alignment.lag_s, alignment.lag_s + expected.times_s[-1]
    inside = (trace.times_s >= begin_s) & (trace.times_s <= end_s)
    parts = [each for each in (trace.positions_m, trace.orientations, trace.angles_rad) if each is not None]
    yield from _gap(trace.times_s, begin_s, end_s)
    yield from _still(trace.times_s[inside], np.hstack(parts)[inside])
    sent = trace.commands if commands is None else commands
    yield from unlikely_joints(trace, world, None if sent is None else np.where(inside[:, None], sent, np.nan))
    if expected.positions_m is None or not np.all(np.isfinite(expected.positions_m)):
        return
    if trace.positions_m is not None:
        yield from _unlike(trace, expected.at(expected.times_s), alignment.lag_s, trace.positions_m, inside)
    if alignment.match is None or alignment.match >= (WEAKEST if alignment.after_rest else WEAK):
        return
    why = "" if alignment.after_rest else " and the recording does not begin at rest"
    yield f"the match with the expected motion is {alignment.match:.2f}{why}: state when it began"


def _unlike(
    trace: Trace, wanted: Trajectory, lag_s: float, positions_m: FloatArray, inside: NDArray[np.bool_]
) -> Iterator[str]:
    """Yield how the motion of a base differs from the expected one more than a wrong simulator explains."""
    yield from _jump(trace.times_s[inside], positions_m[inside], wanted)
    seen = trace.at(lag_s + wanted.times_s)
    yield from _start(seen.positions_m[0, 2], wanted.positions_m[0, 2], seen.orientations, wanted.orientations)
    far, expected = (
        float(np.linalg.norm(places_m[:, :2] - places_m[0, :2], axis=1).max())
        for places_m in (seen.positions_m, wanted.positions_m)
    )
    if far > FARTHER * expected + FARTHER_M:
        yield f"the base moves {far:.2g} m, and the simulators expect {expected:.2g} m"


def unlikely_joints(trace: Trace, world: World, commands: FloatArray | None = None) -> Iterator[str]:
    """Yield which joints move as they cannot, or against their commands, with the column and the likely mistake.

    Commands `(k, a)`, at the trace's times, are by default its own; nan where they do not count.
    """
    if trace.angles_rad is None:
        return
    commands, targets = trace.commands if commands is None else commands, {}
    if commands is not None:
        pairs = zip(world.actuators, commands.T, strict=True)
        targets = {joint.name: column for joint, column in pairs if np.any(np.isfinite(column))}
    for joint, angles in zip(world.joints, trace.angles_rad.T, strict=True):
        told = targets.get(joint.name) if joint.follows == "position" else None
        if not (wrong := _wrong(joint, angles, told, trace.lines)):
            continue
        ways: dict[str, Callable[[FloatArray], FloatArray]] = {"-": np.negative, "ticks @ 2048": _of_ticks}
        if joint.limits is None or np.nanmax(np.abs(angles)) > joint.limits[1] - joint.limits[0]:
            ways = {"deg": np.deg2rad, "-deg": lambda values: -np.deg2rad(values), **ways}
        likely = (f"is it `[{how}]`?" for how, way in ways.items() if _explains(way, joint, angles, told))
        column = (trace.headings or {}).get(f"angle {joint.name}", f"angle {joint.name}")
        advice = next(likely, "say `[@ ZERO]`, what it reads where the joint is at zero, or map another column")
        yield f"the column {column!r}{wrong}; {advice}"


def _of_ticks(values: FloatArray) -> FloatArray:
    return (values - TICKS / 2) * 2 * np.pi / TICKS


def _explains(
    way: Callable[[FloatArray], FloatArray], joint: Joint, angles: FloatArray, targets: FloatArray | None
) -> bool:
    """Return whether a joint can have had angles that are read this way, as targets beyond its limits are too."""
    beyond = targets is not None and joint.limits and np.nanmax(np.abs(targets)) > joint.limits[1] - joint.limits[0]
    return not _wrong(joint, way(angles), way(targets) if targets is not None and beyond else targets)


def _wrong(joint: Joint, angles: FloatArray, targets: FloatArray | None, lines: Sequence[int] = ()) -> str:
    """Return why a joint cannot have had these angles; "" if it can. Targets are None if they are not angles."""
    low, high = joint.limits or (-np.inf, np.inf)
    slack = BEYOND * (high - low) if joint.limits else 0.0
    beyond = np.flatnonzero((angles < low - slack) | (angles > high + slack))
    if beyond.size:
        where = f", line {lines[beyond[0]]}" if len(lines) else ""
        return f"{where}: {angles[beyond[0]]:.4g} is outside the limits of {joint.name}, {low:.4g} to {high:.4g}"
    there = np.isfinite(angles) & np.isfinite(angles if targets is None else targets)
    if targets is None or not there.any() or targets[there].std() < MOVED_RAD or angles[there].std() < LEAST_CHANGE:
        return ""
    seen, told = angles[there], targets[there]
    match, scale, away = np.corrcoef(seen, told)[0, 1], seen.std() / told.std(), (seen - told).mean()
    if match < -AGAINST:
        return f" goes against the commands of {joint.name} (correlation {match:.2f})"
    if match > AGAINST and not 1 / SCALED < scale < SCALED:
        return f" moves {scale:.2g} times as far as the commands of {joint.name}"
    if match > AGAINST and abs(away) > AWAY_RAD:
        return f" is {away:.2g} from the commands of {joint.name} on average"
    return ""


def _gap(times_s: FloatArray, begin_s: float, end_s: float) -> Iterator[str]:
    """Yield where rows are missing for too long of a motion, which may begin or end in the gap."""
    steps = np.diff(np.clip(times_s, begin_s, end_s))
    at = int(np.argmax(steps))
    if steps[at] > max(LONGEST_GAP_S, 4.0 * float(np.median(np.diff(times_s)))):
        yield f"there is no row from {times_s[at]:.10g} to {times_s[at + 1]:.10g} s"


def _still(times_s: FloatArray, poses: FloatArray) -> Iterator[str]:
    """Yield where rows stay the same for too long, or that nothing ever moves; what is nan says neither."""
    if len(times_s) < 2:
        return
    changes = np.flatnonzero(np.any(np.abs(np.diff(poses, axis=0)) > 0.0, axis=1))
    if not changes.size:
        yield "nothing moves"
        return
    begins, ends = times_s[changes[:-1] + 1], times_s[changes[1:]]
    still = ends - begins
    if still.size and still.max() > 2 * LONGEST_GAP_S:
        yield f"everything stays the same from {begins[int(np.argmax(still))]:.10g} s for {still.max():.2g} s"


def _jump(times_s: FloatArray, positions_m: FloatArray, expected: Trajectory) -> Iterator[str]:
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
