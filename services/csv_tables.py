"""Tables in CSV: written for spreadsheets, and read as these and programs write them.

What is read may have any usual separator, and a byte order mark.
"""

import csv
import re
from collections.abc import Iterable, Iterator, Sequence
from math import isfinite
from typing import Any, NamedTuple

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


class Row(NamedTuple):
    """A row of a table.

    Attributes:
        line: its last line in the file, from 1.
        cells: texts, without spaces around them or the apostrophe before what looks like a formula; or numbers.
        error: why the file cannot be read beyond the lines before; "" if it can.
    """

    line: int
    cells: Sequence[Any]
    error: str = ""


class Table(NamedTuple):
    """A table as it is read; blank rows are left out.

    Attributes:
        header: its first row; of line 1 without cells if there is none.
        rows: those below; the last that is read may be an error.
        lines: number of lines of the file.
    """

    header: Row
    rows: Iterable[Row]
    lines: int

    @classmethod
    def of(cls, headings: Sequence[str], rows: Sequence[Sequence[object]]) -> "Table":
        """Return the table of values that a file has without lines, which are counted as in CSV; None is empty."""
        cells = (["" if cell is None else cell for cell in row] for row in rows)
        return cls(Row(1, headings), [Row(line, row) for line, row in enumerate(cells, start=2)], len(rows) + 1)

    def csv(self) -> str:
        """Return the table as CSV."""
        return csv_text(self.header.cells, (row.cells for row in self.rows))


def read_csv(text: str) -> Table:
    """Return the table in a file; its separator is the one that its first line has most of."""
    lines = text.removeprefix("\ufeff").splitlines()
    rows = _rows(lines)
    return Table(next(rows, Row(1, [])), rows, len(lines))


def finite(cell: str | float) -> float | None:
    """Return the finite number of a cell; None if it has none. Decimals have a point, and digits have no groups."""
    try:
        number = float(cell)
    except (ValueError, TypeError):  # dates and lists of Parquet, too
        return None
    return number if isfinite(number) and "_" not in str(cell) else None


def _rows(lines: Sequence[str]) -> Iterator[Row]:
    first = next(filter(str.strip, lines), "")
    rows = csv.reader(lines, delimiter=max(SEPARATORS, key=first.count), skipinitialspace=True)
    try:
        for row in rows:
            cells = [
                cell[1:] if cell.startswith("'") and _FORMULA.match(cell) else cell for cell in map(str.strip, row)
            ]
            if any(cells):
                yield Row(rows.line_num, cells)
    except csv.Error as error:
        yield Row(rows.line_num, [], f"the line is not CSV: {error}")
