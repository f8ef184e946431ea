"""Files that leave the service: texts of people in CSV, and entries of zips, the same bytes for the same content."""

import csv
import io
from collections.abc import Iterable, Sequence
from zipfile import ZIP_DEFLATED, ZIP_STORED, ZipInfo

_FORMULA = ("=", "+", "-", "@", "\t", "\r")
"""First characters of a formula. Source: https://owasp.org/www-community/attacks/CSV_Injection"""


def cell(text: str) -> str:
    """Return the text as it is written: no formula, and without the line break that `csv` does not quote.

    A text that a spreadsheet would take for a formula begins with an apostrophe.
    """
    lines = text.replace("\r\n", "\n").replace("\r", "\n")
    return f"'{lines}" if text.startswith(_FORMULA) else lines


def csv_text(header: Sequence[str], rows: Iterable[Iterable[object]]) -> str:
    """Return a file of CSV, whose texts are as `cell` writes them; None is empty."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(header)
    writer.writerows([cell(each) if isinstance(each, str) else each for each in row] for row in rows)
    return text.getvalue()


_EARLIEST = (1980, 1, 1, 0, 0, 0)
_UNIX, _FILE = 3, 0o644 << 16


def entry_of(name: str) -> ZipInfo:
    """Return the entry of a file, with the earliest date of the format; Parquet is compressed already."""
    entry = ZipInfo(name, _EARLIEST)
    entry.compress_type = ZIP_STORED if name.endswith(".parquet") else ZIP_DEFLATED
    entry.create_system, entry.external_attr = _UNIX, _FILE
    return entry
