"""Tunings: the best simulators, posteriors, and the samples that they were tuned and tested on."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import isfinite
from typing import Any

from sqlalchemy.orm import Session, aliased

from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.discrepancies.base import Discrepancy
from gaplab.services.core.linear_models import widened
from gaplab.services.core.space import Space
from gaplab.services.core.tuning import is_held_out, seen_of
from gaplab.services.core.types import Simulator
from gaplab.services.specs.recorded import pool_of, selectable
from gaplab.services.specs.stored_specs import spec_of
from gaplab.services.store.models import LOG, ExperimentRow, RepetitionRow, StepKind, StepRow
from gaplab.services.store.queries.experiments import best, of_experiments, same_log, steps_of
from gaplab.services.store.queries.logs import simulator_of


@dataclass(frozen=True)
class BestSimulator:
    """The best simulator of an iteration, as tuned, and the fitness of what evolved in it, there and in reality."""

    repetition: int
    iteration: int
    simulator: Simulator
    simulated: float | None
    real: float | None


def best_simulators(session: Session, experiment: str) -> tuple[BestSimulator, ...]:
    """Return the best simulator of every iteration of every repetition, ordered by repetition, then iteration."""
    row, transferred, probed = StepRow, aliased(StepRow), aliased(StepRow)
    columns = RepetitionRow.number, row.iteration, best(row), transferred.fitness, probed.fitness
    query = steps_of([experiment], StepKind.TUNED, *columns)
    for later, kind in ((transferred, StepKind.TRANSFERRED), (probed, StepKind.PROBED)):
        query = query.outerjoin(later, same_log(row, later, kind) & (later.iteration == row.iteration))
    found = session.execute(query.order_by(RepetitionRow.number, row.iteration))
    return tuple(
        BestSimulator(repetition, iteration, simulator_of(packed), simulated, real)
        for repetition, iteration, packed, simulated, real in found
        if packed is not None
    )


def intervals(simulator: Simulator, tunables: Sequence[Mapping[str, Any]]) -> FloatArray | None:
    """Return the 95 % intervals `(p, 2)`, widened if the samples differ more than they should; None without any."""
    if simulator.interval is None:
        return None
    space = Space.box([float(each["lower"]) for each in tunables], [float(each["upper"]) for each in tunables])
    return widened(simulator.interval, simulator.parameters, simulator.fit, space)


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
    """Return the iterations whose sample has a fitness; none of a strategy that tunes nothing."""
    if not experiment.tunes:
        return MeasuredIterations({}, {})
    row, share = StepRow, experiment.spec["held_out"]
    query = steps_of([experiment.id], StepKind.MEASURED, RepetitionRow.number, row.iteration)
    tuned_on, held_out = dict[int, list[int]](), dict[int, list[int]]()
    before = experiment.known
    succeeded = query.where(row.fitness.is_not(None)).order_by(RepetitionRow.number, row.iteration)
    for repetition, iteration in session.execute(succeeded):
        (held_out if is_held_out(before + iteration, share) else tuned_on).setdefault(repetition, []).append(iteration)
    known = seen_of(before, share)
    if not experiment.recorded:
        return MeasuredIterations(tuned_on, held_out, known, before - known)
    spec = spec_of(experiment.spec)
    recordings = selectable(spec)
    tests = len(pool_of(spec).recordings) - recordings
    return MeasuredIterations(tuned_on, held_out, recordings if experiment.level else 0, tests)


def repeats(session: Session, experiment: str) -> list[list[float]]:
    """Return the values of each sample and probe that was measured several times."""
    bodies = of_experiments(StepRow, [experiment], StepRow.body).where(
        StepRow.branch == LOG, StepRow.kind.in_([StepKind.MEASURED, StepKind.PROBED])
    )
    return [body["repeats"] for body in session.scalars(bodies) if "repeats" in body]


def posteriors(session: Session, experiment: str) -> dict[tuple[int, int], tuple[list[list[float]], list[float]]]:
    """Return parameters and weights of the simulators of each repetition and iteration whose tuner weights them."""
    row = StepRow
    query = steps_of([experiment], StepKind.TUNED, RepetitionRow.number, row.iteration, row.body)
    found: dict[tuple[int, int], tuple[list[list[float]], list[float]]] = {}
    for repetition, iteration, body in session.execute(query):
        weighted = [each for each in body["simulators"] if "weight" in each]
        if weighted:
            members = [each["parameters"] for each in weighted]
            found[repetition, iteration] = members, [each["weight"] for each in weighted]
    return found


def per_sample(squared_error: float, samples: int, discrepancy: Discrepancy) -> float | None:
    """Return the error per sample; None without samples, or if the physics failed on one."""
    return discrepancy.error(squared_error / samples) if isfinite(squared_error) and samples else None


def _until(iterations: Mapping[int, Sequence[int]], repetition: int, iteration: int) -> int:
    return sum(each <= iteration for each in iterations.get(repetition, ()))
