"""Evidence that the quadruped is worth tuning: each command prints one table of docs/robot.md.

The code of experiments computes all numbers, with addressed random streams, so a command always prints the same ones.
Ratios are to the direct baseline: the mean fitness of controllers evolved in reality on the same budget.
"""

from argparse import ArgumentParser, Namespace
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks.robot.laboratory import Laboratory
from benchmarks.robot.tables import gap, identifiable, known, smooth, stands, walks

COMMANDS: dict[str, Callable[[Laboratory, Namespace], None]] = {
    function.__name__: function for function in (stands, walks, gap, known, smooth, identifiable)
}


def main() -> None:
    """Print the requested tables; tables of one call share evolved controllers."""
    parser = ArgumentParser(prog="python -m benchmarks.robot", description=__doc__)
    parser.add_argument("tables", nargs="+", choices=COMMANDS)
    parser.add_argument("--seeds", type=int, default=10, help="controllers evolved in reality")
    parser.add_argument("--evaluations", type=int, default=2_000, help="evaluations of each search for a controller")
    parser.add_argument("--samples", type=int, nargs="+", default=[1, 3, 10], help="identifiable: numbers of samples")
    parser.add_argument("--tunings", type=int, default=3, help="identifiable: tunings with each number of samples")
    parser.add_argument("--tuning", type=int, default=2_000, help="identifiable: evaluations of a tuning")
    parser.add_argument("--keep", type=Path, help="folder for evolved controllers, shared with other calls")
    arguments = parser.parse_args()
    with TemporaryDirectory() as temporary:
        folder = arguments.keep or Path(temporary)
        folder.mkdir(parents=True, exist_ok=True)
        for name in arguments.tables:
            COMMANDS[name](Laboratory(arguments.evaluations, folder), arguments)


if __name__ == "__main__":
    main()
