"""`python -m benchmarks.time_left`: whether the interval of the time left of a study contains what it really took.

A real service computes a study of some minutes; every look at its progress is compared with its end.
"""

import time
from argparse import ArgumentParser
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from typing import NamedTuple

from rich.console import Console
from rich.table import Table

from gaplab.api.process.local_service import local_service
from gaplab.schemas.records import Progress

SPEC = {
    "name": "time left",
    "robot": "quadruped",
    "engine": "mujoco",
    "strategies": ["simulated_fit", "simulated_fit_and_informative", "random"],
    "budget": "smoke",
}

LOOK_S = 2.0
"""Seconds between two looks."""


class Look(NamedTuple):
    """A look at the progress, and the seconds since the submission."""

    at_s: float
    progress: Progress


def looks(iterations: int, repetitions: int) -> list[Look]:
    """Compute a study, and return the looks at its progress; the last one is at its end."""
    with TemporaryDirectory(prefix="gaplab-time-left-") as folder, local_service(Path(folder)) as client:
        found = client.submit(SPEC | {"iterations": iterations, "repetitions": repetitions})
        begun, seen = time.monotonic(), list[Look]()
        while True:
            study = client.find(found.id)
            seen.append(Look(time.monotonic() - begun, study.progress))
            if study.state.ended:
                return seen
            time.sleep(LOOK_S)


def main() -> None:
    """Compute the study, and print what its intervals were worth."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--iterations", type=int, default=5)
    parser.add_argument("--repetitions", type=int, default=6)
    arguments = parser.parse_args()
    seen = looks(arguments.iterations, arguments.repetitions)
    end = seen[-1].at_s
    table = Table(title=f"Time left of a study that took {end:.0f} s")
    for column in ("at", "really left", "estimate", "interval", "inside"):
        table.add_column(column, justify="right")
    told = [(look, look.progress.time_left) for look in seen[:-1]]
    known = [(look, interval, end - look.at_s) for look, interval in told if interval is not None]
    for look, interval, left in known[:: max(1, len(known) // 15)]:
        shown = f"{interval.low_s:.0f} to {interval.high_s:.0f} s"
        inside = "yes" if interval.low_s <= left <= interval.high_s else "no"
        table.add_row(
            f"{look.at_s:.0f} s", f"{left:.0f} s", f"{look.progress.seconds_left or 0.0:.0f} s", shown, inside
        )
    console = Console()
    console.print(table)
    if not known:
        console.print("The study ended before its time left was known; ask for more repetitions.")
        return
    right = sum(interval.low_s <= left <= interval.high_s for _, interval, left in known)
    off = median(abs((look.progress.seconds_left or 0.0) - left) / left for look, _, left in known)
    console.print(f"{right} of {len(known)} looks inside; known after {known[0][0].at_s:.0f} s; median error {off:.0%}")


if __name__ == "__main__":
    main()
