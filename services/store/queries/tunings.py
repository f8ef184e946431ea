"""Tunings: the best simulators, posteriors, and the samples that they were tuned and tested on."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from sqlalchemy.orm import Session

from gaplab.schemas.records import MeasurementKind
from gaplab.services.core.arrays import FloatArray, frozen
from gaplab.services.core.discrepancies.base import Discrepancy
from gaplab.services.core.held_out import is_held_out, seen_of
from gaplab.services.core.misspecification import widened
from gaplab.services.core.space import Space
from gaplab.services.core.types import Fit
from gaplab.services.store.models import ExperimentRow, IterationRow, MeasurementRow, RepetitionRow, SimulatorRow
from gaplab.services.store.queries.logs import fit_of
from gaplab.services.store.queries.repetition_rows import of_experiments


@dataclass(frozen=True)
class BestSimulator:
    """The best simulator of one iteration, and the fitness of the controller that was evolved in it.

    Attributes:
        squared_error: None if the physics failed on a sample.
        held_out_error: None without held-out samples, or if the physics failed on one.
        lower: lower ends of the 95 % intervals as the tuner gave them; None if it gives none.
        upper: their upper ends.
        simulated: fitness in the simulator; None if there is none.
        real: fitness in reality; None if there is none.
        fit: how well it reproduces the samples; None if it is not known.
    """

    repetition: int
    iteration: int
    parameters: list[float]
    squared_error: float | None
    held_out_error: float | None
    lower: list[float] | None
    upper: list[float] | None
    simulated: float | None
    real: float | None
    fit: Fit | None = None


def best_simulators(session: Session, experiment: str) -> tuple[BestSimulator, ...]:
    """Return the best simulator of every iteration of every repetition, ordered by repetition, then iteration."""
    row, found, probe = IterationRow, SimulatorRow, MeasurementRow
    errors = found.squared_error, found.held_out_error
    columns = found.parameters, *errors, found.lower, found.upper, row.simulated_fitness, probe.fitness, found.fit
    best = (found.repetition_id == row.repetition_id) & (found.iteration == row.number) & (found.rank == 0)
    probed = (probe.repetition_id == row.repetition_id) & (probe.iteration == row.number)
    query = of_experiments(row, [experiment], RepetitionRow.number, row.number, *columns)
    query = query.join(found, best).outerjoin(probe, probed & (probe.kind == MeasurementKind.PROBE))
    ordered = session.execute(query.order_by(RepetitionRow.number, row.number))
    return tuple(BestSimulator(*(*each, fit_of(fit))) for *each, fit in ordered)


def intervals(
    parameters: Sequence[float],
    lower: Sequence[float] | None,
    upper: Sequence[float] | None,
    fit: Fit | None,
    tunables: Sequence[Mapping[str, Any]],
) -> FloatArray | None:
    """Return the 95 % intervals `(p, 2)`, widened if the samples differ more than they should; None without any.

    Lower and upper ends are as the tuner gave them. `fit` says how well the simulator reproduces the samples.
    """
    if lower is None or upper is None:
        return None
    space = Space.box([float(each["lower"]) for each in tunables], [float(each["upper"]) for each in tunables])
    scale = 1.0 if fit is None else fit.interval_scale
    return widened(frozen(list(zip(lower, upper, strict=True))), frozen(parameters), scale, space)


@dataclass(frozen=True)
class MeasuredIterations:
    """The iterations whose sample has a fitness, by repetition.

    Attributes:
        tuned_on: those of the samples that tuning sees.
        held_out: those of the samples that it does not see.
        known: number of samples from before the experiment that every tuning sees.
        known_held_out: number of those that none sees.
    """

    tuned_on: Mapping[int, Sequence[int]]
    held_out: Mapping[int, Sequence[int]]
    known: int = 0
    known_held_out: int = 0

    def tuned_until(self, repetition: int, iteration: int) -> int:
        """Return the number of samples that the simulators of an iteration were tuned on."""
        return self.known + _until(self.tuned_on, repetition, iteration)

    def tested_until(self, repetition: int, iteration: int) -> int:
        """Return the number of held-out samples that the simulators of an iteration were tested on."""
        return self.known_held_out + _until(self.held_out, repetition, iteration)


def measured(session: Session, experiment: ExperimentRow) -> MeasuredIterations:
    """Return the iterations whose sample has a fitness."""
    row, share = MeasurementRow, experiment.spec["held_out"]
    query = of_experiments(row, [experiment.id], RepetitionRow.number, row.iteration)
    tuned_on, held_out = dict[int, list[int]](), dict[int, list[int]]()
    before = experiment.known
    for repetition, iteration in session.execute(
        query.where(row.kind == MeasurementKind.SAMPLE, row.fitness.is_not(None))
    ):
        (held_out if is_held_out(before + iteration, share) else tuned_on).setdefault(repetition, []).append(iteration)
    known = seen_of(before, share)
    return MeasuredIterations(tuned_on, held_out, known, before - known)


def repeats(session: Session, experiment: str) -> list[list[float]]:
    """Return the values of each sample and probe that was measured several times."""
    row = MeasurementRow
    return list(session.scalars(of_experiments(row, [experiment], row.repeats).where(row.repeats.is_not(None))))


def posteriors(session: Session, experiment: str) -> dict[tuple[int, int], tuple[list[list[float]], list[float]]]:
    """Return parameters and weights of the simulators of each repetition and iteration whose tuner weights them."""
    row = SimulatorRow
    query = of_experiments(row, [experiment], RepetitionRow.number, row.iteration, row.parameters, row.weight)
    found: dict[tuple[int, int], tuple[list[list[float]], list[float]]] = {}
    for repetition, iteration, parameters, weight in session.execute(query.where(row.weight.is_not(None))):
        members, weights = found.setdefault((repetition, iteration), ([], []))
        members.append(parameters)
        weights.append(weight)
    return found


def per_sample(squared_error: float | None, samples: int, discrepancy: Discrepancy) -> float | None:
    """Return the error per sample; None without samples, or if the physics failed on one."""
    return discrepancy.error(squared_error / samples) if squared_error is not None and samples else None


def _until(iterations: Mapping[int, Sequence[int]], repetition: int, iteration: int) -> int:
    return sum(each <= iteration for each in iterations.get(repetition, ()))
