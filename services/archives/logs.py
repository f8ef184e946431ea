"""What an archive brought of repetitions, once it is stored: whether somebody could go on with it."""

from collections.abc import Sequence

from gaplab.services.core.errors import InvalidArchive
from gaplab.services.store.models import RepetitionRow
from gaplab.services.store.queries import attempts, experiments, logs
from gaplab.services.store.session import Session


def check_logs(session: Session, ids: Sequence[str]) -> None:
    """Refuse experiments that lack repetitions, and repetitions whose rows do not tell of what they count.

    Raises:
        InvalidArchive: with the first.
    """
    for experiment in ids:
        rows, spec = (
            experiments.repetitions_of(session, experiment),
            experiments.get_experiment(session, experiment).spec,
        )
        if [row.number for row in rows] != list(range(spec["repetitions"])):
            msg = f"experiment {experiment!r} has {len(rows)} of its {spec['repetitions']} repetitions"
            raise InvalidArchive(msg)
        latest = attempts.latest(session, experiment)
        for row in rows:
            if not _is_log(session, row):
                msg = f"repetition {row.number} of {experiment!r} has rows that are no log of {row.steps} steps"
                raise InvalidArchive(msg)
            if latest.get(row.id, 0) > row.epoch:
                msg = f"repetition {row.number} of {experiment!r} has had more attempts than leases"
                raise InvalidArchive(msg)


def _is_log(session: Session, row: RepetitionRow) -> bool:
    try:
        return logs.is_whole(session, row)
    except (ValueError, TypeError, AssertionError):  # the steps check themselves
        return False
