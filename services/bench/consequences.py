"""What follows from a correction or a void: the steps of the log that an answer is, and those after it."""

from collections.abc import Sequence
from typing import Literal

from gaplab.schemas.corrections import Consequences
from gaplab.schemas.lifecycle import State
from gaplab.schemas.records import MeasurementKind
from gaplab.services.core.types import Measured, Probed
from gaplab.services.store.models import ExperimentRow, RepetitionRow, RequestRow
from gaplab.services.store.queries import requests
from gaplab.services.store.queries.logs import logs
from gaplab.services.store.session import Session


def recorded(session: Session, request: RequestRow, repetition: RepetitionRow) -> tuple[RequestRow, ...]:
    """Return the requests whose steps in the log are the answer to a request, by place.

    A controller that is measured once may be several.
    """
    (log,) = logs(session, [repetition.id]).values()
    return tuple(
        each
        for each in requests.requests_of(session, repetition.id)
        if (each.same_as or each.id) == request.id and each.branch is None and each.place < len(log)
    )


def samples_among(rows: Sequence[RequestRow]) -> list[RequestRow]:
    """Return the requests for samples, from which the later steps of the log follow; none follows from a probe."""
    return [each for each in rows if each.kind is MeasurementKind.SAMPLE]


def consequences(
    session: Session, request: RequestRow, repetition: RepetitionRow, verb: Literal["correct", "void"]
) -> Consequences:
    """Return what a correction or a void would do."""
    rows = recorded(session, request, repetition)
    if not rows:
        return nothing_follows(request, repetition, "it belongs to a closed branch, so no step follows from it")
    (log,) = logs(session, [repetition.id]).values()
    leading = rows if verb == "void" else samples_among(rows)
    later = log[leading[0].place + 1 :] if leading else ()
    measured = [step for step in later if isinstance(step, Measured | Probed)]
    measurements = sum(not (isinstance(step, Probed) and step.left_out) for step in measured)
    words = "nothing follows from it"
    if later:
        again = f"; {measurements} of them measurements, which are reused if asked for again" if measurements else ""
        words = f"{len(later)} stored step{'' if len(later) == 1 else 's'} after it will be computed again{again}"
        iterations = session.get_one(ExperimentRow, repetition.experiment_id).iterations
        if repetition.state is State.COMPLETED and repetition.iterations_done < iterations:
            words += "; the repetition, which was stopped, goes on to its last iteration"
    words += "" if verb == "correct" else "; the controller is asked for again"
    follows = {"iteration": rows[0].iteration, "steps": len(later), "measurements": measurements}
    return nothing_follows(request, repetition, words).model_copy(update=follows)


def nothing_follows(request: RequestRow, repetition: RepetitionRow, words: str) -> Consequences:
    """Return that no step follows, in these words."""
    return Consequences(
        request=request.id,
        repetition=repetition.number,
        iteration=request.iteration,
        steps=0,
        measurements=0,
        words=words,
    )
