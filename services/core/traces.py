"""Traces: the recorded motion of a physical robot's base, from which the robot's code computes fitness and readings.

A trace has its own clock and its own place on the ground. A recording that begins at rest shows when the motion
begins; around that moment, else anywhere, the clock is aligned by cross-correlation with the motion that a simulator
expects. The place is aligned by the pose at the start of the motion. Heights are above the ground, and z points up.

Source: gaplab.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy

from gaplab.services.core.arrays import FloatArray, frozen
from gaplab.services.core.kinematics import from_start
from gaplab.services.core.motions import Trajectory
from gaplab.services.core.world import World

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

    Args:
        trace: of the base.
        at_once: whether the motion begins with the trace, so that there is no rest.
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
    """Return the poses of a trace at times `(t,)` of the motion, placed and turned as in a simulation.

    There a motion begins above the origin, with the base turned as `world.start_turn`; only a turn about z is removed.

    Args:
        trace: as recorded.
        lag_s: when the motion began.
        times_s: seconds since then.
        world: the robot's.
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
