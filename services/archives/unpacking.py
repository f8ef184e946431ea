"""Parquet to JSON Lines, as a program: `python -I unpacking.py PARQUET LINES ROWS [PARQUET LINES ROWS]...`.

A harmful file can only end this process, or exhaust its limits of memory, time and disk.
"""

import json
import resource
import sys
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

MOST: dict[int, int] = {
    resource.RLIMIT_DATA: 2 * 2**30,
    resource.RLIMIT_FSIZE: 2**30,
    resource.RLIMIT_CPU: 300,
    resource.RLIMIT_CORE: 0,
}
"""Bytes of memory, bytes of all written files together, seconds of processor time, and bytes of a core dump."""

_AT_ONCE = 500


def main(arguments: list[str]) -> int:
    """Convert each Parquet file to JSON Lines.

    Returns:
        The exit code: 0, or the number of the first invalid file. There is no message, since it would quote the file.
    """
    for limit, most in MOST.items():
        _restrict(limit, most)
    left = MOST[resource.RLIMIT_FSIZE]
    files = zip(arguments[::3], arguments[1::3], arguments[2::3], strict=True)
    for number, (source, target, rows) in enumerate(files, 1):
        if not convert(source, target, int(rows)):
            return number
        left -= Path(target).stat().st_size
        _restrict(resource.RLIMIT_FSIZE, left)  # the system limits each file by itself
    return 0


def _restrict(limit: int, most: int) -> None:
    with suppress(ValueError, OSError):  # the system lacks this limit, or has a lower one already
        resource.setrlimit(limit, (most, most))


def convert(source: str, target: str, rows: int) -> bool:
    """Write each row of one file as a line of JSON, and return whether that succeeded and the file has these rows."""
    import pyarrow as arrow  # within the limits
    from pyarrow import parquet

    arrow.set_cpu_count(1)
    try:
        with parquet.ParquetFile(source) as file, open(target, "x") as lines:
            if file.metadata.num_rows != rows:
                return False
            for batch in file.iter_batches(_AT_ONCE, use_threads=False):
                for row in batch.to_pylist():
                    lines.write(json.dumps(row, default=_plain, allow_nan=False) + "\n")
    except (arrow.ArrowException, ValueError, TypeError, KeyError, OSError, MemoryError, RecursionError):
        return False
    return True


def _plain(value: Any) -> str:  # noqa: ANN401 - whatever Parquet has
    if isinstance(value, datetime) and value.tzinfo is not None:
        return value.astimezone(UTC).isoformat()
    raise TypeError(f"an archive cannot contain values of type {type(value).__name__}")


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
