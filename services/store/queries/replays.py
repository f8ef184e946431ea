"""Rows for replays and predictions: controllers, their simulators, and their fitness in reality."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import starmap
from statistics import fmean

from sqlalchemy import func, select
from sqlalchemy.orm import Session, aliased

from gaplab.schemas.records import MeasurementKind
from gaplab.services.core.held_out import is_held_out
from gaplab.services.store.models import (
    ExperimentRow,
    IterationRow,
    MeasurementRow,
    RepetitionRow,
    RequestRow,
    SimulatorRow,
)
from gaplab.services.store.queries.repetition_rows import of_experiments


@dataclass(frozen=True)
class TunedSample:
    """A sample that simulators were tuned on, and the parameters of the best simulators before and after.

    Attributes:
        fitness: fitness in reality; None if the measurement failed.
        before: None of a sample from before the experiment, which is one of iteration 0.
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
    row, before, after = MeasurementRow, aliased(SimulatorRow), aliased(SimulatorRow)
    columns = row.iteration, row.genome, row.fitness, before.parameters, after.parameters
    query = of_experiments(row, [experiment.id], RepetitionRow.number, *columns)
    query = query.where(row.kind == MeasurementKind.SAMPLE)
    for found, iteration in ((before, row.iteration - 1), (after, row.iteration)):
        best = (found.repetition_id == row.repetition_id) & (found.iteration == iteration) & (found.rank == 0)
        query = query.join(found, best)
    share = experiment.spec["held_out"]
    samples = starmap(TunedSample, session.execute(query.order_by(RepetitionRow.number, row.iteration)))
    seen = (each for each in samples if not is_held_out(experiment.known + each.iteration, share))
    return (*_known_samples(session, experiment), *seen)


def _known_samples(session: Session, experiment: ExperimentRow) -> Iterator[TunedSample]:
    row, share = SimulatorRow, experiment.spec["held_out"]
    tuned = (row.iteration == 0) & (row.rank == 0) & row.squared_error.is_not(None)
    query = of_experiments(row, [experiment.id], RepetitionRow.number, row.parameters).where(tuned)
    for repetition, after in session.execute(query.order_by(RepetitionRow.number)):
        for number, known in enumerate(experiment.spec["reality"]["samples"][: experiment.known], 1):
            if not is_held_out(number, share):
                yield TunedSample(repetition, 0, known["genome"], fmean(known["values"]), None, after)


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
    row, measured = IterationRow, MeasurementRow
    query = (
        of_experiments(
            measured, [experiment], measured.genome, measured.fitness, row.simulated_fitness, measured.readings
        )
        .join(row, (row.repetition_id == measured.repetition_id) & (row.number == measured.iteration))
        .where(RepetitionRow.number == repetition, measured.iteration == iteration, measured.kind == kind)
    )
    found = session.execute(query).first()
    if found is None:
        return None
    genome, real, simulated, readings = found
    return MeasuredController(genome, real, simulated if kind is MeasurementKind.PROBE else None, readings)


def last_measured(session: Session, experiment: str, repetition: int, kind: MeasurementKind) -> int | None:
    """Return the last iteration of a repetition with such a measurement; None if there is none yet."""
    row = MeasurementRow
    query = of_experiments(row, [experiment], func.max(row.iteration))
    last: int | None = session.scalar(query.where(RepetitionRow.number == repetition, row.kind == kind))
    return last


def requested_controller(
    session: Session, experiment: str, repetition: int, iteration: int, kind: MeasurementKind
) -> MeasuredController | None:
    """Return the controller of an iteration whose measurement is requested; None if there is none."""
    row = RequestRow
    of_it = (row.iteration == iteration) & (row.kind == kind) & row.branch.is_(None)
    query = select(row.genome).join(RepetitionRow, RepetitionRow.id == row.repetition_id).where(of_it)
    query = query.where(RepetitionRow.experiment_id == experiment, RepetitionRow.number == repetition)
    genome = session.scalar(query.order_by(row.created_at.desc(), row.id.desc()).limit(1))
    return None if genome is None else MeasuredController(genome, None, None)


def tuned_parameters(session: Session, experiment: str, repetition: int, iteration: int) -> list[list[float]]:
    """Return the parameters of the simulators of an iteration, the best first; empty if they are not tuned yet."""
    row = SimulatorRow
    query = of_experiments(row, [experiment], row.parameters)
    query = query.where(RepetitionRow.number == repetition, row.iteration == iteration)
    return list(session.scalars(query.order_by(row.rank)))
