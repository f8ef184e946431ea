"""Tables of samples in CSV, read line by line; every error has its line and column.

Columns are `gene_0`, `gene_1` and so on; `value`, or `value_1`, `value_2` and so on for repeats; and optionally what
the sensors said: `roll@0.75` is the sensor *roll* at 0.75 s, `roll@0.75#2` the same in repeat 2. A unit may follow in
brackets, as in `value [m/s]`. An empty value means that a line has fewer repeats. A reading that is empty, or has no
column, means that the sensor failed. Cells are separated by commas, semicolons or tabs.
"""

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from math import isclose, isfinite

from gaplab.schemas.measurements import MOST_VALUES, KnownSample
from gaplab.schemas.samples import CellError, SamplesRead
from gaplab.services.core.csv_tables import CsvRow, lines_of, rows_of
from gaplab.services.core.errors import Violation
from gaplab.services.core.measured_values import sample_violations
from gaplab.services.core.robots.base import Robot

MOST_SAMPLES = 10_000
"""Most samples of a table, as of a spec."""

MOST_ERRORS = 1_000
"""Most errors that are told of one table."""

_HEADING = re.compile(r"(?P<name>[^\[\]]*?)\s*(?:\[(?P<unit>[^\[\]]*)\])?")
_GENE, _VALUE = re.compile(r"gene_(\d{1,6})"), re.compile(r"value(?:_(\d{1,6}))?")
_READING = re.compile(r"(?P<sensor>.+)@(?P<time>\d+(?:\.\d*)?)(?:#(?P<repeat>\d{1,6}))?")
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")


@dataclass(frozen=True)
class SampleColumn:
    """What a column holds.

    Attributes:
        name: its heading, without a unit.
        kind: `gene`, `value` or `reading`.
        place: number of the gene, of the repeat, or of the repeat of a reading; from 0.
        row: place of a reading's time.
        sensor: place of a reading's sensor.
    """

    name: str
    kind: str
    place: int
    row: int = 0
    sensor: int = 0


class FirstErrors:
    """Collects errors, and counts those after `MOST_ERRORS`.

    Attributes:
        first: the first errors.
        count: number of all errors.
    """

    def __init__(self) -> None:
        self.first: list[CellError] = []
        self.count = 0

    def append(self, error: CellError) -> None:
        """Add an error."""
        self.count += 1
        if len(self.first) < MOST_ERRORS:
            self.first.append(error)

    def extend(self, errors: Iterable[CellError]) -> None:
        """Add errors."""
        for error in errors:
            self.append(error)


def read_samples(text: str, robot: Robot) -> SamplesRead:
    """Return the samples of the text of a table, measured on this robot, or everything that is wrong with it."""
    rows = rows_of(lines_of(text))
    samples, errors = list[KnownSample](), FirstErrors()
    line, headings, broken = next(rows, CsvRow(1, []))
    columns = [] if broken else list(_columns(line, headings, robot, errors))
    complete = not errors.count
    for line, cells, broken in rows:
        numbers = {} if broken else _numbers(line, cells, columns, errors)
        samples += _sample(line, numbers, columns, robot, errors) if numbers and complete else ()
    if broken:
        errors.append(CellError(line=line, message=broken))
    if not errors.count and not 1 <= len(samples) <= MOST_SAMPLES:
        permitted = f"1 to {MOST_SAMPLES:,} lines below the header"
        errors.append(CellError(line=line, message=f"the table has {len(samples):,} samples", permitted=permitted))
    told = tuple(errors.first)
    return SamplesRead(samples=() if told else tuple(samples), errors=told, more=errors.count - len(told))


def _columns(line: int, headings: Sequence[str], robot: Robot, errors: FirstErrors) -> Iterator[SampleColumn | None]:
    """Yield what each column holds, None if it is unknown; add what is wrong with the header to the errors."""
    found = []
    for heading in headings:
        match = _HEADING.fullmatch(heading)
        name, unit = (match["name"], match["unit"]) if match else (heading, None)
        column = _column(name, robot)
        yield column
        if column is None:
            if errors.count < MOST_ERRORS:  # to find the nearest name takes milliseconds
                errors.append(_unknown(line, heading, robot))
            else:
                errors.count += 1
            continue
        found.append(column)
        own = robot.sensors.units[column.sensor] if column.kind == "reading" else robot.unit
        if unit is not None and unit != own and column.kind != "gene":
            message = f"{name} is in {own or 'no unit'}, not in {unit or 'no unit'}"
            errors.append(CellError(line=line, column=name, value=unit, message=message, permitted=own))
    often = Counter((column.kind, column.place, column.row, column.sensor) for column in found)
    for column in found:
        if often.pop((column.kind, column.place, column.row, column.sensor), 1) > 1:
            errors.append(CellError(line=line, column=column.name, message=f"{column.name} has several columns"))
    for name in _absent(found, robot):
        errors.append(
            CellError(line=line, column=name, message=f"there is no column {name}", permitted=_permitted(robot))
        )


def _column(name: str, robot: Robot) -> SampleColumn | None:
    """Return what a column of this name holds; None if the robot has nothing of this name."""
    if match := _GENE.fullmatch(name):
        return SampleColumn(name, "gene", int(match[1])) if int(match[1]) < robot.space.size else None
    if match := _VALUE.fullmatch(name):
        repeat = int(match[1] or 1)
        return SampleColumn(name, "value", repeat - 1) if 1 <= repeat <= MOST_VALUES else None
    match, sensors = _READING.fullmatch(name), robot.sensors
    if match is None or match["sensor"] not in sensors.names:
        return None
    times = [place for place, time in enumerate(sensors.times_s) if isclose(time, float(match["time"]), abs_tol=1e-6)]
    repeat = int(match["repeat"] or 1)
    if not times or not 1 <= repeat <= MOST_VALUES:
        return None
    return SampleColumn(name, "reading", repeat - 1, times[0], sensors.names.index(match["sensor"]))


def _absent(columns: Sequence[SampleColumn], robot: Robot) -> Iterator[str]:
    genes = {column.place for column in columns if column.kind == "gene"}
    values = {column.place for column in columns if column.kind == "value"}
    read = {column.place for column in columns if column.kind == "reading"}
    yield from (f"gene_{place}" for place in range(robot.space.size) if place not in genes)
    wanted = range(max({0, *values, *read}) + 1)
    yield from (f"value_{place + 1}" if len(wanted) > 1 else "value" for place in wanted if place not in values)


def _numbers(
    line: int, cells: Sequence[str], columns: Sequence[SampleColumn | None], errors: FirstErrors
) -> dict[SampleColumn, float]:
    """Return the numbers of a line, none if it has an error; add what is wrong with its cells to the errors."""
    if len(cells) != len(columns):
        message = f"the line has {len(cells)} cells, and the header {len(columns)}"
        errors.append(CellError(line=line, message=message, permitted=f"exactly {len(columns)} cells"))
        return {}
    before, numbers = errors.count, dict[SampleColumn, float]()
    for column, cell in zip(columns, cells, strict=True):
        if column is None:
            continue
        if cell and not (_NUMBER.fullmatch(cell) and isfinite(float(cell))):
            hint = "; decimals have a point" if "," in cell else ""
            message, wanted = f"{cell[:100]!r} is not a number{hint}", "a finite number"
            errors.append(CellError(line=line, column=column.name, value=cell[:100], message=message, permitted=wanted))
        elif cell:
            numbers[column] = float(cell)
        elif column.kind == "gene" or (column.kind == "value" and column.place == 0):
            errors.append(CellError(line=line, column=column.name, value="", message=f"{column.name} is empty"))
    return numbers if errors.count == before else {}


def _sample(
    line: int,
    numbers: Mapping[SampleColumn, float],
    columns: Sequence[SampleColumn | None],
    robot: Robot,
    errors: FirstErrors,
) -> tuple[KnownSample, ...]:
    """Return the sample of a line, or none; add what is wrong with it to the errors."""
    if gaps := list(_gaps(line, numbers)):
        errors.extend(gaps)
        return ()
    sample = _assembled(numbers, any(column and column.kind == "reading" for column in columns), robot)
    errors.extend(_told_by_line(line, violation) for violation in sample_violations(sample, robot))
    return (sample,)


def _gaps(line: int, numbers: Mapping[SampleColumn, float]) -> Iterator[CellError]:
    """Yield a value after an empty one, and a reading of a repeat without a value."""
    count = sum(column.kind == "value" for column in numbers)
    for column, number in numbers.items():
        if column.kind != "gene" and column.place >= count:
            missing = (
                f"repeat {column.place + 1} has no value" if column.kind == "reading" else "a value before is empty"
            )
            yield CellError(line=line, column=column.name, value=f"{number:g}", message=missing)


def _assembled(numbers: Mapping[SampleColumn, float], reads: bool, robot: Robot) -> KnownSample:
    """Return the sample of a line without gaps; with readings if the table has any."""
    genes = {column.place: number for column, number in numbers.items() if column.kind == "gene"}
    values = {column.place: number for column, number in numbers.items() if column.kind == "value"}
    said = {(each.place, each.row, each.sensor): number for each, number in numbers.items() if each.kind == "reading"}
    times, sensors = range(len(robot.sensors.times_s)), range(len(robot.sensors.names))
    readings = tuple(
        tuple(tuple(said.get((repeat, row, sensor)) for sensor in sensors) for row in times)
        for repeat in range(len(values))
    )
    return KnownSample(
        genome=tuple(genes[place] for place in sorted(genes)),
        values=tuple(values[place] for place in sorted(values)),
        readings=readings if reads else None,
    )


def _told_by_line(line: int, violation: Violation) -> CellError:
    _, place, *rest = violation.pointer.split("/")
    column = f"gene_{rest[0]}" if place == "genome" and rest else None
    permitted = violation.permitted if isinstance(violation.permitted, str) else None
    return CellError(
        line=line, column=column, value=str(violation.value), message=violation.message, permitted=permitted
    )


def _unknown(line: int, heading: str, robot: Robot) -> CellError:
    nearest = get_close_matches(heading, _names(robot), n=1, cutoff=0.5)
    hint = f" (did you mean {nearest[0]!r}?)" if nearest else ""
    message = f"unknown column {heading[:100]!r}{hint}"
    return CellError(line=line, column=heading[:100], value=heading[:100], message=message, permitted=_permitted(robot))


def _names(robot: Robot) -> list[str]:
    genes = [f"gene_{place}" for place in range(robot.space.size)]
    return [*genes, "value", "value_1", "value_2", *robot.sensors.columns]


def _permitted(robot: Robot) -> str:
    genes = "gene_0" if robot.space.size == 1 else f"gene_0 to gene_{robot.space.size - 1}"
    sensors = robot.sensors
    read = f", SENSOR@TIME for {', '.join(sensors.names)} at {', '.join(sensors.times)} s"
    return f"{genes}, value or value_1, value_2 …{read if sensors.size else ''}"
