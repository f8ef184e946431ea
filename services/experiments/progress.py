"""The progress of experiments: work done, work left, and what their state alone does not say."""

from collections.abc import Mapping, Sequence
from math import floor, fsum

from gaplab.schemas.lifecycle import State
from gaplab.schemas.records import Progress
from gaplab.services.experiments.time_left import Span, busy_s, estimate_s, interval
from gaplab.services.store.queries.progress import Tally

_COMPUTED = frozenset({"seconds_left", "time_left"})


def progress_of(tally: Tally, spans: Sequence[Span] = ()) -> Progress:
    """Return the progress of an experiment or a study.

    Args:
        tally: sums over its repetitions.
        spans: times of the work on its repetitions; none unless it is running.
    """
    sums = {name: getattr(tally, name) for name in Progress.model_fields if name not in _COMPUTED}
    finished, left, busy = tally.rollouts_done + tally.rollouts_saved, tally.rollouts_left, busy_s(spans)
    seconds_left = estimate_s(finished, left, busy) if tally.open else 0.0
    return Progress(**sums, seconds_left=seconds_left, time_left=interval(finished, left, busy) if tally.open else None)


def caveat_of(state: State, tally: Tally) -> str | None:
    """Return what the state of an experiment does not say: it was stopped early, or repetitions failed."""
    failed = tally.failed if state is not State.FAILED else 0
    parts = [f"{failed} of {_many(tally.repetitions, 'repetition')} failed"] if failed else []
    if state is State.COMPLETED and tally.stopped:
        parts.append(f"stopped early, {_done(tally)}")
    return "; ".join(parts) or None


def study_caveat_of(state: State, members: Mapping[State, int], stopped: int, tally: Tally) -> str | None:
    """Return what the state of a study does not say about its experiments.

    Args:
        state: state of the study.
        members: number of its experiments by state.
        stopped: number of COMPLETED experiments that were stopped early.
        tally: sums over all repetitions.
    """
    counts = {each.lower(): members.get(each, 0) for each in (State.FAILED, State.CANCELLED) if each is not state}
    counts["stopped early"] = stopped if state.ended else 0
    parts = [f"{count} {what}" for what, count in counts.items() if count]
    if not parts:
        return None
    (first, *others), total = parts, _many(sum(members.values()), "experiment")
    count, what = first.split(" ", 1)
    told = ", ".join([f"{count} of {total} {what}", *others])
    return f"{told}; {_done(tally)}" if state.ended else told


def mean_best(values: Sequence[float]) -> float:
    """Return the exact mean of the best fitness of repetitions: independent of their order, and without overflow."""
    try:
        return fsum(values) / len(values)
    except OverflowError:
        return fsum(value / len(values) for value in values)


def _done(tally: Tally) -> str:
    finished = tally.rollouts_done + tally.rollouts_saved
    return f"{floor(100 * min(1.0, finished / tally.rollouts)) if tally.rollouts else 0} % done"


def _many(count: int, what: str) -> str:
    return f"{count} {what}" if count == 1 else f"{count} {what}s"
