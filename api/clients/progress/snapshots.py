"""The progress of a study, request by request until it ends."""

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from gaplab.api.clients.connection import Of
from gaplab.api.clients.errors import ServiceError, ServiceUnreachable, is_final
from gaplab.api.clients.progress.text import Record
from gaplab.api.clients.records import Records
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
        study: the study.
        rows: the study and each of its experiments; or the only one.
        away_s: time since the last answer, if the service did not answer; the rows are those of that answer.
    """

    study: StudyRead
    rows: tuple[RecordProgress, ...]
    away_s: float = 0.0

    @property
    def warning(self) -> str | None:
        """A sentence about a service that does not answer."""
        return f"the service has not answered for {self.away_s:.0f} s; waiting for it" if self.away_s else None


class Snapshots:
    """Snapshots of a study; without `results`, they have no curves and repetitions."""

    def __init__(self, records: Records, results: Results | None = None) -> None:
        self._records = records
        self._results = results
        self._details: dict[str, tuple[Curve, tuple[RepetitionRead, ...]]] = {}
        self._settled: set[str] = set()

    def of(self, of: Of, *, every_s: float, patience_s: float) -> Iterator[Snapshot]:
        """Yield snapshots until the study has ended; see `Watcher.watch`."""
        snapshot = self._snapshot(self._records.study(of))
        yield snapshot
        answered_at = time.monotonic()
        while not snapshot.study.state.ended:
            time.sleep(every_s)
            try:
                snapshot = self._snapshot(self._records.study(of))
            except (ServiceError, ServiceUnreachable) as error:
                away_s = time.monotonic() - answered_at
                if is_final(error) or away_s > patience_s:
                    raise
                snapshot = replace(snapshot, away_s=away_s)
            yield snapshot
            if not snapshot.away_s:
                answered_at = time.monotonic()

    def _snapshot(self, study: StudyRead) -> Snapshot:
        if self._results:
            self._read_details(study.experiments, self._results)
        rows = [RecordProgress(each, *self._details.get(each.id, ())) for each in study.experiments]
        if len(rows) > 1:
            rows.insert(0, RecordProgress(study))
        return Snapshot(study, tuple(rows))

    def _read_details(self, experiments: Sequence[ExperimentRead], results: Results) -> None:
        moving = [experiment.id for experiment in experiments if experiment.id not in self._settled]
        for curve in results.curves(moving) if moving else ():
            self._details[curve.experiment] = (curve, self._records.repetitions(curve.experiment))
        self._settled = {experiment.id for experiment in experiments if experiment.state.ended}
