"""Rows of requests for physical measurements, and of their answers; only this module writes their states.

request   open ──> taken ──> measured, failed        a void asks again: back to open
            └────────┴─────> withdrawn;  stuck, after too many takes without an answer, until a person opens it
answer    conflict ──> counted ──> replaced, void;  or conflict ──> dismissed

However the name of a bench is spaced and capitalised, it is one bench, and spelled as it was first written.
"""

import json
from collections.abc import Collection, Iterable, Sequence
from typing import Any

from sqlalchemy import ColumnElement, Text, case, cast, func, select, union_all, update
from sqlalchemy.orm import Session

from gaplab.schemas.events import EventKind
from gaplab.schemas.measurements import AnswerState, RequestState
from gaplab.services.core.errors import Conflict
from gaplab.services.store.clock import moment, now
from gaplab.services.store.lease import Claim, Requested
from gaplab.services.store.models import AnswerRow, RepetitionRow, RequestRow
from gaplab.services.store.queries.events import note
from gaplab.services.store.queries.experiments import lock, new_id, of_experiments
from gaplab.services.store.statements import existing, storable

PENDING = (RequestState.OPEN, RequestState.TAKEN, RequestState.STUCK)
"""States of a request that is still needed."""

LET_GO_S = 60.0
"""Longest time for which a silent holder keeps the bench of a request that is no longer needed."""

ANSWERED = (RequestState.MEASURED, RequestState.FAILED)

_ENDS = frozenset({*ANSWERED, RequestState.WITHDRAWN})

REQUEST_MOVES = {
    RequestState.OPEN: _ENDS | {RequestState.TAKEN},
    RequestState.TAKEN: _ENDS | {RequestState.OPEN, RequestState.STUCK},
    RequestState.STUCK: _ENDS | {RequestState.OPEN},
    RequestState.MEASURED: _ENDS | {RequestState.OPEN},
    RequestState.FAILED: _ENDS | {RequestState.OPEN},
    RequestState.WITHDRAWN: frozenset[RequestState](),
}

ANSWER_MOVES = {
    AnswerState.CONFLICT: {AnswerState.COUNTED, AnswerState.DISMISSED},
    AnswerState.COUNTED: {AnswerState.REPLACED, AnswerState.VOID},
}


def become(session: Session, row: RequestRow, to: RequestState, **values: Any) -> None:  # noqa: ANN401 - columns of any type
    """Move a locked request to a state, and set further columns.

    Raises:
        Conflict: the move is not permitted.
    """
    if to not in REQUEST_MOVES[row.state]:
        raise Conflict(f"request {row.id} is {row.state.value} and cannot become {to.value}")
    row.state = to
    for name, value in values.items():
        setattr(row, name, value)
    session.flush()


def judge(session: Session, row: AnswerRow, to: AnswerState, reason: str) -> None:
    """Move an answer of a locked request to a state, for a reason.

    Raises:
        Conflict: the move is not permitted.
    """
    if to not in ANSWER_MOVES.get(row.state, ()):
        raise Conflict(f"measurement {row.id} is {row.state.value} and cannot become {to.value}")
    row.state, row.reason = to, reason
    session.flush()


def withdraw(session: Session, which: ColumnElement[bool]) -> None:
    """Withdraw the still needed requests that meet a condition; a holder keeps the bench until the take ends."""
    row = RequestRow
    values = {"ended_at": now(), "lease_s": case((row.lease_s > LET_GO_S, LET_GO_S), else_=row.lease_s)}
    session.execute(update(row).where(which, row.state.in_(PENDING)).values(state=RequestState.WITHDRAWN, **values))


MOST_UNANSWERED = 5
"""Takes in a row without an answer, after which a request is not offered until a person opens it again."""


def insert(session: Session, claim: Claim, wanted: Requested) -> RequestRow:
    """Store a request of a claim, once even if it is asked for again.

    If an earlier request of the repetition for the same controller has an answer that counts, this one refers to it.
    """
    same = requests_of(session, claim.id, of_controller(wanted.genome.tolist()))
    open_ = [row for row in same if row.place == wanted.place and row.state in PENDING]
    answered = [row for row in same if row.state in ANSWERED and counted_answer(session, row) is not None]
    return open_[0] if open_ else _new(session, claim, wanted, answered[0] if answered else None)


def _new(session: Session, claim: Claim, wanted: Requested, same: RequestRow | None) -> RequestRow:
    bench = claim.spec.reality.bench or ""
    row = RequestRow(
        id=new_id(),
        repetition_id=claim.id,
        place=wanted.place,
        iteration=wanted.iteration,
        kind=wanted.kind,
        genome=wanted.genome.tolist(),
        bench=next(iter(spellings(session, bench)), storable(bench).strip()),
        state=RequestState.OPEN if same is None else same.state,
        safety=wanted.safety,
        same_as=None if same is None else same.same_as or same.id,
        created_at=moment(session),
        ended_at=None if same is None else moment(session),
    )
    session.add(row)
    session.flush()
    body = {"iteration": wanted.iteration, "request": row.id, "kind": wanted.kind.value}
    note(session, EventKind.REQUESTED, claim.experiment_id, claim.number, **body)
    return row


def requests_of(session: Session, repetition: int, *conditions: ColumnElement[bool]) -> Sequence[RequestRow]:
    """Return the requests of a repetition that meet conditions, by place in its log."""
    row = RequestRow
    found = select(row).where(row.repetition_id == repetition, *conditions)
    return session.scalars(found.order_by(row.place, row.created_at, row.id)).all()


def pending(session: Session, repetition: int) -> Sequence[RequestRow]:
    """Return the requests that a repetition waits for."""
    return requests_of(session, repetition, RequestRow.state.in_(PENDING))


def of_controller(genome: list[float]) -> ColumnElement[bool]:
    """Return the condition that a request is for the controller with this genome, to the last bit."""
    return cast(RequestRow.genome, Text) == json.dumps(genome)


def oldest(
    session: Session,
    conditions: Sequence[ColumnElement[bool]],
    limit: int,
    states: Collection[RequestState] | None = None,
) -> Sequence[RequestRow]:
    """Return the oldest requests that fulfil conditions, in these states; None for any.

    Each state is asked for by itself: an index has the order within a state, so that nothing is sorted but the result.
    """
    row, key = RequestRow, (RequestRow.created_at, RequestRow.id)
    query = select(row).where(*conditions)
    if states is not None:
        each = [select(row.id).where(row.state == state, *conditions).order_by(*key).limit(limit) for state in states]
        query = select(row).where(row.id.in_(union_all(*(select(one.subquery()) for one in each))))
    return session.scalars(query.order_by(*key).limit(limit)).all()


def counted_answer(session: Session, request: RequestRow) -> AnswerRow | None:
    """Return the answer to a request that counts, which may be of an earlier request for the same controller."""
    row = AnswerRow
    of_it = (row.request_id == (request.same_as or request.id)) & (row.state == AnswerState.COUNTED)
    return session.scalars(select(row).where(of_it)).first()


def get(session: Session, id_: str) -> tuple[RequestRow, RepetitionRow]:
    """Return a request with its repetition.

    Raises:
        NotFound: there is none.
    """
    row = existing(session, RequestRow, id_, "request")
    return row, session.get_one(RepetitionRow, row.repetition_id)


def locked(session: Session, id_: str) -> tuple[RequestRow, RepetitionRow]:
    """Return a request and its repetition, both as they are; their experiment is locked first.

    Raises:
        NotFound: the request does not exist.
    """
    row, repetition = get(session, id_)
    lock(session, [repetition.experiment_id])
    session.refresh(row, with_for_update=True)
    session.refresh(repetition)
    return row, repetition


def give_up(session: Session, row: RequestRow, kind: EventKind, **more: str) -> None:
    """End the take of a request that got no answer; `more` is added to its event, if it is still needed."""
    if row.state is not RequestState.TAKEN:
        row.held = None
        return
    unanswered = row.unanswered + (kind is EventKind.TAKE_EXPIRED)
    to = RequestState.STUCK if unanswered >= MOST_UNANSWERED else RequestState.OPEN
    become(session, row, to, held=None, unanswered=unanswered)
    note_take(session, row, kind, **more)


def note_take(session: Session, row: RequestRow, kind: EventKind, **more: str) -> None:
    """Add the event of a take; `more` is added to it."""
    repetition = session.get_one(RepetitionRow, row.repetition_id)
    body = {"iteration": row.iteration, "request": row.id, "operator": row.taken_by, **more}
    note(session, kind, repetition.experiment_id, repetition.number, **body)


def answers_of(session: Session, requests: Iterable[str]) -> dict[str, list[AnswerRow]]:
    """Return the answers to each of these requests, in the order in which they came."""
    row, found = AnswerRow, dict[str, list[AnswerRow]]()
    for each in session.scalars(select(row).where(row.request_id.in_(list(requests))).order_by(row.at, row.id)):
        found.setdefault(each.request_id, []).append(each)
    return found


def measured(session: Session, experiment: str) -> Sequence[tuple[int, RequestRow, AnswerRow]]:
    """Return the answers with values that count, each with the number of its repetition and its request."""
    row, request = AnswerRow, RequestRow
    query = of_experiments(row, [experiment], RepetitionRow.number, request, row)
    query = query.join(request, request.id == row.request_id).where(row.state == AnswerState.COUNTED)
    found = session.execute(query.order_by(row.at, row.id))
    return [(number, asked, answer) for number, asked, answer in found if answer.values is not None]


def doubtful(session: Session, experiments: Sequence[str]) -> dict[str, tuple[str, ...]]:
    """Return the doubts about answers that count, by experiment, each as a sentence with what to do about it."""
    row, request = AnswerRow, RequestRow
    columns = RepetitionRow.experiment_id, RepetitionRow.number, request.iteration, row.id, row.doubts
    query = of_experiments(row, experiments, *columns).join(request, request.id == row.request_id)
    query = query.where(row.state == AnswerState.COUNTED, row.doubts.is_not(None)).order_by(row.at, row.id)
    found = dict[str, tuple[str, ...]]()
    for experiment, number, iteration, id_, doubts in session.execute(query):
        where = f"repetition {number}, iteration {iteration}: {'; '.join(doubts or ())}"
        what = f"correct the measurement {id_}, or confirm it: gaplab decide {id_} this --reason …"
        found[experiment] = (*found.get(experiment, ()), f"{where}; {what}")
    return found


def bench_key(bench: str) -> str:
    """Return the name of a bench without case and surplus spaces, which all its spellings share."""
    return " ".join(storable(bench).split()).casefold()[:200]


def spellings(session: Session, bench: str | None = None) -> list[str]:
    """Return how requests spell a bench, or all benches if it is None; the first written is the first."""
    row = RequestRow
    found = session.scalars(select(row.bench).group_by(row.bench).order_by(func.min(row.created_at)))
    return [each for each in found if bench is None or bench_key(each) == bench_key(bench)]
