"""What the members of an archive are called, and how a table is written into one."""

import json
from collections.abc import Iterable, Iterator
from datetime import UTC, datetime
from hashlib import sha256
from itertools import islice
from typing import IO, Any

from gaplab.services.store.archive_columns import Column, Kind, columns_of, is_nested

MANIFEST, CURVES = "manifest.json", "curves.json"

Row = dict[str, Any]

_AT_ONCE = 1_000


class Hashed:
    """A stream that knows what went through it; what Parquet is written to, which only ever goes forward."""

    def __init__(self, target: IO[bytes]) -> None:
        self._target, self._sha256 = target, sha256()
        self.bytes = 0
        self.closed = False

    def write(self, some: bytes) -> int:
        """Pass it on."""
        data = bytes(some)
        self._sha256.update(data)
        self.bytes += len(data)
        return self._target.write(data)

    def tell(self) -> int:
        """How much there was."""
        return self.bytes

    def flush(self) -> None:
        """Nothing is held back."""

    def close(self) -> None:
        """The target is not this stream's to close."""
        self.closed = True

    @property
    def digest(self) -> str:
        """SHA-256 of it all, in hexadecimal digits."""
        return self._sha256.hexdigest()


def member_of(table: str) -> str:
    """The file that has the rows of the table."""
    return f"{table}.jsonl" if is_nested(table) else f"{table}.parquet"


def write(table: str, rows: Iterable[Row], target: Hashed) -> int:
    """Write rows of the table, a few at a time; how many there were."""
    return _write_json(rows, target) if is_nested(table) else _write_parquet(columns_of(table), rows, target)


def _write_json(rows: Iterable[Row], target: Hashed) -> int:
    count = 0
    for row in rows:
        target.write(json.dumps(row, default=_moment, allow_nan=False).encode() + b"\n")
        count += 1
    return count


def _moment(value: object) -> str:
    if isinstance(value, datetime):
        return value.astimezone(UTC).isoformat()
    msg = f"no archive has a place for {value!r}"
    raise TypeError(msg)


def _write_parquet(columns: Iterable[Column], rows: Iterable[Row], target: Hashed) -> int:
    import pyarrow as arrow  # takes a second, and only archives need it
    from pyarrow import parquet

    types: dict[Kind, Any] = {
        Kind.TEXT: arrow.string(),
        Kind.WHOLE: arrow.int64(),
        Kind.REAL: arrow.float64(),
        Kind.TRUTH: arrow.bool_(),
        Kind.MOMENT: arrow.timestamp("us", tz="UTC"),
        Kind.VECTOR: arrow.list_(arrow.float64()),
    }
    schema = arrow.schema([(each.name, types[each.kind]) for each in columns])
    count = 0
    with parquet.ParquetWriter(arrow.PythonFile(target, mode="w"), schema, compression="zstd") as writer:
        for some in _parts(rows):
            writer.write_batch(arrow.RecordBatch.from_pylist(some, schema))
            count += len(some)
    return count


def _parts(rows: Iterable[Row]) -> Iterator[list[Row]]:
    incoming = iter(rows)
    while some := list(islice(incoming, _AT_ONCE)):
        yield some
