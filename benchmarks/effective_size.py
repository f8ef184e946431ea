"""Effective sizes of the stored ensembles of archives, with and without a floor: `… effective_size ARCHIVE.zip …`."""

import sys
from collections import defaultdict
from collections.abc import Iterator, Sequence
from io import BytesIO
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import numpy as np
import pyarrow.parquet

from gaplab.services.core.scoring import NO_FLOOR, effective_size, simulator_weights

SHARES = (0.0, 0.01, 0.02, 0.03, 0.05, 0.1)
LEAST_ERROR = 0.03
"""The floor of before, in the unit of fitness."""

SAMPLES = (1, 2, 3, 5)


def effective_sizes(archive: bytes) -> dict[str, list[float]]:
    """Return the median effective size of ensembles after each number of samples, by floor."""
    with ZipFile(BytesIO(archive)) as opened:
        tables = {name: _rows(opened.read(f"{name}.parquet")) for name in ("iteration", "simulator")}
    scales = {(row["experiment"], row["repetition"]): row["simulated_fitness"]
              for row in tables["iteration"] if row["number"] == 0}  # fmt: skip
    ensembles: dict[tuple[str, int, int], list[float]] = defaultdict(list)
    for row in tables["simulator"]:
        error = np.inf if row["squared_error"] is None else row["squared_error"]
        ensembles[row["experiment"], row["repetition"], row["iteration"]].append(error)
    floors = {f"least_share {share:g}": share for share in SHARES} | {f"least_error {LEAST_ERROR:g}": None}
    return {
        name: [float(np.median(list(_sizes(ensembles, scales, share, count)))) for count in SAMPLES]
        for name, share in floors.items()
    }


def _rows(member: bytes) -> Sequence[dict[str, Any]]:
    rows: Sequence[dict[str, Any]] = pyarrow.parquet.read_table(BytesIO(member)).to_pylist()
    return rows


def _sizes(ensembles: Any, scales: Any, share: float | None, count: int) -> Iterator[float]:  # noqa: ANN401 - JSON
    for (experiment, repetition, iteration), errors in ensembles.items():
        if iteration == count and len(errors) > 1:
            error = LEAST_ERROR if share is None else share * scales[experiment, repetition]
            yield effective_size(simulator_weights(np.array(errors), max(error**2, NO_FLOOR)))


if __name__ == "__main__":
    for file in sys.argv[1:]:
        print(file, "after", *SAMPLES, "samples")
        for name, sizes in effective_sizes(Path(file).read_bytes()).items():
            print(f"  {name:18}", *(f"{size:5.1f}" for size in sizes))
