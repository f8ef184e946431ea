"""The misfit of an experiment, from its stored simulators and measurements."""

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from math import nan
from statistics import fmean
from typing import Any

import numpy as np

from gaplab.schemas.misfit import MisfitPoint, MisfitRead
from gaplab.schemas.resolved import ResolvedSpec
from gaplab.services.core.arrays import FloatArray, frozen
from gaplab.services.core.discrepancies import discrepancies
from gaplab.services.core.discrepancies.base import Discrepancy
from gaplab.services.core.repeats import pooled_variance
from gaplab.services.core.tuners import tuners
from gaplab.services.csv_tables import csv_text
from gaplab.services.findings import simulator_sentences as sentences
from gaplab.services.findings.identification import Means, verdicts
from gaplab.services.findings.misfit import Tuning, doubt, misfit_point
from gaplab.services.findings.wording import number
from gaplab.services.specs.assembly import parameters_of
from gaplab.services.specs.robots import installed_robot, unit
from gaplab.services.specs.stored_specs import discrepancy_of, spec_of
from gaplab.services.store.models import ExperimentRow
from gaplab.services.store.queries import experiments, tunings
from gaplab.services.store.queries.tunings import BestSimulator, MeasuredIterations
from gaplab.services.store.session import Store
from gaplab.services.world.robots.base import Robot

DISTRIBUTIONS = ("error", "expected_error", "held_out_error", "gap")
NUMBERS = ("n", "mean", "sd", "least", "greatest", "at_lower", "at_upper", "spread", "interval", "posterior")


def misfit(store: Store, experiment_id: str) -> MisfitRead:
    """Return the misfit of each iteration so far.

    Raises:
        NotFound: the experiment does not exist.
    """
    with store.reading() as session:
        row = experiments.get_experiment(session, experiment_id)
        simulators = tunings.best_simulators(session, experiment_id)
        measured = tunings.measured(session, row)
        members = tunings.posteriors(session, experiment_id)
        repeated = tunings.repeats(session, experiment_id)
    spec, discrepancy = spec_of(row.spec), discrepancy_of(row.spec)
    robot = installed_robot(spec)
    posteriors = {place: _deviations(*found) for place, found in members.items()}
    by_iteration: dict[int, list[Tuning]] = defaultdict(list)
    for best in simulators:
        by_iteration[best.iteration].append(_tuning(best, measured, posteriors, row.spec["tunables"], discrepancy))
    names = [each.name for each in spec.tunables]
    points = tuple(
        misfit_point(iteration, by_iteration[iteration], names, parameters_of(spec.tunables))
        for iteration in sorted(by_iteration if row.tunes else ())
    )
    samples = [fmean(tuning.samples for tuning in by_iteration[point.iteration]) for point in points]
    error_unit = discrepancy.error_unit(unit(spec))
    latest = by_iteration[points[-1].iteration] if points else []
    wrong = sentences.unreproduced(row.id, latest, None if robot is None else robot.sensors, error_unit)
    doubted = doubt(latest, simulated=spec.reality.kind == "simulated")
    said = [*_remarks(points, measured, (unit(spec), error_unit), row), *_noises(row, robot)]
    return MisfitRead(
        experiment=row.id,
        unit=unit(spec),
        error_unit=error_unit,
        points=points,
        remarks=tuple(filter(None, [wrong, *said])),
        unreproduced=wrong,
        held_out=spec.held_out,
        noise=_noise([*repeated, *(sample.values for sample in spec.reality.samples)]),
        verdicts=verdicts(points, samples, _means(spec, robot), doubted),
        note=sentences.IDENTIFIED_NOTE,
    )


def _remarks(
    points: Sequence[MisfitPoint], measured: MeasuredIterations, units: tuple[str, str], row: ExperimentRow
) -> Iterator[str]:
    yield sentences.from_earlier(measured.known, measured.known_held_out, recorded=row.recorded)
    yield from sentences.remarks(points, *units, row.known)
    yield sentences.overfitting(points[-1], units[1]) if points else ""


def _noises(row: ExperimentRow, robot: Robot | None) -> Iterator[str]:
    """Yield what `× noise` is in the unit of the sensors that were recorded, if all have the same."""
    sensors = None if robot is None or not row.recorded else robot.sensors
    same = {*zip(sensors.units, sensors.noises.tolist(), strict=True)} if sensors else set()
    yield from (f"the noise of all sensors is {number(noise)} {unit}" for unit, noise in same if len(same) == 1)


def misfit_csv(found: MisfitRead) -> str:
    """Return a line for each iteration and each number over repetitions; an undefined number is empty."""
    named = (
        (point.iteration, name, numbers)
        for point in found.points
        for name, numbers in (
            *((name, getattr(point, name)) for name in DISTRIBUTIONS),
            *((tunable.name, tunable) for tunable in point.tunables),
        )
    )
    rows = ((at, name, *(getattr(numbers, each, None) for each in NUMBERS)) for at, name, numbers in named)
    return csv_text(("iteration", "what", *NUMBERS), rows)


def _tuning(
    best: BestSimulator,
    measured: MeasuredIterations,
    posteriors: Mapping[tuple[int, int], FloatArray | None],
    tunables: Sequence[Mapping[str, Any]],
    discrepancy: Discrepancy,
) -> Tuning:
    place, simulator = (best.repetition, best.iteration), best.simulator
    return Tuning(
        parameters=simulator.parameters,
        squared_error=simulator.squared_error,
        samples=measured.tuned_until(*place),
        simulated=nan if best.simulated is None else best.simulated,
        real=nan if best.real is None else best.real,
        held_out_error=nan if simulator.held_out_error is None else simulator.held_out_error,
        held_out=measured.tested_until(*place),
        interval=tunings.intervals(simulator, tunables),
        posterior=posteriors.get(place),
        discrepancy=discrepancy,
        fit=simulator.fit,
    )


def _noise(measured: Sequence[Sequence[float]]) -> float | None:
    """Return the standard deviation of one value, pooled over measurements; None if none has repeats."""
    repeated = [frozen(values) for values in measured if len(values) > 1]
    return pooled_variance(repeated) ** 0.5 if repeated else None


def _deviations(members: list[list[float]], weights: list[float]) -> FloatArray | None:
    """Return the standard deviations `(p,)` of weighted simulators; None for a single one."""
    if len(members) < 2:
        return None
    values = np.array(members)
    mean = np.average(values, axis=0, weights=weights)
    return frozen(np.sqrt(np.average((values - mean) ** 2, axis=0, weights=weights)))


def _means(spec: ResolvedSpec, robot: Robot | None) -> Means:
    """Return what the experiment has not used: readings that its robot has, and tuners with intervals."""
    sensing = spec.discrepancy.name in discrepancies and discrepancies[spec.discrepancy.name].senses
    has_sensors = robot is not None and robot.sensors.size > 0
    certain = spec.tuner.name in tuners and tuners[spec.tuner.name].intervals
    return Means(
        readings=() if sensing or not has_sensors else [name for name, each in discrepancies.items() if each.senses],
        intervals=() if certain else [name for name, each in tuners.items() if each.intervals],
    )
