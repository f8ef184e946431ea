"""Kill matrix: the process that computes and stores is killed at every named point, and another one goes on.

`python -m tests.kill_matrix` prints points × databases with how many kills of each ended in the results of an
uninterrupted run: the same rows to the last bit, no sample twice, none lost. The supervisor, the repetitions and the
store are the real ones; only Ray is left out, so that repetitions run within the process that is killed.
"""

import argparse
import os
import signal
import sys
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from hashlib import sha256
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory
from typing import Any

from rich.console import Console
from rich.table import Table
from sqlalchemy import select
from sqlalchemy.engine.default import DefaultDialect

from gaplab.services.core import loop
from gaplab.services.running import execution
from gaplab.services.store.models import CheckpointRow, RepetitionRow, StepRow
from gaplab.services.store.queries import checkpoints, steps
from gaplab.services.store.session import Store
from gaplab.workers.checkpoints import StepRecorder
from gaplab.workers.repetitions import Repetitions
from tests.equal_databases import Databases
from tests.postgres import running
from tests.without_ray import SPEC, work

CHANCE = {"owner", "epoch", "attempts", "losses", "error", "seconds"}
CHANCE |= {"heartbeat_at", "started_at", "ended_at", "at"}
"""Columns that say how it went, and not what came of it."""

Wrap = Callable[[Callable[[], None], Callable[[], None]], None]
"""Puts what happens before and after a function into it."""


def around(owner: object, name: str) -> Wrap:
    """Of a function that is looked up by this name where it is called."""

    def wrap(before: Callable[[], None], after: Callable[[], None]) -> None:
        function = getattr(owner, name)

        def wrapped(*arguments: Any, **named: Any) -> Any:
            before()
            result = function(*arguments, **named)
            after()
            return result

        setattr(owner, name, wrapped)

    return wrap


POINTS: dict[str, Wrap] = {
    "claim": around(execution, "claim"),
    "compute": around(loop, "next_step"),
    "checkpoint is made": around(StepRecorder, "_checkpoint"),
    "checkpoint is written": around(checkpoints, "write"),
    "steps are written": around(steps, "record"),
    "commit": around(DefaultDialect, "do_commit"),
    "acknowledgement": around(Repetitions, "store_received"),
    "heartbeat": around(execution, "heartbeat"),
    "completion": around(execution, "complete"),
    "hand back": around(execution, "hand_back"),
    "requeue of what was lost": around(execution, "requeue_lost"),
}
"""Where the process may die; each of them before and after."""


def in_a_child(task: Callable[[], None]) -> int:
    """Run it in a process of its own; the exit code, or the signal that killed it as a negative number."""
    sys.stdout.flush()
    child = os.fork()
    if not child:
        try:
            task()
            os._exit(0)
        except BaseException:  # noqa: BLE001 - the child must not go on as its parent
            sys.excepthook(*sys.exc_info())
            os._exit(1)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


def occurrences(url: str) -> dict[str, int]:
    """How often an uninterrupted run passes each point; it is run."""
    reading, writing = os.pipe()

    def task() -> None:
        counts = dict.fromkeys(POINTS, 0)

        def passed(name: str) -> Callable[[], None]:
            return lambda: counts.update({name: counts[name] + 1})

        for name, wrap in POINTS.items():
            wrap(passed(name), lambda: None)
        work(url)
        os.write(writing, " ".join(str(each) for each in counts.values()).encode())

    assert in_a_child(task) == 0
    return dict(zip(POINTS, map(int, os.read(reading, 4096).split()), strict=True))


def killed(url: str, point: str, when: str, occurrence: int) -> bool:
    """Run until the process kills itself there; False if it did not get there."""

    def task() -> None:
        left = occurrence

        def die() -> None:
            nonlocal left
            left -= 1
            if not left:
                os.kill(os.getpid(), signal.SIGKILL)

        before, after = (die, lambda: None) if when == "before" else (lambda: None, die)
        POINTS[point](before, after)
        work(url)

    return in_a_child(task) == -signal.SIGKILL


def results(url: str) -> str:
    """A hash of all results: everything but times, owners and attempts."""
    store = Store(url)
    digest = sha256()
    with store.reading() as session:
        for table in (RepetitionRow, StepRow, CheckpointRow):
            columns = [each for each in table.__table__.columns if each.name not in CHANCE]
            for row in session.execute(select(*columns).order_by(*table.__table__.primary_key)):
                digest.update(repr(tuple(row)).encode())
    store.dispose()
    return digest.hexdigest()


def spread(total: int, wanted: int) -> list[int]:
    """So many occurrences of `total`, evenly over all of them."""
    if total <= wanted:
        return list(range(1, total + 1))
    return [1 + int((each + 0.5) * total / wanted) for each in range(wanted)]


def survived(databases: Databases, point: str, when: str, occurrence: int, expected: str) -> bool:
    """Whether a kill there was one, and left no trace in the results.

    Repetitions that end at the same time complete together, so a point may be passed less often than it was counted. It
    is then killed where it is passed the last time.
    """
    url = databases.new()
    if not killed(url, point, when, occurrence):
        databases.drop(url)
        return occurrence > 1 and survived(databases, point, when, occurrence - 1, expected)
    went_on = in_a_child(lambda: work(url)) == 0
    found = results(url)
    databases.drop(url)
    return went_on and found == expected


CASES = [(point, when) for point in POINTS for when in ("before", "after")]


def rows(
    databases: Databases, kills: int, cases: Sequence[tuple[str, str]] = CASES
) -> dict[tuple[str, str], tuple[int, int]]:
    """For each point, before and after: kills that were survived, and all of them."""
    url = databases.new()
    totals = occurrences(url)
    expected = results(url)
    databases.drop(url)
    return {
        (point, when): (
            sum(survived(databases, point, when, each, expected) for each in spread(totals[point], kills)),
            len(spread(totals[point], kills)),
        )
        for point, when in cases
    }


def main() -> int:
    """Print the table; 1 if a kill was not survived, or a point never passed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kills", type=int, default=10, help="at each point, spread over a whole run")
    parser.add_argument("--once", action="store_true", help="each point before or after, drawn from a fixed seed")
    parser.add_argument("--only", choices=("SQLite", "Postgres"), help="left out: both")
    parser.add_argument("--postgres", help="URL of a running server; left out: one is started")
    parser.add_argument("--folder", type=Path, help="for the SQLite files; left out: a temporary one")
    arguments = parser.parse_args()
    draw = Random(1)
    cases = [(point, draw.choice(("before", "after"))) for point in POINTS] if arguments.once else CASES
    with ExitStack() as stack:
        folder = arguments.folder or Path(stack.enter_context(TemporaryDirectory()))
        found = {}
        for name in (arguments.only,) if arguments.only else ("SQLite", "Postgres"):
            on_postgres = name == "Postgres"
            server = (arguments.postgres or stack.enter_context(running(folder))) if on_postgres else None
            databases = Databases(folder, server, SPEC)
            found[name] = rows(databases, arguments.kills, cases)
            databases.close()
    table = Table("killed", *found, title="kills survived with equal results")
    for point, when in next(iter(found.values())):
        cells = [found[name][point, when] for name in found]
        table.add_row(f"{when} {point}", *(f"{good} of {all_of_them}" for good, all_of_them in cells))
    counts = [cell for each in found.values() for cell in each.values()]
    table.add_row("all", f"{sum(good for good, _ in counts)} of {sum(total for _, total in counts)}")
    Console(width=80).print(table)
    return 0 if all(good == total > 0 for good, total in counts) else 1


if __name__ == "__main__":
    sys.exit(main())
