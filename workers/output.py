"""Limits of what plug-ins print in Ray's processes: Ray writes it into files until the supervisor ends."""

import os
import sys
from typing import TextIO

ROTATION = {"RAY_ROTATION_MAX_BYTES": "1000000", "RAY_ROTATION_BACKUP_COUNT": "1"}
"""Settings of a Ray of our own: for each process and stream it keeps the last million bytes or two."""

LONGEST = 1_000_000
"""Characters of what is printed at once: Ray never cuts a line."""


def limit_files() -> None:
    """Let a Ray that this process starts later limit its files, unless the environment says otherwise."""
    for name, value in ROTATION.items():
        os.environ.setdefault(name, value)


def limit_prints() -> None:
    """Cut the long texts that this process prints from now on."""
    for stream in (sys.stdout, sys.stderr):
        if not hasattr(stream, "is_limited"):
            _limit(stream)


def _limit(stream: TextIO) -> None:
    write = stream.write

    def write_short(text: str) -> int:
        if len(text) <= LONGEST:
            return write(text)
        write(f"{text[:LONGEST]}… ({len(text) - LONGEST:,} more characters)\n")
        return len(text)

    stream.write = write_short  # type: ignore[method-assign]
    stream.is_limited = True  # type: ignore[attr-defined]
