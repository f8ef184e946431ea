"""The progress of experiments: work done, work left, and the best fitness so far."""

from collections.abc import Sequence
from math import fsum

from gaplab.schemas.records import Progress
from gaplab.services.store.queries.progress import Tally


def progress_of(tally: Tally) -> Progress:
    """Return the progress of an experiment or a study."""
    sums = {name: getattr(tally, name) for name in Progress.model_fields if name != "seconds_left"}
    return Progress(**sums, seconds_left=_seconds_left(tally))


def mean_best(values: Sequence[float]) -> float:
    """Return the exact mean of the best fitness of repetitions: independent of their order, and without overflow."""
    try:
        return fsum(values) / len(values)
    except OverflowError:
        return fsum(value / len(values) for value in values)


def _seconds_left(tally: Tally) -> float | None:
    """Return the time left if running repetitions continue at their present pace; None if unknown."""
    if not tally.open:
        return 0.0
    finished = tally.rollouts_done + tally.rollouts_saved
    if not (tally.running and finished and tally.seconds):
        return None
    return tally.rollouts_left * tally.seconds / finished / tally.running
