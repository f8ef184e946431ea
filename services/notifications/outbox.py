"""The outbox: notifications that are left to send, found in the events, which are stored in the order of commits.

So no change of an experiment does more work than before, and nothing is forgotten when the service is down.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta

from sqlalchemy import func, select

from gaplab.schemas.events import EventKind
from gaplab.schemas.notifications import Channel, EndedExperiment, Notification
from gaplab.services.experiments.views import state_of
from gaplab.services.store.clock import moment
from gaplab.services.store.models import (
    DeletionRow,
    EventCounterRow,
    EventRow,
    ExperimentRow,
    NotificationRow,
    NotifierRow,
    StudyRow,
)
from gaplab.services.store.queries.events import note
from gaplab.services.store.queries.experiments import experiments_of
from gaplab.services.store.session import Session, snapshot, transaction

ENDS = (EventKind.COMPLETED, EventKind.FAILED, EventKind.CANCELLED)

PAUSES_S = (10, 60, 300, 1_800, 7_200, 21_600)
"""Pauses before each further attempt; after the last one a notification is given up."""

TOO_LATE = timedelta(days=1)
"""Age of an end of which nobody is told any more, as after notifications were off for a week."""

TURN = timedelta(minutes=2)
"""Time for which one process at a time sends."""

LEAST_TURN = TURN * 0.75
"""Time that is left of a turn when a delivery begins; longer than any delivery takes."""

_AT_ONCE = 10_000


@dataclass(frozen=True)
class Letter:
    """A notification to send now: event, subject and channel are its key; attempts count from 1.

    The webhook is the study's own; None if that was removed.
    """

    key: tuple[int, str, str]
    message: Notification
    webhook: str | None
    attempt: int

    @property
    def channel(self) -> Channel:
        """Return the channel."""
        return Channel(self.key[2])


@transaction
def collect(session: Session, owner: str, channels: Sequence[Channel]) -> bool:
    """Add a notification for each new end, and return whether it is this process's turn to send.

    The channels of the service tell of everything; others are told by their own webhooks.
    """
    notifier, present = session.get(NotifierRow, 1, with_for_update=True), moment(session)
    assert notifier is not None
    if notifier.owner not in (None, owner) and notifier.until and present < notifier.until <= present + TURN:
        return False
    if notifier.owner != owner or notifier.until is None or notifier.until < present + LEAST_TURN:
        notifier.owner, notifier.until = owner, present + TURN
    latest = session.execute(select(EventCounterRow.latest)).scalar_one()
    after = latest if notifier.after is None or notifier.after > latest else notifier.after
    notifier.after = min(latest, after + _AT_ONCE)
    row = EventRow
    ends = select(row).where(row.number > after, row.number <= notifier.after, row.kind.in_(ENDS)).order_by(row.number)
    for event in session.scalars(ends).all():
        if present - event.at < TOO_LATE:
            session.add_all(_of_end(session, event, channels, present))
    return True


@snapshot
def next_letter(session: Session) -> Letter | None:
    """Return the notification whose turn it is; None if nothing is due."""
    row = NotificationRow
    due = select(row).where(row.next_at <= moment(session)).order_by(row.next_at, row.event).limit(1)
    if (found := session.scalars(due).first()) is None:
        return None
    study = session.get(StudyRow, found.subject_id)
    key = (found.event, found.subject_id, found.channel)
    webhook = study.webhook if study else None
    return Letter(key, Notification.model_validate(found.message), webhook, found.attempts + 1)


@transaction
def settle(session: Session, letter: Letter, failure: str | None, *, hopeless: bool = False) -> None:
    """Store the outcome of an attempt as an event, and when to try again; without a `failure` it was delivered.

    A `hopeless` one would fail the same way again.
    """
    row = session.get(NotificationRow, letter.key, with_for_update=True)
    if row is None or row.attempts >= letter.attempt:
        return
    row.attempts, row.error = letter.attempt, failure
    pauses = () if hopeless or failure is None else PAUSES_S[letter.attempt - 1 : letter.attempt]
    row.next_at = moment(session) + timedelta(seconds=pauses[0]) if pauses else None
    about = {"channel": letter.channel.value, "attempt": letter.attempt}
    if failure is None:
        row.delivered_at = moment(session)
        note(session, EventKind.NOTIFIED, row.experiment_id, **about)
    else:
        again = pauses[0] if pauses else None
        note(session, EventKind.NOTIFICATION_FAILED, row.experiment_id, **about, reason=failure, again_in_s=again)


def _of_end(
    session: Session, event: EventRow, channels: Sequence[Channel], present: datetime
) -> Iterator[NotificationRow]:
    """Yield the notifications that a study has ended, unless that was undone since.

    The last of its experiments to end may be deleted by now.
    """
    of = session.get(ExperimentRow, event.experiment_id) or session.get(DeletionRow, event.experiment_id)
    study = session.get(StudyRow, of.study_id) if of and of.study_id else None
    if study is not None:
        members = experiments_of(session, [study.id])
        if all(each.state.ended for each in members) and _ends(session, event, study, members):
            yield from _rows(event, study, members, channels, present)


def _ends(session: Session, event: EventRow, study: StudyRow, members: Sequence[ExperimentRow]) -> bool:
    """Return whether the last experiment of the study to end, deleted or not, ended at this event."""
    row = EventRow
    deleted = session.scalars(select(DeletionRow.id).where(DeletionRow.study_id == study.id))
    experiments = [*(each.id for each in members), *deleted]
    ends = select(func.max(row.number)).where(row.experiment_id.in_(experiments), row.kind.in_(ENDS))
    return session.scalar(ends) == event.number


def _rows(
    event: EventRow,
    study: StudyRow,
    members: Sequence[ExperimentRow],
    channels: Sequence[Channel],
    present: datetime,
) -> Iterator[NotificationRow]:
    states = [each.state.value for each in members]
    counts = ", ".join(f"{states.count(state)} {state}" for state in sorted(set(states)))
    state = state_of([each.state for each in members])
    message = Notification(
        id=f"{event.number}-{study.id}",
        subject=study.id,
        name=study.name,
        state=state,
        text=f"The study {study.name} is {state}{f': {counts}' if len(members) > 1 else ''}.",
        experiments=tuple(EndedExperiment(id=each.id, name=each.name, state=each.state) for each in members),
        ended_at=event.at,
    )
    for channel in (*channels, *([Channel.OWN] if study.webhook else [])):
        yield NotificationRow(
            event=event.number,
            subject_id=study.id,
            channel=channel.value,
            experiment_id=event.experiment_id,
            message=message.model_dump(mode="json"),
            next_at=present,
        )
