"""Studies that are computed once: in a database, in which an interrupted one goes on, and then an archive."""

import json
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import gaplab


def kept(archive: Path, spec: Callable[[Path], dict[str, Any]]) -> gaplab.Result:
    """Return the study of an archive; one that is missing is computed, in a database beside it.

    Args:
        archive: file with the suffix `.zip`.
        spec: returns the spec, given an empty folder for files that it names.
    """
    if archive.exists():
        return gaplab.run(archive)
    database = archive.with_suffix(".db")
    with TemporaryDirectory() as folder:
        result = gaplab.run(database if database.exists() else spec(Path(folder)), path=database)
    result.save(archive)
    return result


def strategy(text: str) -> str | dict[str, Any]:
    """Return a strategy of a command line: its name, or an object of JSON as in a spec."""
    return dict(json.loads(text)) if text.startswith("{") else text
