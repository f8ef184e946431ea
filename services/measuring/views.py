"""Requests and answers as people see them."""

from collections.abc import Sequence

from sqlalchemy import select

from gaplab.schemas.measurements import AnswerRead, RequestRead, RequestState, Safety
from gaplab.services.core.arrays import frozen
from gaplab.services.core.repeats import mean
from gaplab.services.measuring.motion_files import between_repeats
from gaplab.services.specs.measured import needs_readings
from gaplab.services.specs.robots import robot_of
from gaplab.services.specs.stored_specs import discrepancy_of, spec_of
from gaplab.services.store.models import AnswerRow, ExperimentRow, RepetitionRow, RequestRow
from gaplab.services.store.queries import requests
from gaplab.services.store.queries.requests import bench_key
from gaplab.services.store.session import Session
from gaplab.services.world.robot_library import label_of
from gaplab.services.world.safety import expected

READINGS = "The experiment tunes on readings: send a trace for each repeat, or let a driver return them."


def view_requests(session: Session, rows: Sequence[RequestRow]) -> tuple[RequestRead, ...]:
    """Return requests with their answers."""
    repetition, experiment = RepetitionRow, ExperimentRow
    ids = {row.repetition_id for row in rows}
    owners = {
        id_: (number, found)
        for id_, number, found in session.execute(
            select(repetition.id, repetition.number, experiment)
            .join(experiment, experiment.id == repetition.experiment_id)
            .where(repetition.id.in_(ids))
        )
    }
    answers = requests.answers_of(session, {row.same_as or row.id for row in rows})
    benches = {row.bench: bench_key(row.bench) for row in rows}
    held = set(session.scalars(select(RequestRow.held).where(RequestRow.held.in_(benches.values()))))
    return tuple(
        _view(row, owners[row.repetition_id], answers.get(row.same_as or row.id, ()), benches[row.bench] in held)
        for row in rows
    )


def _view(
    row: RequestRow,
    owner: tuple[int, ExperimentRow],
    answers: Sequence[AnswerRow],
    held: bool,
) -> RequestRead:
    number, experiment = owner
    spec = spec_of(experiment.spec)
    robot, safety = robot_of(spec), None if row.safety is None else Safety.model_validate(row.safety)
    needs = needs_readings(discrepancy_of(experiment.spec), robot.sensors)
    taken = row.state is RequestState.TAKEN
    return RequestRead.filled_from(
        row,
        experiment=experiment.id,
        experiment_name=experiment.name,
        experiment_state=experiment.state,
        repetition=number,
        robot=label_of(spec.robot),
        unit=robot.unit,
        repeats=spec.reality.repeats,
        taken_by=row.taken_by if taken else None,
        taken_until=row.taken_until if taken else None,
        busy=held and not taken,
        safety=safety,
        expected=tuple(expected(safety, robot.unit)) if safety else (),
        between_repeats=between_repeats(robot.world) if robot.world.bodies else None,
        needs=READINGS if needs else None,
        answers=tuple(map(view_answer, answers)),
    )


def view_answer(row: AnswerRow) -> AnswerRead:
    """Return an answer."""
    return AnswerRead.filled_from(
        row,
        request=row.request_id,
        fitness=None if row.values is None else mean(frozen(row.values)),
        attachments=row.attachments or (),
        traces=row.traces or (),
        doubts=row.doubts or (),
    )
