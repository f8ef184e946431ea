"""Tables in CSV: written for spreadsheets, and read as these and programs write them.

What is read may have any usual separator, and a byte order mark.
"""

import csv
import re
from collections.abc import Iterable, Iterator, Sequence
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


def lines_of(text: str) -> list[str]:
    """Return the lines of a file."""
    return text.removeprefix("\ufeff").splitlines()


def first_of(lines: Sequence[str]) -> str:
    """Return the first line that is not blank, "" if there is none."""
    return next((line for line in lines if line.strip()), "")


def rows_of(lines: Sequence[str]) -> Iterator[CsvRow]:
    """Yield the rows that are not blank; the last may be an error.

    The separator is the one that the first line has most of.
    """
    rows = csv.reader(lines, delimiter=max(SEPARATORS, key=first_of(lines).count), skipinitialspace=True)
    try:
        for row in rows:
            cells = [
                cell[1:] if cell.startswith("'") and _FORMULA.match(cell) else cell for cell in map(str.strip, row)
            ]
            if any(cells):
                yield CsvRow(rows.line_num, cells)
    except csv.Error as error:
        yield CsvRow(rows.line_num, [], f"the line is not CSV: {error}")
