"""The progress of a study or an experiment, request by request until it ends."""

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from gaplab.api.clients.errors import ServiceError, ServiceUnreachable, is_final
from gaplab.api.clients.records import Record, Records, experiments_of
from gaplab.api.clients.results import Results
from gaplab.schemas.curves import Curve
from gaplab.schemas.records import ExperimentRead, RepetitionRead, StudyRead


@dataclass(frozen=True)
class RecordProgress:
    """The progress of a study, or of one experiment.

    Attributes:
        record: the study or the experiment.
        curve: an experiment's curve so far; None unless asked for.
        repetitions: an experiment's repetitions; empty unless asked for.
    """

    record: Record
    curve: Curve | None = None
    repetitions: tuple[RepetitionRead, ...] = ()

    @property
    def name(self) -> str:
        """The name; that of a strategy, which an experiment has by default, with spaces, where a line can break."""
        name = self.record.name
        return name.replace("_", " ") if name == getattr(self.record, "strategy", None) else name


@dataclass(frozen=True)
class Snapshot:
    """The progress at one moment.

    Attributes:
        rows: a study and each of its experiments, or one experiment.
        away_s: time since the last answer, if the service did not answer; the rows are those of that answer.
    """

    rows: tuple[RecordProgress, ...]
    away_s: float = 0.0

    @property
    def record(self) -> Record:
        """The study or the experiment that was asked for."""
        return self.rows[0].record

    @property
    def warning(self) -> str | None:
        """A sentence about a service that does not answer."""
        return f"the service has not answered for {self.away_s:.0f} s; waiting for it" if self.away_s else None


class Snapshots:
    """Snapshots of a study or an experiment; without `results`, they have no curves and repetitions."""

    def __init__(self, records: Records, results: Results | None = None) -> None:
        self._records = records
        self._results = results
        self._details: dict[str, tuple[Curve, tuple[RepetitionRead, ...]]] = {}
        self._settled: set[str] = set()

    def of(self, id: str, *, every_s: float, patience_s: float) -> Iterator[Snapshot]:
        """Yield snapshots until the study or the experiment has ended; see `Watcher.watch`."""
        snapshot = self._snapshot(self._records.find(id))
        yield snapshot
        answered_at = time.monotonic()
        while not snapshot.record.state.ended:
            time.sleep(every_s)
            try:
                record = snapshot.record
                read = self._records.study if isinstance(record, StudyRead) else self._records.experiment
                snapshot = self._snapshot(read(record.id))
            except (ServiceError, ServiceUnreachable) as error:
                away_s = time.monotonic() - answered_at
                if is_final(error) or away_s > patience_s:
                    raise
                snapshot = replace(snapshot, away_s=away_s)
            yield snapshot
            if not snapshot.away_s:
                answered_at = time.monotonic()

    def _snapshot(self, record: Record) -> Snapshot:
        experiments = experiments_of(record)
        if self._results:
            self._read_details(experiments, self._results)
        rows = [RecordProgress(each, *self._details.get(each.id, ())) for each in experiments]
        if isinstance(record, StudyRead):
            rows.insert(0, RecordProgress(record))
        return Snapshot(tuple(rows))

    def _read_details(self, experiments: Sequence[ExperimentRead], results: Results) -> None:
        moving = [experiment.id for experiment in experiments if experiment.id not in self._settled]
        for curve in results.curves_of(moving) if moving else ():
            self._details[curve.experiment] = (curve, self._records.repetitions(curve.experiment))
        self._settled = {experiment.id for experiment in experiments if experiment.state.ended}
