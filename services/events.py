"""What happened to experiments, read in order. Each function is one short transaction.

All of them raise StoreUnavailable while the database cannot be used.
"""

from dataclasses import dataclass

from gaplab.schemas.events import EventKind, EventPage, EventRead
from gaplab.services.store.queries import events, experiments
from gaplab.services.store.session import Store


@dataclass(frozen=True)
class WantedEvents:
    """WantedEvents events are wanted; all, where nothing is said.

    Attributes:
        experiment: only of this one.
        study: only of the experiments of this one.
        kinds: only of these.
    """

    experiment: str | None = None
    study: str | None = None
    kinds: frozenset[EventKind] = frozenset()

    def has(self, event: EventRead) -> bool:
        """Whether the event is one of them."""
        return (
            self.experiment in (None, event.experiment)
            and self.study in (None, event.study)
            and (not self.kinds or event.kind in self.kinds)
        )


def page(store: Store, after: int, which: WantedEvents, *, limit: int) -> EventPage:
    """Up to `limit` of these events, in order, from the first that follows the number `after`."""
    with store.reading() as session:
        latest = events.latest(session)
        found = events.after(
            session, after, limit=limit, experiment=which.experiment, study=which.study, kinds=which.kinds
        )
    last = found[-1].number if len(found) == limit else max(latest, after)
    return EventPage(items=found, last=last, latest=latest)


def latest(store: Store) -> int:
    """The number of the latest event; 0 if there is none."""
    with store.reading() as session:
        return events.latest(session)


def check(store: Store, which: WantedEvents) -> None:
    """Do nothing if there is what events are wanted of.

    Raises:
        NotFound: no such experiment, or no such study.
    """
    with store.reading() as session:
        if which.experiment is not None:
            experiments.get_experiment(session, which.experiment)
        if which.study is not None:
            experiments.get_study(session, which.study)
