"""Measured values: checks against a robot, and what the core takes of them.

A robot's checks are of genome, unit and the shape of readings, with pointers into the values. The core takes the mean
of repeats, and readings over the noise of their sensors.
"""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from gaplab.schemas.measurements import KnownSample, Table
from gaplab.schemas.records import SensorsRead
from gaplab.schemas.resolved import ResolvedSpec
from gaplab.schemas.spec import ExperimentSpec
from gaplab.services.core.arrays import NO_READINGS, FloatArray, Readings, frozen, nearest
from gaplab.services.core.discrepancies.base import Discrepancy
from gaplab.services.core.errors import Violation
from gaplab.services.core.repeats import mean
from gaplab.services.core.space import Space
from gaplab.services.core.types import Outcome, Sample
from gaplab.services.specs.robots import robot_of
from gaplab.services.world.robots.base import Robot
from gaplab.services.world.sensing import Sensors


def sample_violations(sample: KnownSample, robot: Robot) -> Iterator[Violation]:
    """Yield what is wrong with a sample from before an experiment."""
    yield from genome_violations(sample.genome, robot.label, robot.space)
    yield from unit_violations(robot.label, sample.unit, robot.unit)
    if sample.readings is not None:
        yield from readings_violations(sample.readings, len(sample.values), robot.sensors)


def unit_violations(robot: str, unit: str | None, own: str) -> Iterator[Violation]:
    """Yield the unit of values that is not the robot's own; None if it is left out."""
    if unit is not None and unit != own:
        message = f"the fitness of the {robot} is in {own or 'no unit'}, not in {unit or 'no unit'}"
        yield Violation("/unit", unit, message, [own])


def readings_violations(tables: Sequence[Table], repeats: int | None, sensors: Sensors) -> Iterator[Violation]:
    """Yield readings, a table for each repeat, of another shape than the sensors have.

    The number of repeats is None if the measurement failed.
    """
    if repeats is None:
        yield Violation("/readings", "given", "a failed measurement has no readings", "left out")
        return
    if len(tables) != repeats:
        message = f"readings have one table for each value: {repeats}, not {len(tables)}"
        yield Violation("/readings", f"tables: {len(tables)}", message, f"exactly {repeats}")
    times, columns = len(sensors.times_s), len(sensors.names)
    wanted = f"{times} rows of {columns} numbers: {', '.join(sensors.names)}" if sensors.size else "left out"
    for repeat, table in enumerate(tables):
        if len(table) != times:
            message = f"repeat {repeat} has {len(table)} rows, and the sensors are read at {times} times"
            yield Violation(f"/readings/{repeat}", f"{len(table)} rows", message, wanted)
        for place, row in enumerate(table):
            if len(row) != columns:
                message = f"row {place} of repeat {repeat} has {len(row)} numbers, and the robot has {columns} sensors"
                yield Violation(f"/readings/{repeat}/{place}", f"{len(row)} numbers", message, wanted)
                break


def genome_violations(genome: Sequence[float], robot: str, space: Space) -> Iterator[Violation]:
    """Yield a violation for a genome of another size than the robot's, or for each gene beyond its bounds."""
    if len(genome) != space.size:
        message = f"a controller of the {robot} has {space.size} genes, not {len(genome)}"
        yield Violation("/genome", f"{len(genome)} numbers", message, f"exactly {space.size} numbers")
        return
    for place, (value, lower, upper) in enumerate(zip(genome, space.lower.tolist(), space.upper.tolist(), strict=True)):
        if not lower <= value <= upper:
            permitted = f"{lower:g} to {upper:g}"
            yield Violation(
                f"/genome/{place}", value, f"gene {place} must be from {permitted}, not {value:g}", permitted
            )


def outcome_of(
    sensors: Sensors, values: Sequence[float] | None, readings: Sequence[Any] | None
) -> tuple[Outcome, FloatArray]:
    """Return the outcome of measured values, and the repeats `(r,)` if there are several.

    Args:
        sensors: what is read, with units and noises.
        values: fitness of each repeat; None if the measurement failed.
        readings: `(r, times, sensors)`, in the sensors' units; None or null where a sensor failed.
    """
    if values is None:
        return Outcome(float("nan")), NO_READINGS
    repeats = frozen(values) if len(values) > 1 else NO_READINGS
    fitness = values[0] if len(values) == 1 else mean(repeats)
    return Outcome(fitness, _standardised(sensors, readings)), repeats


def needs_readings(discrepancy: Discrepancy, sensors: Sensors | SensorsRead) -> bool:
    """Return whether the discrepancy cannot compare a sample without readings."""
    times_s = frozen(np.repeat(sensors.times_s, len(sensors.names)))
    return discrepancy.senses and bool(times_s.size) and discrepancy.lack(times_s * np.nan, times_s) is not None


def lack_violations(
    discrepancy: Discrepancy,
    sensors: Sensors,
    values: Sequence[float],
    readings: Sequence[Any] | None,
    remedy: str,
) -> Iterator[Violation]:
    """Yield a violation if measured values lack what the discrepancy compares, since every simulator would fit.

    Arguments are as of `outcome_of`; the remedy says what to do.
    """
    if not (discrepancy.senses and sensors.size):
        return
    lack = discrepancy.lack(outcome_of(sensors, values, readings)[0].readings, sensors.reading_times_s)
    if lack is not None:
        message = f"the discrepancy {discrepancy.name} compares nothing else, and there is none; {remedy}"
        yield Violation("/readings", None if readings is None else "without", f"{lack} is missing: {message}", lack)


def _standardised(sensors: Sensors, readings: Sequence[Any] | None) -> Readings:
    """Return the mean over repeats of readings `(q,)`, each over its noise; nan where every repeat lacks it.

    Of equal readings, the mean is exactly that reading; of angles to both sides of a half turn, it is that half turn.
    """
    if readings is None or not sensors.size:
        return frozen(np.full(sensors.size, np.nan)) if sensors.size else NO_READINGS
    tables = sensors.standardised(np.array(readings, dtype=np.float64))
    if len(tables) == 1:
        return frozen(tables[0])
    known = ~np.isnan(tables)
    count = known.sum(axis=0)
    first = np.take_along_axis(tables, known.argmax(axis=0)[None, :], axis=0)
    periods = sensors.reading_periods
    beyond_first = np.where(known, nearest(tables, first, periods) - first, 0.0).sum(axis=0)
    means = np.where(count > 0, first[0] + beyond_first / np.maximum(count, 1), np.nan)
    return frozen(nearest(means, np.zeros_like(means), periods))


def samples_of(spec: ResolvedSpec) -> tuple[Sample, ...]:
    """Return the samples that a spec has from before the experiment."""
    found, sensors = [], robot_of(spec).sensors if spec.reality.samples else Sensors()
    for known in spec.reality.samples:
        outcome, repeats = outcome_of(sensors, known.values, known.readings)
        found.append(Sample(frozen(known.genome), *outcome, repeats))
    return tuple(found)


def bench_violations(spec: ExperimentSpec, robot: Robot, discrepancy: Discrepancy) -> Iterator[Violation]:
    """Yield limits that nothing can check, a refusal without limits, and samples that are invalid, or not tuned on."""
    if spec.reality.kind != "physical":
        return
    yield from _limit_violations(spec, robot)
    for place, sample in enumerate(spec.reality.samples):
        found = list(sample_violations(sample, robot))
        remedy = "give the readings of each value in `readings`"
        lacks = lack_violations(discrepancy, robot.sensors, sample.values, sample.readings, remedy)
        for violation in found or lacks:
            yield violation.moved("", f"/reality/samples/{place}")


def _limit_violations(spec: ExperimentSpec, robot: Robot) -> Iterator[Violation]:
    limits = spec.reality.limits
    if robot.world.bodies:
        return
    message = f"the {robot.label} has no body, so no simulator can forecast its motion"
    if limits is not None:
        yield Violation("/reality/limits", limits.model_dump(mode="json"), message, "left out")
    if spec.reality.beyond == "refuse":
        yield Violation("/reality/beyond", spec.reality.beyond, message, "warn")
