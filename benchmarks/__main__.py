"""`python -m benchmarks`: the table of speeds. Compare ratios; absolute numbers depend on the machine."""

import argparse
import os
import platform
from collections.abc import Callable

from rich.console import Console
from rich.table import Table

from benchmarks import encoders, engines, service
from benchmarks.measure import Row

MEASUREMENTS: dict[str, Callable[[int], list[Row]]] = {
    "engines": engines.rows,
    "encoders": encoders.rows,
    "service": lambda rounds: service.rows(max(2, rounds // 2)),
}


def main() -> None:
    """Measure, and print one table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("names", nargs="*", help=f"of {', '.join(MEASUREMENTS)}; default: all")
    parser.add_argument("--rounds", type=int, default=5, help="rounds in which the parts of a ratio take turns")
    arguments = parser.parse_args()
    if unknown := set(arguments.names) - set(MEASUREMENTS):
        parser.error(f"no measurement is called {', '.join(sorted(unknown))}")
    console = Console()
    title = f"gaplab on {os.cpu_count()} cores of {platform.machine()}, Python {platform.python_version()}"
    table = Table("figure", "value", "ratio", "to", "target", title=title)
    for name in arguments.names or MEASUREMENTS:
        console.print(f"measuring {name} ...")
        for row in MEASUREMENTS[name](arguments.rounds):
            cells = row.figure, row.value, f"{row.ratio:.3g}", row.reference, row.target
            table.add_row(*cells)
            console.print("  " + ", ".join(filter(None, cells)), style="dim", highlight=False)
    console.print(table)


if __name__ == "__main__":
    main()
