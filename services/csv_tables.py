"""Tables in CSV: written for spreadsheets, and read as these and programs write them.

What is read may have any usual separator, and a byte order mark.
"""

import csv
import re
from collections.abc import Iterable, Iterator, Sequence
from math import isfinite
from typing import NamedTuple

SEPARATORS = ",;\t"

_FORMULA = re.compile(r"'*[=+\-@\t\r]")
"""The beginning of a formula, or of one with apostrophes before it. Source:
https://owasp.org/www-community/attacks/CSV_Injection
"""


def csv_text(header: Sequence[str], rows: Iterable[Iterable[object]]) -> str:
    """Return a file of CSV; None is empty.

    A text that a spreadsheet would take for a formula begins with an apostrophe. Line breaks in texts are single line
    feeds, since `csv` does not quote others.
    """
    lines = _Lines()
    cells = ([_cell(each) if isinstance(each, str) else each for each in row] for row in (header, *rows))
    csv.writer(lines, lineterminator="\n").writerows(cells)
    return "".join(lines)


class _Lines(list[str]):
    write = list.append


def _cell(text: str) -> str:
    lines = text.replace("\r\n", "\n").replace("\r", "\n")
    return f"'{lines}" if _FORMULA.match(text) else lines


class CsvRow(NamedTuple):
    """A row of a table.

    Attributes:
        line: its last line in the file, from 1.
        cells: without spaces around them, and without the apostrophe before what looks like a formula.
        error: why the file cannot be read beyond the lines before; "" if it can.
    """

    line: int
    cells: list[str]
    error: str = ""


class CsvTable(NamedTuple):
    """A table as it is read; blank rows are left out.

    Attributes:
        header: its first row; of line 1 without cells if there is none.
        rows: those below; the last that is read may be an error.
        lines: number of lines of the file.
    """

    header: CsvRow
    rows: Iterator[CsvRow]
    lines: int


def read_csv(text: str) -> CsvTable:
    """Return the table in a file; its separator is the one that its first line has most of."""
    lines = text.removeprefix("\ufeff").splitlines()
    rows = _rows(lines)
    return CsvTable(next(rows, CsvRow(1, [])), rows, len(lines))


def finite(cell: str) -> float | None:
    """Return the finite number of a cell; None if it has none. Decimals have a point, and digits have no groups."""
    try:
        number = float(cell)
    except ValueError:
        return None
    return number if isfinite(number) and "_" not in cell else None


def _rows(lines: Sequence[str]) -> Iterator[CsvRow]:
    first = next(filter(str.strip, lines), "")
    rows = csv.reader(lines, delimiter=max(SEPARATORS, key=first.count), skipinitialspace=True)
    try:
        for row in rows:
            cells = [
                cell[1:] if cell.startswith("'") and _FORMULA.match(cell) else cell for cell in map(str.strip, row)
            ]
            if any(cells):
                yield CsvRow(rows.line_num, cells)
    except csv.Error as error:
        yield CsvRow(rows.line_num, [], f"the line is not CSV: {error}")
