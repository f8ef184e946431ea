"""What is unlikely about a recorded motion, beside the motion that a simulator expects.

Source: gaplab.
"""

from collections.abc import Iterator

import numpy as np
import scipy

from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.traces import Alignment, Trace

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


def unlikely(trace: Trace, expected: Trace, alignment: Alignment) -> Iterator[str]:
    """Yield what is unlikely about a trace, each as a clause.

    Args:
        trace: as recorded.
        expected: what a simulator expects; nan if its physics failed.
        alignment: when the motion began.
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
    """Yield the longest time without a pose, and the longest with one pose."""
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
