"""The toy of the paper's Fig. 3, iteration by iteration, from what is stored of an experiment."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from gaplab.schemas.records import MeasurementKind, SampleRead, SimulatorRead
from gaplab.schemas.spec import ExperimentSpec
from gaplab.schemas.toys import Toy, ToySample, ToyTransfer, Values
from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.errors import InvalidSpec, NotFound, Violation
from gaplab.services.core.robots import robots
from gaplab.services.core.robots.base import Robot
from gaplab.services.experiments import hiding
from gaplab.services.specs.assembly import Simulation, edits_of, engine_of, reality_of
from gaplab.services.specs.resolution import is_direct, spec_of
from gaplab.services.store.models import ExperimentRow
from gaplab.services.store.queries import experiments, replays, results
from gaplab.services.store.queries.replays import MeasuredController
from gaplab.services.store.session import Session, Store

GENES = 201
MOST = 100_000
"""Rows of a repetition: more than the limits of a service let an experiment have."""


@dataclass(frozen=True)
class _Stored:
    """What is stored of one repetition; `transferred` is of the iterations that are wanted."""

    row: ExperimentRow
    spec: ExperimentSpec
    robot: Robot
    shown: bool
    measured: tuple[SampleRead, ...]
    simulators: tuple[SimulatorRead, ...]
    transferred: dict[int, MeasuredController | None]


def toys(store: Store, experiment_id: str, repetition: int, iterations: Sequence[int]) -> tuple[Toy, ...]:
    """These iterations of a repetition; of none, the last that has simulators. What is not computed yet is left out.

    Its functions are closed forms, computed here and now. The true one is shown when reality's parameters may be.

    Raises:
        NotFound: no such experiment, or it will never have such a repetition or iteration.
        InvalidSpec: a robot that has a body, or more genes than one; or what it is simulated with has gone from here.
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
    robot = robots.create(spec.robot)
    if not robot.is_function:
        message = f"the robot {spec.robot.name!r} is no function of one gene, so there is no curve to be drawn"
        raise InvalidSpec([Violation("experiment", row.id, message, "an experiment with the robot 'toy_function'")])
    _refuse_outside("repetition", [repetition], row.spec["repetitions"])
    _refuse_outside("iteration", iterations, row.iterations)
    measured = results.page_of_samples(session, row.id, repetition=repetition, kind=None, limit=MOST, cursor=None)
    simulators = results.page_of_simulators(
        session, row, repetition=repetition, iteration=None, limit=MOST, cursor=None
    )
    simulators = () if is_direct(spec) else simulators
    wanted = iterations or [max((each.iteration for each in simulators), default=0)]
    return _Stored(
        row=row,
        spec=spec,
        robot=robot,
        shown=row.id not in hiding.hidden(session, [row]) and None not in row.spec["reality"]["parameters"].values(),
        measured=measured,
        simulators=simulators,
        transferred={
            each: replays.measured_controller(session, row.id, repetition, each, MeasurementKind.PROBE)
            for each in wanted
        },
    )


def _refuse_outside(what: str, numbers: Iterable[int], end: int) -> None:
    for number in numbers:
        if not 0 <= number < end:
            msg = f"the experiment has no {what} {number}; there is 0 to {end - 1}"
            raise NotFound(msg)


def _truth(found: _Stored, genes: FloatArray) -> FloatArray | None:
    if not found.shown:
        return None
    parameters, real = reality_of(found.spec, found.robot)
    return real(genes[:, None], parameters[None])[:, 0]


def _approximations(found: _Stored, simulators: Sequence[SimulatorRead], genes: FloatArray) -> FloatArray:
    """`(simulators, genes)`: the fitness of each gene in each of them."""
    if not simulators:
        return np.empty((0, len(genes)))
    edits = edits_of(ref.name for ref in found.spec.tunables)
    simulate = Simulation(found.robot, engine_of(found.spec.engine), edits)
    return simulate(genes[:, None], np.array([list(each.parameters.values()) for each in simulators])).T


def _limits(found: _Stored, truth: FloatArray | None, genes: FloatArray) -> tuple[float, float]:
    """Room for the truth, for the best simulator of each iteration, and for all that was measured."""
    best = _approximations(found, [each for each in found.simulators if each.rank == 0], genes)
    values = [*best.ravel().tolist(), *([] if truth is None else truth.tolist())]
    values += [each.fitness for each in found.measured if each.fitness is not None]
    there = [each for each in values if np.isfinite(each)] or [0.0, 1.0]
    return min(there), max(there)


def _toy(
    found: _Stored,
    repetition: int,
    iteration: int,
    genes: FloatArray,
    truth: FloatArray | None,
    limits: tuple[float, float],
) -> Toy:
    simulators = [each for each in found.simulators if each.iteration == iteration]
    samples = [each for each in found.measured if each.kind is MeasurementKind.SAMPLE and each.iteration <= iteration]
    return Toy(
        experiment=found.row.id,
        name=found.row.name,
        repetition=repetition,
        iteration=iteration,
        unit=found.robot.unit,
        genes=tuple(genes.tolist()),
        truth=None if truth is None else _values(truth),
        approximations=tuple(map(_values, _approximations(found, simulators, genes))),
        squared_error=simulators[0].squared_error if simulators and samples else None,
        samples=tuple(
            ToySample(iteration=each.iteration, gene=each.genome[0], fitness=each.fitness) for each in samples
        ),
        transfer=_transfer(found.transferred[iteration]),
        limits=limits,
    )


def _transfer(controlled: MeasuredController | None) -> ToyTransfer | None:
    if controlled is None:
        return None
    return ToyTransfer(gene=controlled.genome[0], simulated=controlled.simulated, real=controlled.real)


def _values(function: FloatArray) -> Values:
    return tuple(each if np.isfinite(each) else None for each in function.tolist())
