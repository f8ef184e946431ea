"""The members of an archive: their names, and how the rows of a table are written."""

import json
import re
from collections.abc import Iterable, Iterator, Sequence
from datetime import UTC, datetime
from itertools import islice
from typing import IO, Any

from gaplab.services.archives.columns import Row, columns_of, is_nested
from gaplab.services.store.tables import Column, Kind

MANIFEST, CURVES, SPEC = "manifest.json", "curves.json", "spec.json"

_FILE = re.compile(r"attachments/([0-9a-f]{64})")
_VECTORS = {Kind.VECTOR, Kind.READINGS}
_AT_ONCE = 1_000


def member_of(table: str) -> str:
    """Return the name of the member that has the rows of the table."""
    return f"{table}.jsonl" if is_nested(table) else f"{table}.parquet"


def file_member_of(digest: str) -> str:
    """Return the name of the member that is the file with this hash."""
    return f"attachments/{digest}"


def digest_of(member: str) -> str | None:
    """Return the hash of the file that a member is; None for another member."""
    found = _FILE.fullmatch(member)
    return found[1] if found else None


def write(table: str, rows: Iterable[Row], target: IO[bytes]) -> int:
    """Write rows of the table, some at a time, and return their number."""
    return _write_json(rows, target) if is_nested(table) else _write_parquet(columns_of(table), rows, target)


def _write_json(rows: Iterable[Row], target: IO[bytes]) -> int:
    count = 0
    for count, row in enumerate(rows, 1):  # noqa: B007 - the last count is returned
        target.write(json.dumps(row, default=_moment, allow_nan=False).encode() + b"\n")
    return count


def _moment(value: datetime) -> str:
    return value.astimezone(UTC).isoformat()


def _write_parquet(columns: Sequence[Column], rows: Iterable[Row], target: IO[bytes]) -> int:
    import pyarrow as arrow  # takes a second, and only archives need it
    from pyarrow import parquet

    types: dict[Kind, Any] = {
        Kind.TEXT: arrow.string(),
        Kind.WHOLE: arrow.int64(),
        Kind.REAL: arrow.float64(),
        Kind.TRUTH: arrow.bool_(),
        Kind.MOMENT: arrow.timestamp("us", tz="UTC"),
        **dict.fromkeys(_VECTORS, arrow.list_(arrow.float64())),
    }
    schema = arrow.schema([(column.name, types[column.kind]) for column in columns])
    vectors = [f"{column.name}.list.element" for column in columns if column.kind in _VECTORS]
    reals = [column.name for column in columns if column.kind is Kind.REAL]
    others = [column.name for column in columns if column.kind not in {Kind.REAL, *_VECTORS}]
    # Doubles rarely repeat. With bytes sorted by place and without a dictionary, they take three quarters of the space.
    encoded = {"compression": "zstd", "use_byte_stream_split": vectors + reals, "use_dictionary": others}
    count = 0
    with parquet.ParquetWriter(target, schema, **encoded) as writer:
        for some in _parts(rows):
            writer.write_batch(arrow.RecordBatch.from_pylist(some, schema))
            count += len(some)
    return count


def _parts(rows: Iterable[Row]) -> Iterator[list[Row]]:
    incoming = iter(rows)
    while some := list(islice(incoming, _AT_ONCE)):
        yield some
