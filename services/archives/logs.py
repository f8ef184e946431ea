"""Checks of imported repetitions, once they are stored: whether each has a whole log."""

from collections.abc import Iterable

from gaplab.services.core.errors import InvalidArchive
from gaplab.services.core.types import Probed
from gaplab.services.store.models import RepetitionRow
from gaplab.services.store.queries import attempts, experiments, logs
from gaplab.services.store.queries.step_rows import position
from gaplab.services.store.session import Session


def check_logs(session: Session, ids: Iterable[str]) -> None:
    """Refuse experiments with missing repetitions, and repetitions whose rows contradict their counts.

    Raises:
        InvalidArchive: the message names the first of them.
    """
    for experiment in experiments.get_experiments(session, list(ids)):
        rows, expected = experiments.repetitions_of(session, experiment.id), experiment.spec["repetitions"]
        if [row.number for row in rows] != list(range(expected)):
            raise InvalidArchive(f"experiment {experiment.id!r} has {len(rows)} of its {expected} repetitions")
        latest = attempts.latest(session, experiment.id)
        for row in rows:
            if not _is_whole(session, row):
                msg = f"the rows of repetition {row.number} of {experiment.id!r} are not a log of {row.steps} steps"
                raise InvalidArchive(msg)
            if latest.get(row.id, 0) > row.epoch:
                raise InvalidArchive(f"repetition {row.number} of {experiment.id!r} has more attempts than leases")


def _is_whole(session: Session, row: RepetitionRow) -> bool:
    """Return whether the log has all steps and iterations that the repetition counts, in order."""
    try:
        (log,) = logs.logs(session, [row.id]).values()
    except (ValueError, TypeError, AssertionError):  # steps check themselves
        return False
    done = sum(isinstance(step, Probed) for step in log)
    return done == row.iterations_done and [position(step) for step in log] == list(range(row.steps))
