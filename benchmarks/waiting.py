"""`python -m benchmarks.waiting`: what 10 000 repetitions cost that wait for a robot on a bench.

Processor time and memory of a supervisor's look at the database, and the list of requests, beside the same with 50
waiting, and with none; on SQLite and Postgres.
"""

import tracemalloc
from argparse import ArgumentParser
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from time import perf_counter, process_time

from rich.console import Console
from rich.table import Table
from sqlalchemy import insert, select, update

from gaplab import migrations
from gaplab.schemas.lifecycle import State
from gaplab.schemas.records import MeasurementKind
from gaplab.schemas.spec import ExperimentSpec
from gaplab.services.bench import taking
from gaplab.services.bench.taking import RequestFilter
from gaplab.services.experiments.states import settle
from gaplab.services.experiments.submission import submit_experiment
from gaplab.services.running import execution
from gaplab.services.store.models import RepetitionRow, RequestRow
from gaplab.services.store.session import Store
from tests.postgres import running

SPEC = {
    "strategy": "random",
    "robot": "toy_function",
    "budget": "smoke",
    "iterations": 2,
    "reality": {"kind": "physical"},
}

ROUNDS = 100


def wait(store: Store, number: int) -> None:
    """Let a number of repetitions wait, each for its first sample."""
    experiment = submit_experiment(store, ExperimentSpec.model_validate(SPEC | {"repetitions": number}))
    with store.transaction() as session:
        ids = session.scalars(select(RepetitionRow.id).where(RepetitionRow.experiment_id == experiment.id)).all()
        session.execute(update(RepetitionRow).where(RepetitionRow.id.in_(ids[:30_000])).values(state=State.WAITING))
        rows = [
            {"id": f"r{id_}", "repetition_id": id_, "place": 4, "iteration": 1, "kind": MeasurementKind.SAMPLE}
            | {"genome": [0.5], "bench": f"bench {id_ % 50}", "takes": 0, "unanswered": 0}
            for id_ in ids
        ]
        session.execute(insert(RequestRow), rows)
        settle(session, [experiment.id])
        session.connection().exec_driver_sql("ANALYZE")


def look(store: Store) -> None:
    """Do what a supervisor does when nothing can be computed."""
    execution.claim(store, "benchmark", 2)
    execution.requeue_lost(store)
    taking.open_again(store)


def measured(work: Callable[[], object]) -> tuple[float, float, float]:
    """Return medians of seconds and of processor seconds, and the peak of memory in megabytes."""
    work()
    seconds, busy = [], []
    for _ in range(ROUNDS):
        begun, worked = perf_counter(), process_time()
        work()
        seconds.append(perf_counter() - begun)
        busy.append(process_time() - worked)
    tracemalloc.start()
    work()
    peak = tracemalloc.get_traced_memory()[1] / 1e6
    tracemalloc.stop()
    return median(seconds), median(busy), peak


def _on(kind: str, number: int) -> dict[str, tuple[float, float, float]]:
    """Return what each look costs on a new database of a kind in which `number` repetitions wait."""
    with ExitStack() as stack:
        folder = Path(stack.enter_context(TemporaryDirectory(prefix="gaplab-waiting-")))
        url = f"sqlite:///{folder / 'gaplab.db'}" if kind == "sqlite" else stack.enter_context(running(folder))
        migrations.upgrade(url)
        store = Store(url)
        stack.callback(store.dispose)
        if number:
            wait(store, number)
        return {
            "a supervisor's look": measured(lambda: look(store)),
            "the first 50 requests": measured(lambda: taking.list_requests(store, RequestFilter())),
            "those of one bench": measured(lambda: taking.list_requests(store, RequestFilter(bench="bench 7"))),
        }


def main() -> None:
    """Measure on both databases, and print one table."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--waiting", type=int, default=10_000)
    waiting = parser.parse_args().waiting
    table = Table(title=f"{waiting:,} repetitions that wait, beside 50 and none")
    columns = "database", "what", "none", "50", f"{waiting:,}", "to 50", "processor, to 50", "to none", "peak memory"
    for column in columns:
        table.add_column(column, justify="right" if column != "what" else "left")
    for kind in ("sqlite", "postgres"):
        none, few, many = (_on(kind, number) for number in (0, 50, waiting))
        for name in few:
            milliseconds = [f"{1000 * found[name][0]:.2f} ms" for found in (none, few, many)]
            ratios = [f"{many[name][place] / few[name][place]:.2f}" for place in (0, 1)]
            to_none = f"{many[name][0] / none[name][0]:.2f}"
            memory = f"{none[name][2]:.2f}, {few[name][2]:.2f} and {many[name][2]:.2f} MB"
            table.add_row(kind, name, *milliseconds, *ratios, to_none, memory)
    Console(width=140).print(table)


if __name__ == "__main__":
    main()
