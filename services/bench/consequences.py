"""What follows from a correction or a void: the steps of the log that an answer is, and those after it."""

from dataclasses import dataclass
from typing import Literal

from gaplab.schemas.corrections import Consequences
from gaplab.schemas.lifecycle import State
from gaplab.schemas.records import MeasurementKind
from gaplab.services.core.types import Measured, Probed
from gaplab.services.store.models import ExperimentRow, RepetitionRow, RequestRow
from gaplab.services.store.queries import requests
from gaplab.services.store.queries.logs import logs
from gaplab.services.store.session import Session


@dataclass(frozen=True)
class Place:
    """A step of the log that an answer is.

    Attributes:
        request: request of the step.
        number: its place in the log.
        following: number of steps after it that follow from it.
        measurements: number of measurements among them.
    """

    request: RequestRow
    number: int
    following: int
    measurements: int


def places_of(session: Session, request: RequestRow, repetition: RepetitionRow) -> tuple[Place, ...]:
    """Return the steps of the log that the answer to a request is; a controller that is measured once may be several.

    Steps follow from a sample, but not from a probe.
    """
    (log,) = logs(session, [repetition.id]).values()
    found = []
    for each in requests.requests_of(session, repetition.id):
        if (each.same_as or each.id) == request.id and each.branch is None and each.place < len(log):
            later = log[each.place + 1 :] if each.kind is MeasurementKind.SAMPLE else ()
            measurements = sum(isinstance(step, Measured | Probed) and not _left_out(step) for step in later)
            found.append(Place(each, each.place, len(later), measurements))
    return tuple(found)


def _iterations(session: Session, repetition: RepetitionRow) -> int:
    return session.get_one(ExperimentRow, repetition.experiment_id).iterations


def _left_out(step: Measured | Probed) -> bool:
    return isinstance(step, Probed) and step.left_out


def consequences(
    session: Session, request: RequestRow, repetition: RepetitionRow, verb: Literal["correct", "void"]
) -> Consequences:
    """Return what a correction or a void would do."""
    places = places_of(session, request, repetition)
    if not places:
        return nothing_follows(request, repetition, "it belongs to a closed branch, so no step follows from it")
    first = min(places, key=lambda place: place.number)
    steps = max(place.following for place in places)
    measurements = max(place.measurements for place in places)
    if verb == "void":
        steps, measurements = _after(session, repetition, first.number)
    if not steps:
        words = "nothing follows from it"
    else:
        again = f"; {measurements} of them measurements, which are reused if asked for again" if measurements else ""
        words = f"{steps} stored step{'' if steps == 1 else 's'} after it will be computed again{again}"
        if repetition.state is State.COMPLETED and repetition.iterations_done < _iterations(session, repetition):
            words += "; the repetition, which was stopped, goes on to its last iteration"
    return Consequences(
        request=request.id,
        repetition=repetition.number,
        iteration=first.request.iteration,
        steps=steps,
        measurements=measurements,
        words=words if verb == "correct" else f"{words}; the controller is asked for again",
    )


def _after(session: Session, repetition: RepetitionRow, place: int) -> tuple[int, int]:
    (log,) = logs(session, [repetition.id]).values()
    later = log[place + 1 :]
    return len(later), sum(isinstance(step, Measured | Probed) and not _left_out(step) for step in later)


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
