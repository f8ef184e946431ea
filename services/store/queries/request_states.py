"""States of requests and answers. Only this module writes them.

request   open ──> taken ──> measured, failed        a void asks again: back to open
└────────┴─────> withdrawn;  stuck, after too many takes without an answer, until a person opens it
answer    conflict ──> counted ──> replaced, void;  or conflict ──> dismissed
"""

from typing import Any

from sqlalchemy import ColumnElement, case, update
from sqlalchemy.orm import Session

from gaplab.schemas.measurements import AnswerState, RequestState
from gaplab.services.core.errors import Conflict
from gaplab.services.store.clock import now
from gaplab.services.store.models import AnswerRow, RequestRow

PENDING = (RequestState.OPEN, RequestState.TAKEN, RequestState.STUCK)
"""States of a request that is still wanted."""

LET_GO_S = 60.0
"""Longest time for which a silent holder keeps the bench of a request that is wanted no more."""

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
    """Withdraw the requests of a condition that are still wanted; its holder has the bench until he lets go."""
    row = RequestRow
    values = {"ended_at": now(), "lease_s": case((row.lease_s > LET_GO_S, LET_GO_S), else_=row.lease_s)}
    session.execute(update(row).where(which, row.state.in_(PENDING)).values(state=RequestState.WITHDRAWN, **values))
