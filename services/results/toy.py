"""The toy function of the paper's Fig. 3: iterations of a stored repetition, with their functions."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from gaplab.schemas.records import MeasurementKind, SampleRead, SimulatorRead
from gaplab.schemas.replays import ToyIteration, ToySample, ToyTransfer
from gaplab.schemas.resolved import ResolvedSpec
from gaplab.services.core.arrays import FloatArray, known
from gaplab.services.core.errors import InvalidSpec, NotFound, Violation
from gaplab.services.experiments import views
from gaplab.services.figures.words import titled
from gaplab.services.specs.assembly import reality_of, simulation_of
from gaplab.services.specs.measured import samples_of
from gaplab.services.specs.resolution import is_direct
from gaplab.services.specs.robots import robot_of
from gaplab.services.specs.stored_specs import discrepancy_of, spec_of
from gaplab.services.store.models import ExperimentRow
from gaplab.services.store.queries import experiments, replays, results
from gaplab.services.store.queries.replays import MeasuredController
from gaplab.services.store.session import Session, Store
from gaplab.services.world.robot_library import label_of
from gaplab.services.world.robots.base import Robot

GENES = 201
MOST_ROWS = 100_000
"""Rows of a repetition that are read: more than a service permits."""


@dataclass(frozen=True)
class _Stored:
    """The stored part of a repetition; samples from before are of iteration 0, `transferred` is of those requested."""

    row: ExperimentRow
    spec: ResolvedSpec
    robot: Robot
    shown: bool
    measured: tuple[SampleRead, ...]
    samples: tuple[ToySample, ...]
    simulators: tuple[SimulatorRead, ...]
    transferred: dict[int, MeasuredController | None]


def toy_iterations(
    store: Store, experiment_id: str, repetition: int, iterations: Sequence[int]
) -> tuple[ToyIteration, ...]:
    """Return iterations of a repetition; by default the last that has simulators.

    The functions are closed forms, which are computed here. The true function is included if the parameters of reality
    may be shown.

    Raises:
        NotFound: the experiment does not exist, or will never have this repetition or iteration.
        InvalidSpec: the robot has a body or several genes, or a plug-in of the experiment is no longer installed.
    """
    with store.reading() as session:
        found = _stored(session, experiment_id, repetition, iterations)
    genes = np.linspace(found.robot.space.lower[0], found.robot.space.upper[0], GENES)
    truth = _truth(found, genes)
    limits = _limits(found, truth, genes)
    return tuple(_toy(found, repetition, each, genes, truth, limits) for each in found.transferred)


def _stored(session: Session, experiment_id: str, repetition: int, iterations: Sequence[int]) -> _Stored:
    row = experiments.get_experiment(session, experiment_id)
    spec = spec_of(row.spec)
    robot = robot_of(spec)
    if not robot.is_function:
        message = f"the robot {label_of(spec.robot)!r} is not a function of one gene, so there is no curve to draw"
        raise InvalidSpec([Violation("experiment", row.id, message, "an experiment with the robot 'toy_function'")])
    _refuse_outside("repetition", [repetition], row.spec["repetitions"])
    _refuse_outside("iteration", iterations, row.iterations)
    measured = results.page_of_samples(session, row.id, repetition=repetition, limit=MOST_ROWS).items
    earlier = samples_of(spec)[: row.known]
    taken = [each for each in measured if each.kind is MeasurementKind.SAMPLE]
    page = results.page_of_simulators(session, row.id, repetition=repetition, limit=MOST_ROWS)
    simulators = () if is_direct(spec) else page.items
    wanted = iterations or [max((each.iteration for each in simulators), default=0)]
    return _Stored(
        row=row,
        spec=spec,
        robot=robot,
        shown=spec.reality.engine is not None
        and row.id not in views.hidden(session, [row])
        and None not in row.spec["reality"]["parameters"].values(),
        measured=measured,
        samples=(
            *(ToySample(iteration=0, gene=each.genome[0], fitness=each.fitness) for each in earlier),
            *(ToySample(iteration=each.iteration, gene=each.genome[0], fitness=each.fitness) for each in taken),
        ),
        simulators=simulators,
        transferred={
            each: replays.measured_controller(session, row.id, repetition, each, MeasurementKind.PROBE)
            for each in wanted
        },
    )


def _refuse_outside(what: str, numbers: Iterable[int], end: int) -> None:
    for number in numbers:
        if not 0 <= number < end:
            raise NotFound(f"the experiment has no {what} {number}; permitted: from 0 to {end - 1}")


def _truth(found: _Stored, genes: FloatArray) -> FloatArray | None:
    if not found.shown:
        return None
    parameters, real = reality_of(found.spec, found.robot)
    return real(genes[:, None], parameters[None])[:, 0]


def _approximations(found: _Stored, simulators: Sequence[SimulatorRead], genes: FloatArray) -> FloatArray:
    if not simulators:
        return np.empty((0, len(genes)))
    simulate = simulation_of(found.spec, found.robot)
    return simulate(genes[:, None], np.array([list(each.parameters.values()) for each in simulators])).T


def _limits(found: _Stored, truth: FloatArray | None, genes: FloatArray) -> tuple[float, float]:
    best = _approximations(found, [each for each in found.simulators if each.rank == 0], genes)
    values = [*best.ravel().tolist(), *([] if truth is None else truth.tolist())]
    values += [each.fitness for each in found.measured if each.fitness is not None]
    values += [each.fitness for each in found.samples if each.fitness is not None]
    there = [each for each in values if np.isfinite(each)] or [0.0, 1.0]
    return min(there), max(there)


def _toy(
    found: _Stored,
    repetition: int,
    iteration: int,
    genes: FloatArray,
    truth: FloatArray | None,
    limits: tuple[float, float],
) -> ToyIteration:
    simulators = [each for each in found.simulators if each.iteration == iteration]
    transfer = found.transferred[iteration]
    samples = tuple(each for each in found.samples if each.iteration <= iteration)
    best = simulators[0] if simulators and samples else None
    return ToyIteration(
        experiment=found.row.id,
        name=titled(found.row.name, found.row.strategy),
        repetition=repetition,
        iteration=iteration,
        unit=found.robot.unit,
        genes=tuple(genes.tolist()),
        truth=None if truth is None else tuple(map(known, truth.tolist())),
        approximations=tuple(tuple(map(known, each)) for each in _approximations(found, simulators, genes).tolist()),
        squared_error=best and best.squared_error,
        squares=discrepancy_of(found.row.spec).squares,
        error=best and best.error,
        samples=samples,
        transfer=transfer and ToyTransfer(gene=transfer.genome[0], simulated=transfer.simulated, real=transfer.real),
        limits=limits,
    )
