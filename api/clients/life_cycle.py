"""Requests that change the state or the size of experiments and studies."""

from gaplab.api.clients.connection import CONFIRMED, Connection, segment
from gaplab.api.clients.records import Records
from gaplab.schemas.lifecycle import Verb
from gaplab.schemas.records import ExperimentRead, StudyRead


class LifeCycle:
    """The life cycle of experiments and studies; each method returns the record after the change."""

    def __init__(self, connection: Connection, records: Records) -> None:
        self._connection = connection
        self._records = records

    def pause(self, id: str) -> ExperimentRead | StudyRead:
        """Pause a study or an experiment once its current steps end."""
        return self._records.apply(id, Verb.PAUSE)

    def resume(self, id: str) -> ExperimentRead | StudyRead:
        """Continue a paused study or experiment."""
        return self._records.apply(id, Verb.RESUME)

    def stop(self, id: str) -> ExperimentRead | StudyRead:
        """Complete a study or an experiment with its results so far, once its current steps end."""
        return self._records.apply(id, Verb.STOP)

    def cancel(self, id: str) -> ExperimentRead | StudyRead:
        """Cancel a study or an experiment at once."""
        return self._records.apply(id, Verb.CANCEL)

    def retry(self, id: str) -> ExperimentRead | StudyRead:
        """Queue the FAILED repetitions of a study or an experiment once more, from their stored steps."""
        return self._records.apply(id, Verb.RETRY)

    def extend(
        self, id: str, *, iterations: int | None = None, repetitions: int | None = None, yes: bool = False
    ) -> ExperimentRead | StudyRead:
        """Extend a completed experiment, or those of a study that are smaller, to these totals.

        A total that is left out stays. With `yes`, it is extended whatever it costs.
        """
        totals = {"iterations": iterations, "repetitions": repetitions}
        given = {name: total for name, total in totals.items() if total is not None}
        return self._records.apply(id, Verb.EXTEND, given, CONFIRMED if yes else "")

    def schedule(self, id: str, **changes: int | None) -> ExperimentRead:
        """Change the `priority` or `max_parallel` of an experiment."""
        return self._connection.change(ExperimentRead, "PATCH", f"/experiments/{segment(id)}/schedule", json=changes)

    def accept_versions(self, id: str) -> ExperimentRead:
        """Let an experiment continue under other versions of engines or plug-ins than it started with."""
        return self._connection.change(ExperimentRead, "POST", f"/experiments/{segment(id)}/accept-versions")
