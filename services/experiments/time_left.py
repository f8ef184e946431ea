"""The time left of an experiment or a study, from its pace over the whole time in which it was worked on.

All work since the start has the same weight, so the interval settles. The pace of one moment would not: it doubles
whenever one of two repetitions starts.
"""

from collections.abc import Sequence
from datetime import datetime

from gaplab.schemas.records import TimeLeft

KNOWN_AFTER_S = 10.0
"""Shortest time of work over which a pace is measured."""

KNOWN_FROM = 0.1
"""Smallest share of the work over which a pace is measured, before `SETTLED_AFTER_S`."""

SETTLED_AFTER_S = 120.0
"""Time of work over which a pace is measured whatever its share: processes that start have no weight any more."""

LEAST_SPREAD, MOST_SPREAD = 0.25, 2.0
"""Relative half-width of the interval for much finished work, and up to `KNOWN_FROM`: processes that start make the
first steps slow, and iterations cost more than the first transfer."""

Span = tuple[datetime, datetime]
"""Begin and end of the work of an attempt."""


def busy_s(spans: Sequence[Span]) -> float:
    """Return the seconds in which there was work on at least one repetition: pauses and waiting do not count."""
    total, until = 0.0, None
    for begin, end in sorted(spans):
        start = begin if until is None else max(begin, until)
        total += max(0.0, (end - start).total_seconds())
        until = end if until is None else max(until, end)
    return total


def estimate_s(finished: int, left: int, busy: float) -> float | None:
    """Return the estimate of the seconds left; None until enough is measured.

    Args:
        finished: rollouts that were simulated or saved.
        left: rollouts that remain.
        busy: seconds of work so far.
    """
    if busy < KNOWN_AFTER_S or not finished:
        return None
    if busy < SETTLED_AFTER_S and finished < KNOWN_FROM * (finished + left):
        return None
    return left * busy / finished


def interval(finished: int, left: int, busy: float) -> TimeLeft | None:
    """Return the interval of the seconds left, wide at first; None until enough is measured, and without work left.

    The arguments are those of `estimate_s`.
    """
    seconds = estimate_s(finished, left, busy)
    if seconds is None or not left:
        return None
    little = min(1.0, KNOWN_FROM * (finished + left) / finished)
    spread = 1 + LEAST_SPREAD + (MOST_SPREAD - LEAST_SPREAD) * little
    return TimeLeft(low_s=seconds / spread, high_s=seconds * spread)
