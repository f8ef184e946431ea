"""Doubts: what is plausible in an answer, but so unlikely that a person is asked once.

A decimal point that was lost, or centimetres for metres, makes a number that is many times larger than what the
simulators expect of any controller, than all that was measured before, or than the other repeats.

Source: gaplab.
"""

from collections.abc import Iterator, Sequence
from datetime import timedelta
from statistics import median

from sqlalchemy import func, select

from gaplab.schemas.events import EventKind
from gaplab.schemas.measurements import AnswerState, DoubtsRead, MeasurementSpec, RequestState
from gaplab.services.store.clock import moment
from gaplab.services.store.models import LOG, AnswerRow, RepetitionRow, RequestRow, StepRow
from gaplab.services.store.queries.experiments import of_experiments
from gaplab.services.store.queries.requests import get, note_take, spellings
from gaplab.services.store.session import Session, snapshot
from gaplab.services.store.statements import storable

OF_REPEATS = 10.0
"""How many times the median of the other repeats a value is, from which it is doubtful."""

OF_KNOWN = 5.0
"""How many times the largest known fitness, simulated or measured, a value is, from which it is doubtful."""


@snapshot
def read(session: Session, request: str, spec: MeasurementSpec) -> DoubtsRead:
    """Return what is doubtful about an answer that was not given yet.

    Raises:
        NotFound: the request does not exist.
    """
    row, repetition = get(session, request)
    return DoubtsRead(doubts=doubts(session, repetition, row, spec.values))


def doubts(
    session: Session, repetition: RepetitionRow, request: RequestRow, values: Sequence[float] | None
) -> tuple[str, ...]:
    """Return what is doubtful about values of an answer, each as a sentence.

    Args:
        session: of a transaction.
        repetition: of the request.
        request: what was to be measured.
        values: fitness of each repeat; None if it failed.
    """
    if values is None:
        return ()
    return (*_beside_repeats(values), *_beside_known(values, _largest_known(session, repetition, request)))


def doubt_others(session: Session, request: RequestRow, take: int, moved_s: float, by: str) -> None:
    """Make doubtful what others measured on a bench in the last `moved_s`, since this take moved its robot too.

    Answers that count are doubtful. Takes end: answers of theirs are in conflict, and the bench is free once the holder
    is silent.
    """
    why = storable(f"{by} had the robot too, and may have moved it")
    since = moment(session) - timedelta(seconds=moved_s)
    row, answer, of_bench = RequestRow, AnswerRow, RequestRow.bench.in_(spellings(session, request.bench))
    taken = session.scalars(select(row).where(of_bench, row.state == RequestState.TAKEN).with_for_update()).all()
    given = select(answer).join(row, row.id == answer.request_id).where(of_bench, answer.at >= since)
    counted = session.scalars(given.where(answer.state == AnswerState.COUNTED, answer.failed.is_(None))).all()
    others = [each for each in counted if (each.request_id, each.take) != (request.id, take)]
    for measured in others:
        measured.doubts = [*(measured.doubts or ()), why]
    for each in taken:
        note_take(session, each, EventKind.RELEASED, by=storable(by), reason=why)
    for each in {request, *taken} if others or taken else ():
        each.takes += 1  # fences the answers of earlier ones


def _beside_repeats(values: Sequence[float]) -> Iterator[str]:
    for place, value in enumerate(values):
        others = [each for at, each in enumerate(values) if at != place]
        middle = abs(median(others)) if others else 0.0
        if middle and abs(value) >= OF_REPEATS * middle:
            yield f"{value:g} is {abs(value) / middle:.2g} times the other repeats"


def _beside_known(values: Sequence[float], known: float) -> Iterator[str]:
    value = max(values, key=abs)
    if known and abs(value) >= OF_KNOWN * known:
        times = abs(value) / known
        yield f"{value:g} is {times:.2g} times the largest fitness that was simulated or measured, {known:.3g}"


def _largest_known(session: Session, repetition: RepetitionRow, request: RequestRow) -> float:
    """Return the largest absolute fitness that is known from other requests of the experiment; 0 without any."""
    row = StepRow
    own = (row.repetition_id == repetition.id) & (row.iteration == request.iteration) & row.measured_by.is_not(None)
    known = of_experiments(row, [repetition.experiment_id], func.max(func.abs(row.fitness)))
    return session.scalar(known.where(row.branch == LOG, ~own)) or 0.0
