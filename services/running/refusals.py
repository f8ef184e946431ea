"""Refusals of controllers that are expected to exceed the limits of a physical robot: gaplab answers in its place."""

from gaplab.schemas.events import EventKind
from gaplab.schemas.measurements import AnswerState, RequestState
from gaplab.services.store.clock import moment
from gaplab.services.store.lease import Claim
from gaplab.services.store.models import AnswerRow, RequestRow
from gaplab.services.store.queries import requests
from gaplab.services.store.queries.events import note
from gaplab.services.store.queries.experiments import new_id
from gaplab.services.store.session import Session
from gaplab.services.store.statements import storable

OPERATOR = "gaplab"
"""Operator of an answer that no person and no driver gave."""


def refuse(session: Session, claim: Claim, request: RequestRow) -> AnswerRow | None:
    """Answer a request as failed if its forecast exceeds the limits and the spec says to refuse that.

    The controller then counts as tried, and teaches nothing. A person who voids the answer overrules it: the controller
    is offered, and never refused in this repetition again.

    Args:
        session: session of a transaction that writes.
        claim: claim of the repetition that asked.
        request: request, which no answer counts for.

    Returns:
        The answer; None if the controller is to be offered.
    """
    beyond = (request.safety or {}).get("beyond", ())
    if claim.spec.reality.beyond != "refuse" or not beyond or _overruled(session, request):
        return None
    reason = f"not offered: the simulators expect that {'; '.join(beyond)}"
    refused = AnswerRow(
        id=new_id(),
        repetition_id=request.repetition_id,
        request_id=request.id,
        take=None,
        state=AnswerState.COUNTED,
        values=None,
        failed=storable(reason[:2_000]),
        operator=OPERATOR,
        at=moment(session),
    )
    session.add(refused)
    request.state, request.ended_at = RequestState.FAILED, moment(session)
    session.flush()
    body = {"iteration": request.iteration, "request": request.id, "reason": reason}
    note(session, EventKind.REFUSED, claim.experiment_id, claim.number, **body)
    return refused


def _overruled(session: Session, request: RequestRow) -> bool:
    """Return whether a person has voided a refusal of the same controller in the repetition, or answered it."""
    asked = requests.requests_of(session, request.repetition_id)
    same = [row.id for row in asked if row.genome == request.genome]
    answers = requests.answers_of(session, same).values()
    return any(answer.state is not AnswerState.COUNTED for given in answers for answer in given)
