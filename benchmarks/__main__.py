"""`python -m benchmarks`: the table of speeds. Compare ratios; absolute numbers depend on the machine."""

import argparse
import os
import platform
from collections.abc import Callable

from rich.console import Console
from rich.table import Table

from benchmarks import curves, mujoco, overhead, physics, physx, pool, savings, service, supervisor, turns
from benchmarks.measure import Row
from gaplab.services.engines.mujoco import MuJoCo
from gaplab.services.engines.physx import PhysX


def main() -> None:
    """Measure everything, and print one table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=5, help="rounds in which the parts of a ratio take turns")
    rounds = parser.parse_args().rounds
    console = Console()
    table = Table(title=f"gaplab on {os.cpu_count()} cores of {platform.machine()}, Python {platform.python_version()}")
    for column in ("figure", "value", "ratio", "to", "target"):
        table.add_column(column, justify="right" if column == "ratio" else "left")
    measurements: tuple[tuple[str, Callable[[], list[Row]]], ...] = (
        ("physics", lambda: physics.rows(rounds)),
        ("physx", lambda: physx.rows(rounds) if PhysX.available() else []),
        ("mujoco", lambda: mujoco.rows(rounds) if MuJoCo.available() else []),
        ("service", lambda: service.rows(max(2, rounds // 2))),
        ("pool", lambda: pool.rows(max(2, rounds // 2))),
        ("supervisor", supervisor.rows),
        ("savings", savings.rows),
        ("turns", turns.rows),
        ("overhead", overhead.rows),
        ("curves", curves.rows),
    )
    for name, measure in measurements:
        console.print(f"measuring {name} ...")
        for row in measure():
            table.add_row(*_cells(row))
            console.print("  " + ", ".join(filter(None, _cells(row))), style="dim", highlight=False)
    console.print(table)


def _cells(row: Row) -> tuple[str, ...]:
    shown = "" if row.ratio is None else f"{row.ratio:.3f}" if row.ratio < 0.1 else f"{row.ratio:.2f}"
    return row.figure, row.value, shown, row.reference, row.target


if __name__ == "__main__":
    main()
