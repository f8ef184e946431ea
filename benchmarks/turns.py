"""Duration of a claim while 10 000 experiments of 40 repetitions wait, or only one, on SQLite and Postgres."""

from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter

from sqlalchemy import insert, text

from benchmarks.measure import Row
from gaplab import migrations
from gaplab.schemas.spec import ExperimentSpec
from gaplab.services.experiments import submission
from gaplab.services.running import execution
from gaplab.services.store.clock import now
from gaplab.services.store.models import ExperimentRow, RepetitionRow
from gaplab.services.store.session import Store
from tests.postgres import running

WAITING = 10_000
REPETITIONS = 40
CLAIMS = 20
"""Number of timed claims, for the median."""

SPEC = ExperimentSpec.model_validate({"strategy": "random", "robot": "toy_function", "budget": "smoke"})


def fill(store: Store, count: int) -> None:
    """Submit one experiment, and insert copies of it."""
    original = submission.submit_experiment(store, SPEC).id
    if not count:
        return
    with store.transaction() as session:
        spec = session.get_one(ExperimentRow, original).spec
        ids = [f"bench{each}" for each in range(count)]
        common = {"position": 0, "name": "x", "strategy": "random", "spec": spec, "iterations": 3, "rollouts": 100}
        session.execute(insert(ExperimentRow).values(created_at=now()), [{"id": each} | common for each in ids])
        for number in range(REPETITIONS):
            session.execute(insert(RepetitionRow), [{"experiment_id": each, "number": number} for each in ids])
        session.execute(text("ANALYZE"))  # Postgres does it itself within a minute


def milliseconds(store: Store) -> Sequence[float]:
    """Return the sorted durations of claims of four repetitions, each of which is then released."""
    measured = []
    for _ in range(CLAIMS):
        begun = perf_counter()
        claims = execution.claim(store, "bench", 4)
        measured.append(1000 * (perf_counter() - begun))
        for claim in claims:
            execution.hand_back(store, claim)
    return sorted(measured)


def rows() -> list[Row]:
    """Measure the median duration of a claim."""
    measured = []
    with TemporaryDirectory() as folder, running(Path(folder)) as server:
        for database, url in (("SQLite", f"sqlite:///{Path(folder) / 'bench.db'}"), ("Postgres", server)):
            migrations.upgrade(url)
            store = Store(url)
            for more in (0, WAITING):
                fill(store, more)
                median = milliseconds(store)[CLAIMS // 2]
                measured.append(Row(f"a claim of 4 while {more + 1} experiments wait, {database}", f"{median:.1f} ms"))
            store.dispose()
    return measured


if __name__ == "__main__":
    for row in rows():
        print(row.figure, row.value)
