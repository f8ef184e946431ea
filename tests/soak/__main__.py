"""`python -m tests.soak`: random faults on the real service, and whether it kept its word; exits with 1 if not."""

import argparse
import signal
import subprocess
import sys
import time
from functools import partial
from pathlib import Path
from random import SystemRandom
from statistics import median
from tempfile import TemporaryDirectory
from typing import Any

from rich.console import Console
from rich.table import Table

from tests.soak.databases import Postgres, Sqlite
from tests.soak.misbehaviour import HARMFUL, HARMLESS
from tests.soak.soak import soak

KINDS = {"sqlite": Sqlite, "postgres": Postgres}

MISBEHAVIOURS = {"none": (), "harmless": HARMLESS, "all": (*HARMLESS, *HARMFUL)}
"""Strategies that do harm, by the choice of the command."""

FAULT_S = 10.0
"""That a fault took on two cores, with what came after it, while the other database had its own."""


def main() -> Any:
    parser = argparse.ArgumentParser(prog="python -m tests.soak", description=__doc__)
    parser.add_argument("--faults", type=int, default=1000, help="in all; half of them on each database")
    parser.add_argument("--seed", type=int, help="left out: a new one")
    parser.add_argument("--database", choices=KINDS, help="left out: both at once, each in a process")
    parser.add_argument("--at-once", type=int, default=8, help="faults that may come together")
    parser.add_argument("--plug-ins", choices=MISBEHAVIOURS, default="all", help="that misbehave")
    parser.add_argument("--folder", type=Path, help="for logs and histories; left out: they are not kept")
    given = parser.parse_args()
    given.seed = SystemRandom().randrange(10**6) if given.seed is None else given.seed
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # what was started is ended
    with TemporaryDirectory(prefix="gaplab-soak-") as temporary:
        given.folder = given.folder or Path(temporary)
        return here(given) if given.database else side_by_side(given)


def here(given: Any) -> Any:
    """Hurt a service on one database."""
    console = Console()
    expected = given.faults * FAULT_S + 120
    console.print(f"{given.faults} faults with --seed {given.seed} on {given.database}: about {_duration(expected)}")
    folder = given.folder / given.database
    folder.mkdir(parents=True)
    kind, tell = KINDS[given.database], partial(console.print, style="dim", soft_wrap=True)
    harm = MISBEHAVIOURS[given.plug_ins]
    outcome = soak(folder, kind, given.faults, given.seed, given.at_once, tell, misbehaviours=harm)
    show(console, outcome)
    return 1 if outcome.violations else 0


def side_by_side(given: Any) -> Any:
    """Hurt a service on each database, in processes of their own."""
    common = ["--seed", str(given.seed), "--at-once", str(given.at_once), "--folder", str(given.folder)]
    common += ["--plug-ins", given.plug_ins]
    running = []
    try:
        for index, name in enumerate(KINDS):
            faults = str(_share(given.faults, index, len(KINDS)))
            command = [sys.executable, "-m", "tests.soak", "--database", name, "--faults", faults, *common]
            running.append(subprocess.Popen(command))
        codes = [each.wait() for each in running]
        return int(any(codes))  # of one that a signal ended it is negative
    finally:
        for each in running:
            each.terminate()
        for each in running:
            each.wait()


def show(console: Any, outcome: Any) -> None:
    """The figures of an outcome, and what was violated."""
    table = Table(title=f"{outcome.database}: {outcome.faults} faults in {_duration(time.monotonic() - outcome.begun)}")
    for column in ("fault", "times", "all others progress again after: median", "worst"):
        table.add_column(column, justify="left" if column == "fault" else "right")
    every = [each for times in outcome.recoveries.values() for each in times]
    for name, seconds in [*sorted(outcome.recoveries.items()), *([("all", every)] if every else [])]:
        table.add_row(name, str(len(seconds)), f"{median(seconds):.1f} s", f"{max(seconds):.1f} s")
    console.print(table)
    console.print(
        f"{outcome.acknowledged} acknowledged writes and {outcome.unanswered} without an answer, "
        f"{outcome.experiments} experiments, {outcome.at_fault} of them at fault, "
        f"{outcome.steps} steps, {outcome.claims} claims, {outcome.given_up} repetitions given up; "
        f"violations: {len(outcome.violations)}"
    )
    for each in outcome.violations:
        console.print(f"  {each}", markup=False, highlight=False)


def _share(number: Any, index: Any, parts: Any) -> Any:
    return number // parts + (index < number % parts)


def _duration(seconds: Any) -> Any:
    minutes = round(seconds / 60)
    return f"{minutes // 60} h {minutes % 60} min" if minutes >= 60 else f"{minutes} min"


if __name__ == "__main__":
    sys.exit(main())
