"""The progress of experiments: work done, work left, what their state alone does not say, and the time left.

The time left follows from the pace over the whole time of work. All work since the start has the same weight, so the
interval settles. The pace of one moment would not: it doubles whenever one of two repetitions starts.
"""

from collections.abc import Mapping, Sequence
from datetime import datetime
from math import ceil, floor, fsum

from gaplab.schemas.lifecycle import State
from gaplab.schemas.records import Progress, TimeLeft
from gaplab.services.findings.wording import many
from gaplab.services.store.queries.progress import Tally

KNOWN_AFTER_S = 10.0
"""Shortest time of work over which a pace is measured."""

KNOWN_FROM = 0.1
"""Smallest share of the work over which a pace is measured, before `SETTLED_AFTER_S`."""

SETTLED_AFTER_S = 120.0
"""Time of work over which a pace is measured whatever its share: processes that start have no weight any more."""

LEAST_SPREAD, MOST_SPREAD = 0.25, 2.0
"""Relative half-width of the interval for much finished work, and up to `KNOWN_FROM`: processes that start make the
first steps slow, and iterations cost more than the first transfer."""

MOST_STEPS = 5
"""Steps under way that are told."""


def busy_s(spans: Sequence[tuple[datetime, datetime]]) -> float:
    """Return the seconds in which there was work on at least one repetition: pauses and waiting do not count."""
    total, until = 0.0, None
    for begin, end in sorted(spans):
        start = begin if until is None else max(begin, until)
        total += max(0.0, (end - start).total_seconds())
        until = end if until is None else max(until, end)
    return total


def interval(finished: int, left: int, busy: float) -> TimeLeft | None:
    """Return the interval of the time left, wide at first; None until enough is measured, and without work left.

    Args:
        finished: rollouts that were simulated or saved.
        left: rollouts that remain.
        busy: seconds of work so far.
    """
    if busy < KNOWN_AFTER_S or not finished or left <= 0:
        return None
    if busy < SETTLED_AFTER_S and finished < KNOWN_FROM * (finished + left):
        return None
    little = min(1.0, KNOWN_FROM * (finished + left) / finished)
    seconds, spread = left * busy / finished, 1 + LEAST_SPREAD + (MOST_SPREAD - LEAST_SPREAD) * little
    low_s, high_s = seconds / spread, seconds * spread
    return TimeLeft(low_s=low_s, high_s=high_s, text=span(low_s, high_s))


def span(low_s: float, high_s: float) -> str:
    """Return an interval in minutes, or in hours if it is long."""
    unit, name = (3600, "h") if high_s > 3 * 3600 else (60, "min")
    low, high = floor(low_s / unit), ceil(high_s / unit)
    return f"{low} to {high} {name}" if low else f"less than {high} {name}"


def progress_of(tally: Tally) -> Progress:
    """Return the progress of an experiment or a study, with the time left if it has times of its work."""
    time_left = interval(tally.rollouts_done + tally.rollouts_saved, tally.rollouts_left, busy_s(tally.spans))
    return Progress.filled_from(tally, share=_share(tally), text=_text(tally), time_left=time_left)


def caveat_of(state: State, tally: Tally) -> str | None:
    """Return what the state of an experiment does not say: it was stopped early, or repetitions failed."""
    failed = tally.failed if state is not State.FAILED else 0
    parts = [f"{failed} of {many(tally.repetitions, 'repetition')} failed"] if failed else []
    if state is State.COMPLETED and tally.stopped:
        parts.append(f"stopped early, {_done(tally)}")
    return "; ".join(parts) or None


def caveat_of_several(state: State, members: Mapping[State, int], stopped: int, tally: Tally) -> str | None:
    """Return what the state of a study does not say about its experiments; `stopped` were COMPLETED early."""
    counts = {each.lower(): members.get(each, 0) for each in (State.FAILED, State.CANCELLED) if each is not state}
    counts["stopped early"] = stopped if state.ended else 0
    parts = [f"{count} {what}" for what, count in counts.items() if count]
    if not parts:
        return None
    (first, *others), total = parts, many(sum(members.values()), "experiment")
    count, what = first.split(" ", 1)
    told = ", ".join([f"{count} of {total} {what}", *others])
    return f"{told}; {_done(tally)}" if state.ended else told


def mean_best(values: Sequence[float]) -> float:
    """Return the exact mean of the best fitness of repetitions: independent of their order, and without overflow."""
    try:
        return fsum(values) / len(values)
    except OverflowError:
        return fsum(value / len(values) for value in values)


def _share(tally: Tally) -> float:
    """Return the finished share of the rollouts, because they take nearly all of the time; a saved one is finished."""
    return min(1.0, (tally.rollouts_done + tally.rollouts_saved) / tally.rollouts) if tally.rollouts else 0.0


def _text(tally: Tally) -> str:
    """Return the completed work, and some of the steps under way."""
    failed = f", {tally.failed} failed" if tally.failed else ""
    saved = f", {tally.rollouts_saved:,} saved" if tally.rollouts_saved else ""
    physics = f", physics failed in {tally.rollouts_failed:,}" if tally.rollouts_failed else ""
    iterations = f"{tally.counted_iterations_done:,} of {tally.counted_iterations:,} iterations"
    now = [f"{each.kind} {each.iteration}: {100 * each.rollouts // each.budget} %" for each in tally.steps]
    parts = [
        f"{tally.completed:,} of {many(tally.repetitions, 'repetition')}{failed}",
        *([iterations] if tally.counted_iterations else []),
        f"{tally.rollouts_done:,} of {tally.rollouts:,} rollouts{saved}{physics}",
        *now[:MOST_STEPS],
        *(["…"] if len(now) > MOST_STEPS else []),
    ]
    return "; ".join(parts)


def _done(tally: Tally) -> str:
    return f"{floor(100 * _share(tally))} % done"
