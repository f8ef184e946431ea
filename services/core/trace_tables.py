"""Traces in CSV: a line for each moment, with the pose of the base."""

from collections.abc import Iterable, Iterator, Sequence
from math import isfinite

import numpy as np

from gaplab.services.core.arrays import frozen
from gaplab.services.core.csv_tables import CsvRow, first_of, lines_of, rows_of
from gaplab.services.core.errors import InvalidSpec, Violation
from gaplab.services.core.traces import Trace

COLUMNS = ("time_s", "x", "y", "z", "qx", "qy", "qz", "qw")
"""Columns of a trace: seconds on a clock of its own, metres, and a quaternion; more columns do not matter.

A heading may state another unit: `x [mm]`.
"""

_UNITS: dict[str, tuple[str, ...]] = {"time_s": ("", "s", "ms")} | dict.fromkeys("xyz", ("", "m", "cm", "mm"))
_UNITS |= dict.fromkeys(COLUMNS[4:], ("", "1"))
"""Units that a heading may state, by column; without one, seconds and metres."""

_SHARES = {"": 1.0, "1": 1.0, "s": 1.0, "ms": 1000.0, "m": 1.0, "cm": 100.0, "mm": 1000.0}
"""How many of a unit are a second or a metre."""

MOST_LINES = 500_000
"""Most lines of a trace: 500 s at a kilohertz."""

LONGEST_S = 3_600.0
"""Longest trace."""

MOST_ERRORS = 100
"""Most errors that are told of one trace."""


def read_trace(text: str, pointer: str) -> Trace:
    """Return the trace of a CSV file.

    Args:
        text: content of the file.
        pointer: where the request names the file, for errors.

    Raises:
        InvalidSpec: with every error, each with its line and column.
    """
    lines = lines_of(text)
    if len(lines) > MOST_LINES:
        message = f"the trace has {len(lines):,} lines"
        raise InvalidSpec([Violation(pointer, f"{len(lines):,} lines", message, f"at most {MOST_LINES:,}")])
    rows = rows_of(lines)
    header = next(rows, CsvRow(1, []))
    names, units = zip(*map(_name_and_unit, header.cells or [""]), strict=True)
    if missing := [name for name in COLUMNS if names.count(name) != 1]:
        message = header.error or f"the trace needs one column each of {', '.join(missing)}"
        found = first_of(lines)[:200]
        raise InvalidSpec([Violation(pointer, found, f"line {header.line}: {message}", ", ".join(COLUMNS))])
    places = [names.index(name) for name in COLUMNS]
    numbers, errors = _table(rows, places)
    errors = [*_unknown(header.line, [units[place] for place in places]), *errors]
    if not errors:
        numbers = [[value / _SHARES[units[place]] for value, place in zip(row, places, strict=True)] for row in numbers]
        errors += _nonsense(numbers)
    if errors:
        raise InvalidSpec([Violation(pointer, None, message) for message in errors[:MOST_ERRORS]])
    table = np.array(numbers)
    return Trace(frozen(table[:, 0]), frozen(table[:, 1:4]), frozen(table[:, 4:]))


def _name_and_unit(heading: str) -> tuple[str, str]:
    """Return the name and the unit of a column: `x [mm]`, `x (mm)` or `x`."""
    name, _, unit = heading.replace("(", "[").partition("[")
    return name.strip(), unit.strip(" ])")


def _unknown(line: int, units: Sequence[str]) -> Iterator[str]:
    for name, unit in zip(COLUMNS, units, strict=True):
        permitted = _UNITS[name]
        if unit not in permitted:
            known = ", ".join(filter(None, permitted))
            yield f"line {line}, {name}: the unit {unit!r} is not known; permitted: {known}"


def _table(rows: Iterable[CsvRow], places: Sequence[int]) -> tuple[list[list[float]], list[str]]:
    """Return the numbers of all poses, and what is wrong; nothing is read after `MOST_ERRORS`.

    Rows are those below the header, places those of `COLUMNS`.
    """
    numbers, errors = list[list[float]](), list[str]()
    for line, cells, error in rows:
        if error:
            errors.append(f"line {line}: {error}")
        elif len(found := list(_numbers(line, cells, places, errors))) == len(COLUMNS):
            numbers.append(found)
        if len(errors) >= MOST_ERRORS:
            break
    return numbers, errors


def _numbers(line: int, cells: Sequence[str], places: Sequence[int], errors: list[str]) -> Iterator[float]:
    for name, place in zip(COLUMNS, places, strict=True):
        cell = cells[place] if place < len(cells) else ""
        try:
            number = float(cell)
        except ValueError:
            number = float("nan")
        if isfinite(number):
            yield number
        else:
            errors.append(f"line {line}, {name}: {cell[:50]!r} is not a finite number")


def _nonsense(numbers: Sequence[Sequence[float]]) -> Iterator[str]:
    """Yield what is wrong with the poses of a trace: too few, times that do not ascend, quaternions of another size."""
    if len(numbers) < 2:
        yield f"the trace has {len(numbers)} poses; at least 2 are needed"
        return
    table = np.array(numbers)
    backwards = np.nonzero(np.diff(table[:, 0]) <= 0)[0]
    for place in backwards[:3]:
        before, after = table[place : place + 2, 0].tolist()
        yield f"pose {place + 2}: time_s must ascend, and {after} follows {before}"
    duration = table[-1, 0] - table[0, 0]
    if duration > LONGEST_S:
        yield f"the trace lasts {duration:g} s; at most {LONGEST_S:g} s are permitted"
    sizes = np.linalg.norm(table[:, 4:], axis=1)
    for place in np.nonzero(np.abs(sizes - 1.0) > 0.01)[0][:3]:
        yield f"pose {place + 1}: qx, qy, qz, qw have size {sizes[place]:.3g}; permitted: 1, as of a rotation"
