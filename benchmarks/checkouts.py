"""Whether rollouts cost what they cost in another checkout: `python -m benchmarks.checkouts FOLDER`.

Processes of this checkout, of the other, and of the other once more take turns at the same rollouts of the quadruped,
of which nothing is read. Printed are ratios of processor times; that of the other and itself says what is noise. One
process differs from the next of the same code by up to 2 %, so that many begin anew.
"""

import os
import sys
from argparse import ArgumentParser
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from subprocess import PIPE, Popen

import numpy as np
from scipy import stats

from gaplab.services.core.arrays import FloatArray

HERE = Path(__file__).parents[1]
ENGINES = ("PyBullet", "MuJoCo", "PhysX")
ROUNDS = 12
CHILD = """
import sys
from time import process_time
from benchmarks import engines

work = engines.through_simulate(getattr(engines, sys.argv[1])())
for _ in sys.stdin:
    begun = process_time()
    work()
    print(process_time() - begun, flush=True)
"""


@contextmanager
def _process(checkout: Path, engine: str) -> Iterator[Popen[str]]:
    paths = os.pathsep.join(map(str, (checkout / "src", checkout)))
    command = [sys.executable, "-c", CHILD, engine]
    with Popen(command, cwd=checkout, env=os.environ | {"PYTHONPATH": paths}, stdin=PIPE, stdout=PIPE, text=True) as it:
        yield it


def _seconds(process: Popen[str]) -> float:
    assert process.stdin is not None
    assert process.stdout is not None
    print(file=process.stdin, flush=True)
    return float(process.stdout.readline())


def seconds(checkouts: list[Path], engine: str) -> FloatArray:
    """Return `(c,)`: median seconds of the processor by checkout, of a process of each; a first round warms up only."""
    with ExitStack() as stack:
        processes = [stack.enter_context(_process(each, engine)) for each in checkouts]
        taken = [[_seconds(each) for each in processes] for _ in range(ROUNDS + 1)]
    return np.asarray(np.median(taken[1:], axis=0))


def more(ours: FloatArray, theirs: FloatArray) -> str:
    """Return by how much the median of the ratio is above 1, with its 95 % interval."""
    ratios = ours / theirs
    interval = stats.bootstrap([ratios], np.median, method="percentile", rng=0).confidence_interval
    return f"{np.median(ratios) - 1:+.2%} ({interval.low - 1:+.2%} to {interval.high - 1:+.2%})"


def main() -> None:
    """Print the ratios of each engine."""
    parser = ArgumentParser(prog="python -m benchmarks.checkouts", description=__doc__)
    parser.add_argument("checkout", type=Path, metavar="FOLDER")
    parser.add_argument("engines", nargs="*", default=ENGINES, help=f"of {', '.join(ENGINES)}; default: all")
    parser.add_argument("--processes", type=int, default=20, help="of each checkout, for each engine; default: 20")
    given = parser.parse_args()
    other = given.checkout.resolve()
    for engine in given.engines:
        ours, theirs, again = np.transpose([seconds([HERE, other, other], engine) for _ in range(given.processes)])
        print(f"{engine}: {more(ours, theirs)}; the other and itself: {more(again, theirs)}", flush=True)


if __name__ == "__main__":
    main()
