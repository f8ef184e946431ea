"""Rows for replays and predictions: controllers, their simulators, and their fitness in reality."""

from collections.abc import Iterator
from dataclasses import dataclass
from statistics import fmean

from sqlalchemy import func
from sqlalchemy.orm import Session, aliased

from gaplab.schemas.records import MeasurementKind
from gaplab.services.core.tuning import is_held_out
from gaplab.services.store.models import ExperimentRow, RepetitionRow, RequestRow, StepKind, StepRow
from gaplab.services.store.queries.experiments import MEASURED, best, of_experiments, same_log, steps_of


@dataclass(frozen=True)
class TunedSample:
    """A sample that simulators were tuned on, and the parameters of the best simulators before and after.

    Attributes:
        fitness: fitness in reality; None if the measurement failed.
        before: None for a sample from before the experiment, which is one of iteration 0.
    """

    repetition: int
    iteration: int
    genome: list[float]
    fitness: float | None
    before: list[float] | None
    after: list[float]


def tuned_samples(session: Session, experiment: ExperimentRow) -> tuple[TunedSample, ...]:
    """Return the samples of an experiment that simulators were tuned on, by repetition and iteration.

    Held-out samples are not among them.
    """
    if not experiment.tunes:
        return ()
    row, before, after = StepRow, aliased(StepRow), aliased(StepRow)
    query = steps_of([experiment.id], StepKind.MEASURED, RepetitionRow.number, row, best(before), best(after))
    for found, iteration in ((before, row.iteration - 1), (after, row.iteration)):
        query = query.join(found, same_log(row, found, StepKind.TUNED) & (found.iteration == iteration))
    share = experiment.spec["held_out"]
    samples = (
        TunedSample(number, step.iteration, step.body["genome"], step.fitness, known["parameters"], tuned["parameters"])
        for number, step, known, tuned in session.execute(query.order_by(RepetitionRow.number, row.iteration))
    )
    seen = (each for each in samples if not is_held_out(experiment.known + each.iteration, share))
    return (*_known_samples(session, experiment), *seen)


def _known_samples(session: Session, experiment: ExperimentRow) -> Iterator[TunedSample]:
    row, share = StepRow, experiment.spec["held_out"]
    query = steps_of([experiment.id], StepKind.TUNED, RepetitionRow.number, best(row)).where(row.iteration == 0)
    for repetition, tuned in session.execute(query.order_by(RepetitionRow.number)):
        samples = experiment.spec["reality"]["samples"][: experiment.known] if tuned else ()
        for number, known in enumerate(samples, 1):
            if tuned["squared_error"] is not None and not is_held_out(number, share):
                yield TunedSample(repetition, 0, known["genome"], fmean(known["values"]), None, tuned["parameters"])


@dataclass(frozen=True)
class MeasuredController:
    """A controller that was evaluated in reality.

    Attributes:
        real: fitness in reality; None if the measurement failed.
        simulated: fitness of a transferred controller in the simulator it evolved in; None for a sample, or if the
            physics failed.
        readings: what the sensors said in reality, each divided by its noise; None if there are none.
    """

    genome: list[float]
    real: float | None
    simulated: float | None
    readings: list[float | None] | None = None


def measured_controller(
    session: Session, experiment: str, repetition: int, iteration: int, kind: MeasurementKind
) -> MeasuredController | None:
    """Return the sample or the transferred controller of an iteration; None if it is not measured yet."""
    row, transferred = StepRow, aliased(StepRow)
    query = steps_of([experiment], MEASURED[kind], row, transferred)
    query = query.outerjoin(
        transferred, same_log(row, transferred, StepKind.TRANSFERRED) & (transferred.iteration == row.iteration)
    )
    found = session.execute(query.where(RepetitionRow.number == repetition, row.iteration == iteration)).first()
    if found is None:
        return None
    measured, evolved = found
    readings = measured.body.get("readings")
    if kind is MeasurementKind.SAMPLE:
        return MeasuredController(measured.body["genome"], measured.fitness, None, readings)
    return MeasuredController(evolved.body["genome"], measured.fitness, evolved.fitness, readings)


def last_measured(session: Session, experiment: str, repetition: int, kind: MeasurementKind) -> int | None:
    """Return the last iteration of a repetition with such a measurement; None if there is none yet."""
    query = steps_of([experiment], MEASURED[kind], func.max(StepRow.iteration))
    last: int | None = session.scalar(query.where(RepetitionRow.number == repetition))
    return last


def requested_controller(
    session: Session, experiment: str, repetition: int, iteration: int, kind: MeasurementKind
) -> MeasuredController | None:
    """Return the controller of an iteration whose measurement is requested; None if there is none."""
    row = RequestRow
    of_it = (row.iteration == iteration) & (row.kind == kind) & row.branch.is_(None)
    query = of_experiments(row, [experiment], row.genome).where(of_it, RepetitionRow.number == repetition)
    genome = session.scalar(query.order_by(row.created_at.desc(), row.id.desc()).limit(1))
    return None if genome is None else MeasuredController(genome, None, None)


def tuned_parameters(session: Session, experiment: str, repetition: int, iteration: int) -> list[list[float]]:
    """Return the parameters of the simulators of an iteration, the best first; empty if they are not tuned yet."""
    query = steps_of([experiment], StepKind.TUNED, StepRow.body)
    body = session.scalar(query.where(RepetitionRow.number == repetition, StepRow.iteration == iteration))
    return [each["parameters"] for each in body["simulators"]] if body else []
