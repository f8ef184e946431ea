"""Tables in CSV, as spreadsheets and programs write them: with any usual separator, and maybe a byte order mark."""

import csv
from collections.abc import Iterator, Sequence
from typing import NamedTuple

SEPARATORS = ",;\t"


class CsvRow(NamedTuple):
    """A row of a table.

    Attributes:
        line: its last line in the file, from 1.
        cells: without spaces around them.
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
            cells = [cell.strip() for cell in row]
            if any(cells):
                yield CsvRow(rows.line_num, cells)
    except csv.Error as error:
        yield CsvRow(rows.line_num, [], f"the line is no CSV: {error}")
