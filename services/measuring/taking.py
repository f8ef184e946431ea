"""Takes: one operator a bench reserves a request, and keeps it by heartbeats. Use cases raise StoreUnavailable."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta

from sqlalchemy import ColumnElement, exists, select, tuple_, update
from sqlalchemy.exc import IntegrityError

from gaplab.schemas.events import EventKind
from gaplab.schemas.lifecycle import State
from gaplab.schemas.measurements import AnswerState, HolderSpec, ReleaseSpec, RequestRead, RequestState, TakeSpec
from gaplab.schemas.records import Page
from gaplab.services.core.errors import Conflict
from gaplab.services.experiments.idempotency import Once, once
from gaplab.services.experiments.lease_ends import Silences
from gaplab.services.experiments.limits import Admission
from gaplab.services.measuring.doubts import doubt_others
from gaplab.services.measuring.views import view_requests
from gaplab.services.store.clock import moment
from gaplab.services.store.cursor import decode, encode, next_cursor
from gaplab.services.store.models import AnswerRow, ExperimentRow, RepetitionRow, RequestRow
from gaplab.services.store.queries import requests
from gaplab.services.store.queries.experiments import get_experiment
from gaplab.services.store.queries.requests import become, bench_key, spellings
from gaplab.services.store.session import Session, Store, snapshot, transaction
from gaplab.services.store.statements import storable

_AT_REST = (State.PAUSING, State.PAUSED, State.STOPPING)
"""States of an experiment in which nobody should begin a measurement."""


@dataclass(frozen=True)
class RequestFilter:
    """Which requests a list has.

    Attributes:
        experiment: only those of this experiment.
        bench: only those of this bench.
        pending: only those that are still needed; of a paused experiment, only one that is taken.
        conflicts: only those with an answer in conflict, which a person decides.
    """

    experiment: str | None = None
    bench: str | None = None
    pending: bool = True
    conflicts: bool = False


@snapshot
def list_requests(
    session: Session, wanted: RequestFilter, limit: int = 50, cursor: str | None = None
) -> Page[RequestRead]:
    """Return requests, the oldest first.

    Raises:
        NotFound: the experiment does not exist.
        InvalidSpec: the cursor is of another list.
    """
    row, repetition, experiment = RequestRow, RepetitionRow, ExperimentRow
    key = (row.created_at, row.id)
    conditions: list[ColumnElement[bool]] = []
    if wanted.experiment is not None:
        get_experiment(session, wanted.experiment)
        of_it = select(repetition.id).where(repetition.experiment_id == storable(wanted.experiment))
        conditions.append(row.repetition_id.in_(of_it))
    if wanted.bench is not None:
        conditions.append(row.bench.in_(spellings(session, wanted.bench)))
    if wanted.pending:
        resting = (
            exists()
            .where(repetition.id == row.repetition_id, experiment.id == repetition.experiment_id)
            .where(experiment.state.in_(_AT_REST))
        )
        conditions.append(~resting | (row.state == RequestState.TAKEN))
    if wanted.conflicts:
        in_conflict = (AnswerRow.request_id == row.id) & (AnswerRow.state == AnswerState.CONFLICT)
        conditions.append(exists().where(in_conflict))
    bound = f"requests {wanted}"
    if cursor is not None:
        conditions.append(tuple_(*key) > decode(cursor, key, bound))
    rows = requests.oldest(session, conditions, limit + 1, requests.PENDING if wanted.pending else None)
    following = next_cursor(rows, limit, lambda last: encode(last.created_at, last.id, bound_to=bound))
    return Page[RequestRead](items=view_requests(session, rows[:limit]), next=following)


@snapshot
def none_will_follow(session: Session, wanted: RequestFilter) -> bool:
    """Return whether the experiment of a list has ended, so that it asks for nothing more."""
    if wanted.experiment is None:
        return False
    return get_experiment(session, wanted.experiment).state.ended


@snapshot
def read_request(session: Session, id_: str) -> RequestRead:
    """Return a request.

    Raises:
        NotFound: it does not exist.
    """
    return view_requests(session, [requests.get(session, id_)[0]])[0]


def take(store: Store, id_: str, spec: TakeSpec, admitted: Admission) -> Once[RequestRead]:
    """Take an open request: nobody else may answer it, and its bench is busy, until the take ends.

    Raises:
        NotFound: it does not exist.
        Conflict: it is not open, its bench is busy, or its experiment is paused.
    """
    try:
        return once(store, admitted, spec, RequestRead, lambda session: _take(session, id_, spec), of=id_)
    except IntegrityError as error:
        if "held" not in str(error.orig):
            raise
        raise Conflict(f"another request of the bench of {id_} was taken at the same moment") from error


def _take(session: Session, id_: str, spec: TakeSpec) -> RequestRead:
    row, repetition = requests.locked(session, id_)
    state = session.scalar(select(ExperimentRow.state).where(ExperimentRow.id == repetition.experiment_id))
    if state in _AT_REST:
        raise Conflict(f"experiment {repetition.experiment_id!r} is {state}: nothing is measured until it is resumed")
    _refuse_unless_open(row)
    bench = bench_key(row.bench)
    holder = session.scalars(select(RequestRow).where(RequestRow.held == bench)).first()
    if holder is not None:
        msg = f"{holder.taken_by} has taken request {holder.id} of the bench {row.bench!r}; one is taken at a time"
        raise Conflict(msg)
    become(
        session,
        row,
        RequestState.TAKEN,
        held=bench,
        takes=row.takes + 1,
        taken_by=storable(spec.operator),
        lease_s=spec.lease_s,
        taken_until=moment(session) + timedelta(seconds=spec.lease_s),
    )
    _fence_silent(session, bench)
    requests.note_take(session, row, EventKind.TAKEN)
    return view_requests(session, [row])[0]


@transaction
def heartbeat(session: Session, id_: str, holder: HolderSpec) -> RequestRead:
    """Extend a take by its lease.

    Raises:
        NotFound: the request does not exist.
        Conflict: the take has ended; its answer is still welcome.
    """
    row, _ = requests.locked(session, id_)
    _refuse_unless_held(row, holder)
    row.taken_until = moment(session) + timedelta(seconds=row.lease_s or 0.0)
    return view_requests(session, [row])[0]


@transaction
def release(session: Session, id_: str, spec: ReleaseSpec) -> RequestRead:
    """End a take without an answer: a request that is wanted is open again. Its event says who ended it, and why.

    Raises:
        NotFound: the request does not exist.
        Conflict: the take has ended already, and its holder does not say that the robot moved since.
    """
    row, _ = requests.locked(session, id_)
    if row.held is not None and row.takes == spec.take:
        told = {"by": spec.operator, "reason": spec.reason}
        requests.give_up(session, row, EventKind.RELEASED, **{at: storable(each) for at, each in told.items() if each})
    elif spec.moved_s is not None:
        doubt_others(session, row, spec.take, spec.moved_s, spec.operator or "somebody else")
    else:
        _refuse_unless_held(row, spec)
    return view_requests(session, [row])[0]


@transaction
def reopen(session: Session, id_: str) -> RequestRead:
    """Open a request again that was taken too often without an answer.

    Raises:
        NotFound: it does not exist.
        Conflict: it is not stuck.
    """
    row, _ = requests.locked(session, id_)
    if row.state is not RequestState.STUCK:
        raise Conflict(f"request {row.id} is {row.state.value}, not stuck, so it need not be opened again")
    become(session, row, RequestState.OPEN, unanswered=0)
    return view_requests(session, [row])[0]


def open_again(store: Store, silences: Silences[str]) -> int:
    """Open the requests whose holder sent no heartbeat for a whole lease, and return their number.

    A supervisor calls it periodically, with the silences by its monotonic clock: setting a clock ends no take.
    """
    row = RequestRow
    with store.reading() as session:
        taken = session.execute(select(row.id, row.taken_until, row.lease_s).where(row.held.is_not(None)))
        silent = silences.longer_than_leases([(id_, until, lease or 0.0) for id_, until, lease in taken if until])
    return store.write(_expire, silent) if silent else 0


def _expire(session: Session, silent: Sequence[tuple[str, datetime]]) -> int:
    still = RequestRow.held.is_not(None) & tuple_(RequestRow.id, RequestRow.taken_until).in_(silent)
    expired = session.scalars(select(RequestRow).where(still).with_for_update()).all()
    for each in expired:
        requests.give_up(session, each, EventKind.TAKE_EXPIRED)
    return len(expired)


def _fence_silent(session: Session, bench: str) -> None:
    """Let a person decide about answers of takes that lost their heartbeat: the holders may still drive the robot."""
    row = RequestRow
    silent = (row.unanswered > 0) & row.state.in_((RequestState.OPEN, RequestState.STUCK))
    session.execute(update(row).where(row.bench.in_(spellings(session, bench)), silent).values(takes=row.takes + 1))


def _refuse_unless_open(row: RequestRow) -> None:
    if row.state is RequestState.OPEN:
        return
    why = {
        RequestState.TAKEN: f"{row.taken_by} has taken it",
        RequestState.STUCK: f"it was taken {row.unanswered} times in a row without an answer; open it again first",
        RequestState.WITHDRAWN: "it is no longer needed",
    }.get(row.state, "it is answered")
    raise Conflict(f"request {row.id} cannot be taken: {why}")


def _refuse_unless_held(row: RequestRow, holder: HolderSpec) -> None:
    if row.state is not RequestState.TAKEN or row.takes != holder.take:
        ended = f"take {holder.take} of request {row.id} has ended"
        by = f"; {row.taken_by} has taken it since" if row.state is RequestState.TAKEN else f": it is {row.state.value}"
        raise Conflict(ended + by)
