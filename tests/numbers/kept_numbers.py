"""The kept archives, read without gaplab: what they hold cannot change with the code under test."""

import json
import platform
import sqlite3
from contextlib import closing
from importlib.metadata import PackageNotFoundError, version
from io import BytesIO
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import numpy as np

FOLDER = Path(__file__).parent / "kept"
MACHINE = FOLDER / "machine.json"
HALF_WAY = FOLDER / "half-way.db.xz"
CURVES = FOLDER / "curves.json"
"""The curves of each archive."""

TALLY = ("steps", "rollouts_done", "rollouts_failed", "rollouts_saved")
STEP = ("kind", "iteration", "place", "fitness", "recorded", "body", "rollouts", "failures", "saved")
"""Columns that follow from the spec; times, owners and attempts do not."""

QUERIES = {
    "study": "SELECT * FROM study",
    "experiment": "SELECT * FROM experiment ORDER BY position",
    "provenance": "SELECT * FROM provenance",
    "repetition": "SELECT * FROM repetition ORDER BY experiment_id, number",
    "step": "SELECT r.experiment_id, r.number AS repetition, s.* FROM step s JOIN repetition r ON r.id = repetition_id"
    " WHERE branch = 0 ORDER BY r.experiment_id, r.number, place",
}
JSON = {"spec", "facts", "body"}


def archive(name: Any) -> Any:
    """The bytes of a kept archive."""
    return (FOLDER / f"{name}.zip").read_bytes()


def tables(data: Any) -> Any:
    """The rows of an archive, by table, as dictionaries."""
    with ZipFile(BytesIO(data)) as opened, closing(sqlite3.connect(":memory:")) as connection:
        connection.deserialize(opened.read("study.sqlite3"))
        connection.row_factory = sqlite3.Row
        return {name: [_plain(row) for row in connection.execute(query)] for name, query in QUERIES.items()}


def _plain(row: Any) -> Any:
    return {name: json.loads(row[name]) if name in JSON else row[name] for name in row.keys()}  # noqa: SIM118 - a row


def exact(value: Any) -> Any:
    """The value with each float as its bits in hexadecimal, so that -0.0 differs from 0.0."""
    if isinstance(value, float):
        return value.hex()
    if isinstance(value, list | tuple):
        return [exact(each) for each in value]
    if isinstance(value, dict):
        return {name: exact(each) for name, each in value.items()}
    return value


def numbers(found: Any) -> Any:
    """The numbers of an archive: for each experiment, for each repetition, its tally and steps, in exact floats."""
    steps: dict[Any, Any] = {}
    for row in found["step"]:
        own = {name: exact(row[name]) for name in STEP}
        steps.setdefault((row["experiment_id"], row["repetition"]), []).append(own)
    tallies = {
        (row["experiment_id"], row["number"]): {name: row[name] for name in TALLY} for row in found["repetition"]
    }
    return [
        [(tallies[each["id"], number], steps[each["id"], number]) for number in range(each["spec"]["repetitions"])]
        for each in found["experiment"]
    ]


def machine() -> Any:
    """What the last bits of floats depend on besides the code and its libraries."""
    simd = np.show_config(mode="dicts")["SIMD Extensions"]
    try:
        from llvmlite.binding import get_host_cpu_name  # what Numba compiles MuJoCo's contacts for
    except ImportError:
        compiled_for = "none"
    else:
        compiled_for = get_host_cpu_name()
    return {
        "architecture": platform.machine(),
        "C library": " ".join(platform.libc_ver()),
        "NumPy's SIMD": [*simd["baseline"], *simd["found"]],
        "LLVM's processor": compiled_for,
    }


def other_machine() -> Any:
    """What differs between this machine and that of the archives, as a sentence; "" if nothing does."""
    kept, here = json.loads(MACHINE.read_text()), machine()
    different = [name for name in kept if kept[name] != here[name]]
    return "; ".join(f"{name} is {here[name]} here, {kept[name]} there" for name in different)


def other_versions(found: Any) -> Any:
    """Libraries whose version differs from those that computed an archive, as a sentence; "" if none does."""
    used = found["provenance"][0]["facts"]
    libraries = used["libraries"] | dict(each.split() for each in used["engines"].values() if each.count(" ") == 1)
    here = {name: _version(name) for name in libraries}
    return "; ".join(f"{name} is {here[name]} here, {libraries[name]} there" for name in libraries
                     if here[name] != libraries[name])  # fmt: skip


def _version(library: Any) -> Any:
    for name in (library, f"{library}-core"):
        try:
            return version(name)
        except PackageNotFoundError:
            continue
    return "none"
