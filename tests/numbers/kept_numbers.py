"""The kept archives, read without gaplab: what they hold cannot change with the code under test."""

import json
import platform
from importlib.metadata import PackageNotFoundError, version
from io import BytesIO
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import numpy as np
import pyarrow.parquet

FOLDER = Path(__file__).parent / "kept"
MACHINE = FOLDER / "machine.json"
HALF_WAY = FOLDER / "half-way.db.xz"

ITERATION = (
    *("selected_genome", "selection_rollouts", "selection_failures", "selection_saved"),
    *("tuning_rollouts", "tuning_failures", "tuning_saved"),
    *("transferred_genome", "simulated_fitness"),
    *("transfer_rollouts", "transfer_failures", "transfer_saved"),
    "recorded_fitness",
)
NUMBERS = {
    "repetition": ("steps", "iterations_done", "rollouts_done", "rollouts_failed", "rollouts_saved"),
    "iteration": ("number", *ITERATION),
    "measurement": ("iteration", "kind", "genome", "fitness"),
    "simulator": ("iteration", "rank", "parameters", "squared_error"),
}
"""Tables of an archive, with the columns that follow from the spec; times, owners and attempts do not."""


def archive(name: Any) -> Any:
    """The bytes of a kept archive."""
    return (FOLDER / f"{name}.zip").read_bytes()


def members(data: Any) -> Any:
    """The members of an archive, by their names without ending: rows as dictionaries; JSON as it is."""
    with ZipFile(BytesIO(data)) as opened:
        return {each.partition(".")[0]: _content(each, opened.read(each)) for each in opened.namelist()}


def _content(name: Any, data: Any) -> Any:
    if name.endswith(".parquet"):
        return pyarrow.parquet.read_table(BytesIO(data)).to_pylist()
    if name.endswith(".jsonl"):
        return [json.loads(line) for line in data.splitlines()]
    return json.loads(data)


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
    """The numbers of an archive: for each experiment, for each repetition, for each table its rows, in exact floats."""
    experiments = found["experiment"]
    repetitions: dict[str, list[dict[str, Any]]] = {
        each["id"]: [{} for _ in range(each["spec"]["repetitions"])] for each in experiments
    }
    for table, columns in NUMBERS.items():
        for row in found[table]:
            owner = row["experiment_id" if table == "repetition" else "experiment"]
            number = row["number" if table == "repetition" else "repetition"]
            repetitions[owner][number].setdefault(table, []).append({each: exact(row[each]) for each in columns})
    return [repetitions[each["id"]] for each in experiments]


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
