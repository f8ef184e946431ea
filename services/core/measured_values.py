"""Checks of measured values against a robot: genome, unit, and the shape of readings. Pointers are into the values."""

from collections.abc import Iterator, Sequence

from gaplab.schemas.measurements import KnownSample, Table
from gaplab.services.core.errors import Violation
from gaplab.services.core.robots.base import Robot, Sensors
from gaplab.services.core.space import Space


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
    """Yield that a genome has another size than the robot's, and each gene beyond its bounds."""
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
