"""Tables of samples in CSV, read line by line; every error has its line and column.

Columns are `gene_0`, `gene_1` and so on; `value`, or `value_1`, `value_2` and so on for repeats; and optionally what
the sensors said: `roll@0.75` is the sensor *roll* at 0.75 s, `roll@0.75#2` the same in repeat 2. A unit may follow in
brackets, as in `value [m/s]`. An empty value means that a line has fewer repeats. A reading that is empty, or has no
column, means that the sensor failed. Cells are separated by commas, semicolons or tabs.
"""

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from difflib import get_close_matches
from math import isclose

from gaplab.schemas.measurements import MOST_VALUES, KnownSample
from gaplab.schemas.samples import CellError, SamplesRead
from gaplab.services.csv_tables import Row, finite, read_csv
from gaplab.services.specs.measured import sample_violations
from gaplab.services.world.robots.base import Robot

MOST_SAMPLES = 10_000
"""Most samples of a table, as of a spec."""

MOST_ERRORS = 1_000
"""Most errors that are told of one table."""

_HEADING = re.compile(r"(?P<name>[^\[\]]*?)\s*(?:\[(?P<unit>[^\[\]]*)\])?")
_GENE, _VALUE = re.compile(r"gene_(\d{1,6})"), re.compile(r"value(?:_(\d{1,6}))?")
_READING = re.compile(r"(?P<sensor>.+)@(?P<time>\d+(?:\.\d*)?)(?:#(?P<repeat>\d{1,6}))?")


@dataclass(frozen=True)
class SampleColumn:
    """What a column holds; columns that hold the same are equal.

    Attributes:
        name: its heading, without a unit.
        kind: `gene`, `value` or `reading`.
        place: number of the gene, of the repeat, or of the repeat of a reading; from 0.
        row: place of a reading's time.
        sensor: place of a reading's sensor.
    """

    name: str = field(compare=False)
    kind: str
    place: int
    row: int = 0
    sensor: int = 0


Numbers = Mapping[SampleColumn, float]


def read_samples(text: str, robot: Robot) -> SamplesRead:
    """Return the samples of the text of a table, measured on this robot, or everything that is wrong with it."""
    header, rows, _ = read_csv(text)
    return collected(_found(header, rows, robot))


def collected(found: Iterable[KnownSample | CellError]) -> SamplesRead:
    """Return the samples of a table, or what is wrong with it; no more than `MOST_ERRORS` errors are kept."""
    samples, errors, more = list[KnownSample](), list[CellError](), 0
    for each in found:
        if isinstance(each, KnownSample):
            samples.append(each)
        elif len(errors) < MOST_ERRORS:
            errors.append(each)
        else:
            more += 1
    if not errors and not 1 <= len(samples) <= MOST_SAMPLES:
        permitted = f"1 to {MOST_SAMPLES:,} lines below the header"
        errors.append(CellError(line=1, message=f"the table has {len(samples):,} samples", permitted=permitted))
    return SamplesRead(samples=() if errors else tuple(samples), errors=tuple(errors), more=more)


def checked(line: int, sample: KnownSample, robot: Robot) -> list[KnownSample | CellError]:
    """Return the sample of a line, or what is wrong with it for this robot."""
    errors = list[KnownSample | CellError]()
    for each in sample_violations(sample, robot):
        _, part, *rest = each.pointer.split("/")
        column = f"gene_{rest[0]}" if part == "genome" and rest else None
        permitted = each.permitted if isinstance(each.permitted, str) else None
        value = str(each.value)
        errors.append(CellError(line=line, column=column, value=value, message=each.message, permitted=permitted))
    return errors or [sample]


def _found(header: Row, rows: Iterable[Row], robot: Robot) -> Iterator[KnownSample | CellError]:
    """Yield what is wrong with the header, and the sample of each line or what is wrong with it."""
    if header.error:
        yield CellError(line=header.line, message=header.error)
        return
    matches = [_HEADING.fullmatch(heading) for heading in header.cells]
    columns = [_column(match["name"], robot) if match else None for match in matches]
    units = [match and match["unit"] for match in matches]
    complete = True
    for error in _of_header(header, columns, units, robot):
        complete = False
        yield error
    for row in rows:
        numbers, errors = _numbers(row, columns)
        errors = errors or (list(_gaps(row.line, numbers)) if complete else [])
        yield from errors
        if complete and not errors:
            reads = any(column and column.kind == "reading" for column in columns)
            yield from checked(row.line, _assembled(numbers, reads, robot), robot)


def _of_header(
    header: Row, columns: Sequence[SampleColumn | None], units: Sequence[str | None], robot: Robot
) -> Iterator[CellError]:
    """Yield the columns that are unknown, in another unit, twice there, or absent."""
    line, unknown = header.line, 0
    for heading, column, unit in zip(header.cells, columns, units, strict=True):
        if column is None:
            unknown += 1
            yield _unknown(line, heading, robot, hint=unknown <= MOST_ERRORS)  # to find the nearest takes milliseconds
            continue
        own = robot.sensors.units[column.sensor] if column.kind == "reading" else robot.unit
        if unit is not None and unit != own and column.kind != "gene":
            message = f"{column.name} is in {own or 'no unit'}, not in {unit or 'no unit'}"
            yield CellError(line=line, column=column.name, value=unit, message=message, permitted=own)
    known = [column for column in columns if column]
    for column, often in Counter(known).items():
        if often > 1:
            yield CellError(line=line, column=column.name, message=f"{column.name} has several columns")
    for name in _absent(known, robot):
        message = f"there is no column {name}"
        yield CellError(line=line, column=name, message=message, permitted=_permitted(robot))


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
    places = {kind: {each.place for each in columns if each.kind == kind} for kind in ("gene", "value", "reading")}
    yield from (f"gene_{place}" for place in range(robot.space.size) if place not in places["gene"])
    wanted = range(max({0, *places["value"], *places["reading"]}) + 1)
    absent = (place for place in wanted if place not in places["value"])
    yield from (f"value_{place + 1}" if len(wanted) > 1 else "value" for place in absent)


def _numbers(row: Row, columns: Sequence[SampleColumn | None]) -> tuple[Numbers, list[CellError]]:
    """Return the numbers of a line, and what is wrong with its cells."""
    line, count = row.line, len(columns)
    if row.error:
        return {}, [CellError(line=line, message=row.error)]
    if len(row.cells) != count:
        message = f"the line has {len(row.cells)} cells, and the header {count}"
        return {}, [CellError(line=line, message=message, permitted=f"exactly {count} cells")]
    numbers, errors = dict[SampleColumn, float](), list[CellError]()
    for column, cell in zip(columns, row.cells, strict=True):
        if column is None:
            continue
        if (number := finite(cell)) is not None:
            numbers[column] = number
        elif cell:
            told = cell[:100]
            message = f"{told!r} is not a number{'; decimals have a point' if ',' in cell else ''}"
            permitted = "a finite number"
            errors.append(CellError(line=line, column=column.name, value=told, message=message, permitted=permitted))
        elif column.kind == "gene" or (column.kind == "value" and column.place == 0):
            errors.append(CellError(line=line, column=column.name, value="", message=f"{column.name} is empty"))
    return numbers, errors


def _gaps(line: int, numbers: Numbers) -> Iterator[CellError]:
    """Yield a value after an empty one, and a reading of a repeat without a value."""
    count = sum(column.kind == "value" for column in numbers)
    for column, number in numbers.items():
        if column.kind != "gene" and column.place >= count:
            missing = (
                f"repeat {column.place + 1} has no value" if column.kind == "reading" else "a value before is empty"
            )
            yield CellError(line=line, column=column.name, value=f"{number:g}", message=missing)


def _assembled(numbers: Numbers, reads: bool, robot: Robot) -> KnownSample:
    """Return the sample of a line without gaps; with readings if the table has any."""
    said = {(column.kind, column.place, column.row, column.sensor): number for column, number in numbers.items()}
    genome, values = ([said[key] for key in sorted(said) if key[0] == kind] for kind in ("gene", "value"))
    times, sensors = range(len(robot.sensors.times_s)), range(len(robot.sensors.names))
    readings = tuple(
        tuple(tuple(said.get(("reading", repeat, row, sensor)) for sensor in sensors) for row in times)
        for repeat in range(len(values))
    )
    return KnownSample(genome=tuple(genome), values=tuple(values), readings=readings if reads else None)


def _unknown(line: int, heading: str, robot: Robot, *, hint: bool) -> CellError:
    """Return the error of an unknown column, perhaps with the known name that is nearest."""
    genes = [f"gene_{place}" for place in range(robot.space.size)]
    names = [*genes, "value", "value_1", "value_2", *robot.sensors.columns]
    nearest = get_close_matches(heading, names, n=1, cutoff=0.5) if hint else []
    meant = f" (did you mean {nearest[0]!r}?)" if nearest else ""
    told = heading[:100]
    message = f"unknown column {told!r}{meant}"
    return CellError(line=line, column=told, value=told, message=message, permitted=_permitted(robot))


def _permitted(robot: Robot) -> str:
    genes = "gene_0" if robot.space.size == 1 else f"gene_0 to gene_{robot.space.size - 1}"
    sensors = robot.sensors
    times = sensors.times if len(sensors.times) <= 12 else (*sensors.times[:3], "…", sensors.times[-1])
    read = f", SENSOR@TIME for {', '.join(sensors.names)} at {', '.join(times)} s"
    return f"{genes}, value or value_1, value_2 …{read if sensors.size else ''}"
