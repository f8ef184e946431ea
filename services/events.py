"""Events of experiments, read in order. Each function is one short transaction.

All of them raise StoreUnavailable while the database cannot be used.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from sqlalchemy import Row, func, or_, select

from gaplab.schemas.events import EventKind, EventPage, EventRead
from gaplab.services.core.errors import Conflict
from gaplab.services.findings.event_sentences import event_sentence
from gaplab.services.store.models import DeletionRow, EventCounterRow, EventRow, ExperimentRow
from gaplab.services.store.queries.experiments import members
from gaplab.services.store.session import Session, snapshot
from gaplab.services.store.statements import storable


@dataclass(frozen=True)
class WantedEvents:
    """A selection of events; without a condition, all events.

    Attributes:
        study: only events of this study's experiments, or of the experiment with this id.
        kinds: only events of these kinds.
    """

    study: str | None = None
    kinds: frozenset[EventKind] = frozenset()

    def has(self, event: EventRead) -> bool:
        """Return whether the selection contains the event."""
        return self.study in (None, event.study, event.experiment) and (not self.kinds or event.kind in self.kinds)


@snapshot
def page(session: Session, after: int, wanted: WantedEvents, *, limit: int) -> EventPage:
    """Return up to `limit` selected events in order, from the first after the number `after`."""
    row, experiment, newest = EventRow, ExperimentRow, _latest(session)
    study = func.coalesce(experiment.study_id, DeletionRow.study_id)
    query = select(row.number, row.kind, row.experiment_id, study, row.repetition, row.body, row.at)
    if wanted.study is not None:
        query = query.where(row.experiment_id.in_(_experiments(session, wanted.study)))
    if wanted.kinds:
        query = query.where(row.kind.in_(list(wanted.kinds)))
    query = query.outerjoin(experiment, experiment.id == row.experiment_id)
    query = query.outerjoin(DeletionRow, DeletionRow.id == row.experiment_id).where(row.number > after)
    items = tuple(map(_read, session.execute(query.order_by(row.number).limit(limit))))
    last = items[-1].number if len(items) == limit else max(newest, after)
    return EventPage(items=items, last=last, latest=newest)


@snapshot
def check(session: Session, wanted: WantedEvents, after: int = 0) -> None:
    """Refuse a selection whose study or preceding event does not exist; deleted ones have events.

    Raises:
        NotFound: no such study or experiment.
        Conflict: there are fewer events than `after`.
    """
    if after > (newest := _latest(session)):
        msg = (
            f"there is no event {after}; the latest is {newest}. The database may have been replaced by another, or by "
            f"an earlier backup: continue after {newest}, or begin with 0"
        )
        raise Conflict(msg)
    if wanted.study is not None and session.get(DeletionRow, storable(wanted.study)) is None:
        members(session, wanted.study)


def _experiments(session: Session, id_: str) -> Sequence[str]:
    """Return the ids of the experiments of a study, or of the experiment with this id; deleted ones too."""
    named = storable(id_)
    found = (select(row.id).where(or_(row.id == named, row.study_id == named)) for row in (ExperimentRow, DeletionRow))
    return [each for query in found for each in session.scalars(query)]


def _read(row: Row[Any]) -> EventRead:
    names = ("number", "kind", "experiment", "study", "repetition", "body", "at")
    found = EventRead(**dict(zip(names, row, strict=True)))
    return found.model_copy(update={"sentence": event_sentence(found.kind, found.repetition, found.body)})


def _latest(session: Session) -> int:
    """Return the number of the latest event; 0 if there is none."""
    return session.execute(select(EventCounterRow.latest)).scalar_one()


latest = snapshot(_latest)
