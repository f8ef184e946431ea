"""What the store promises about transactions and trouble."""

import os
import subprocess
import sys
import traceback
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from threading import Barrier
from typing import Any

import psycopg
import pytest
from sqlalchemy import event, text

from gaplab import migrations
from gaplab.services.experiments import listing
from gaplab.services.running import execution
from gaplab.services.store.database_errors import StoreUnavailable
from gaplab.services.store.engine import parse
from gaplab.services.store.queries.experiments import lock
from gaplab.services.store.session import Store
from tests.experiments import listed, same, some_log, submit_one, toy

OPEN_FILES = Path("/proc/self/fd")


class Killed(Exception):
    """Stands for the end of the process."""


def claim_anew(store: Store, claim: Any) -> Any:
    """The only repetition as the next supervisor finds it; handed back any number of times, it is never given up."""
    assert execution.hand_back(store, claim)
    (claim,) = execution.claim(store, "again", 1)
    return claim


def log_of(store: Store) -> Any:
    """The log of the only repetition, and a new claim of it."""
    execution.requeue_lost(store, stale_after_s=-1)  # even what was recorded within the clock's last millisecond
    (claim,) = execution.claim(store, "again", 1)
    return claim


@pytest.mark.parametrize("steps", [pytest.param(1, marks=pytest.mark.dialects), 2, 3, 4, 5])
def test_a_kill_between_any_two_statements_leaves_nothing_half_written(store: Store, steps: Any) -> None:
    submit_one(store, toy(repetitions=1))
    (claim,) = execution.claim(store, "me", 1)
    log = list(some_log())[: steps + 3]
    for step in log[:-1]:
        execution.record(store, claim, step)
    outcomes = []

    for count in range(9):
        with KilledAtStatement(store, count) as killed:
            outcomes.append(record_or_die(store, claim, log[-1]))
        if not killed:
            break
        claim = claim_anew(store, claim)
        assert same(claim.log, tuple(log[:-1]))

    assert outcomes[0] == "killed"
    assert outcomes[-1] == "recorded"
    assert same(log_of(store).log, tuple(log))


class KilledAtStatement:
    """Raises at the statement of that number, and says whether it did."""

    def __init__(self, store: Store, number: Any) -> None:
        self.engine, self.left, self.hits = store._engine, number, []  # type: ignore[var-annotated]

    def __enter__(self) -> Any:
        event.listen(self.engine, "before_cursor_execute", self.strike)
        return self.hits

    def __exit__(self, *error: Any) -> None:
        event.remove(self.engine, "before_cursor_execute", self.strike)

    def strike(self, connection: Any, cursor: Any, statement: Any, *rest: Any) -> None:
        if statement.startswith(("BEGIN", "SELECT 1")):
            return
        if self.left == 0:
            self.hits.append(statement)
            raise Killed
        self.left -= 1


def record_or_die(store: Store, claim: Any, step: Any) -> str:
    try:
        execution.record(store, claim, step)
    except Killed:
        return "killed"
    return "recorded"


CHILD = """
import sys
from gaplab.services.running import execution
from gaplab.services.store.session import Store
from tests.experiments import some_log
store = Store(sys.argv[1])
(claim,) = execution.claim(store, "child", 1)
for count, step in enumerate(some_log(30), start=1):
    execution.record(store, claim, step)
    print(count, flush=True)
"""


@pytest.mark.release
def test_what_was_acknowledged_survives_kill_9(sqlite_url: str, sqlite_store: Store) -> None:
    submit_one(sqlite_store, toy(repetitions=1, iterations=30))
    root = Path(__file__).parents[2]

    with subprocess.Popen([sys.executable, "-c", CHILD, sqlite_url], stdout=subprocess.PIPE, cwd=root) as child:
        acknowledged = [int(child.stdout.readline()) for _ in range(20)][-1]
        child.kill()

    log = log_of(sqlite_store).log
    assert len(log) >= acknowledged
    assert same(log, tuple(some_log(30))[: len(log)])


def test_on_sqlite_a_commit_returns_when_no_power_loss_can_undo_it(sqlite_store: Store) -> None:
    with sqlite_store.reading() as session:
        journal, synchronous = (session.scalar(text(f"PRAGMA {name}")) for name in ("journal_mode", "synchronous"))

    assert journal in {"persist", "wal"}
    assert synchronous == 2  # FULL


@pytest.mark.dialects
def test_a_commit_whose_answer_was_lost_is_delivered_again_without_harm(store: Store) -> None:
    submit_one(store, toy(repetitions=1))
    (claim,) = execution.claim(store, "me", 1)
    first, *_ = some_log()

    def lose_the_answer(session: Any) -> None:
        raise Killed

    event.listen(store._writer, "after_commit", lose_the_answer)
    with pytest.raises(Killed):
        execution.record(store, claim, first)
    event.remove(store._writer, "after_commit", lose_the_answer)

    assert execution.record(store, claim, first)
    assert same(log_of(store).log, (first,))


@pytest.mark.dialects
def test_writers_wait_for_each_other(store: Store) -> None:
    experiment = submit_one(store, toy()).id

    def rename(number: Any) -> None:
        with store.transaction() as session:
            session.execute(text("SELECT name FROM experiment"))
            session.execute(text("UPDATE experiment SET position = position + 1 WHERE id = :id"), {"id": experiment})

    with ThreadPoolExecutor(8) as pool:
        list(pool.map(rename, range(24)))

    with store.reading() as session:
        assert session.scalar(text("SELECT position FROM experiment")) == 24


def test_a_read_sees_one_moment(postgres_store: Store) -> None:
    with postgres_store.reading() as session:
        before = session.scalar(text("SELECT count(*) FROM experiment"))
        submit_one(postgres_store, toy())
        after = session.scalar(text("SELECT count(*) FROM experiment"))

    assert before == after == 0


def test_a_deadlock_is_tried_again(postgres_store: Store) -> None:
    ids = [submit_one(postgres_store, toy()).id for _ in range(2)]
    together, attempts = Barrier(2), []

    def lock_both(order: Any) -> Any:
        def work(session: Any) -> Any:
            first_time = order not in attempts
            attempts.append(order)
            lock(session, [order[0]])
            if first_time:
                together.wait(timeout=10)
            lock(session, [order[1]])
            return order

        return postgres_store.write(work)

    orders = [tuple(ids), tuple(reversed(ids))]
    with ThreadPoolExecutor(2) as pool:
        done = list(pool.map(lock_both, orders))

    assert done == orders
    assert len(attempts) >= 3


def test_the_store_recovers_from_lost_connections(postgres_store: Store) -> None:
    submit_one(postgres_store, toy())
    url = postgres_store._engine.url.set(drivername="postgresql").render_as_string(hide_password=False)

    with psycopg.connect(url, autocommit=True) as connection:
        connection.execute(
            "SELECT pg_terminate_backend(pid) FROM pg_stat_activity"
            " WHERE datname = current_database() AND pid <> pg_backend_pid()"
        )

    assert len(listed(postgres_store)) == 1


def test_a_connection_lost_in_the_midst_is_unavailability(postgres_store: Store) -> None:
    with pytest.raises(StoreUnavailable, match="cannot be used now"), postgres_store.transaction() as session:
        session.execute(text("SELECT pg_terminate_backend(pg_backend_pid())"))


@pytest.mark.parametrize("use", [listing.list_studies, lambda store: execution.claim(store, "me", 1)])
def test_to_have_no_connection_free_is_unavailability(sqlite_store: Store, use: Any) -> None:
    pool = sqlite_store._engine.pool
    pool._timeout = 0.01  # type: ignore[attr-defined]
    taken = [sqlite_store._engine.connect() for _ in range(pool.size() + pool._max_overflow)]  # type: ignore[attr-defined]

    with pytest.raises(StoreUnavailable, match="all connections"):
        use(sqlite_store)

    assert sqlite_store.errors == 1
    for each in taken:
        each.close()


def test_an_unreachable_database_is_unavailable_and_recovers_by_itself(tmp_path: Path) -> None:
    folder = tmp_path / "not-yet"
    url = f"sqlite:///{folder / 'gaplab.db'}"
    store = Store(url)

    with pytest.raises(StoreUnavailable, match="cannot be used now"):
        submit_one(store, toy())
    folder.mkdir()
    migrations.upgrade(url)

    assert submit_one(store, toy()).id
    store.dispose()


@pytest.mark.parametrize("use", [Store.check, listing.list_studies, lambda store: execution.claim(store, "me", 1)])
def test_an_unreachable_server_is_unavailable_and_the_message_has_no_password(use: Any) -> None:
    store = Store("postgresql://me:secret@127.0.0.1:1/none")

    with pytest.raises(StoreUnavailable) as caught:
        use(store)

    assert "secret" not in str(caught.value)


@pytest.mark.dialects
@pytest.mark.parametrize("use", [Store.check, lambda store: execution.claim(store, "me", 1)])
def test_a_database_without_the_schema_is_unavailable(database_url: str, use: Any) -> None:
    store = Store(database_url)

    with pytest.raises(StoreUnavailable):
        use(store)

    store.dispose()


def test_a_file_that_is_no_database_is_unavailable(tmp_path: Path) -> None:
    file = tmp_path / "gaplab.db"
    file.write_text("no database " * 1000)
    store = Store(f"sqlite:///{file}")

    with pytest.raises(StoreUnavailable):
        store.check()

    store.dispose()


@pytest.mark.parametrize("url", ["nonsense", "mysql://me@host/db", ""])
def test_a_url_of_no_known_database_is_refused(url: Any) -> None:
    with pytest.raises(StoreUnavailable):
        Store(url)


@pytest.mark.skipif(not OPEN_FILES.exists(), reason="only Linux tells which files a process has open")
def test_a_sort_in_sqlite_needs_no_folder_for_temporary_files(sqlite_store: Store) -> None:
    numbers = "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n WHERE i < 100000) "

    with sqlite_store.reading() as session:
        rows = session.execute(text(f"{numbers} SELECT hex(randomblob(50)) AS each FROM n ORDER BY each"))
        rows.fetchone()
        opened = [os.readlink(each) for each in OPEN_FILES.iterdir() if os.path.lexists(each)]

    assert not [name for name in opened if "etilqs" in name]  # as SQLite calls its temporary files


def test_sqlite_is_set_to_lose_nothing(sqlite_store: Store) -> None:
    with sqlite_store.reading() as session:
        found = {
            name: session.scalar(text(f"PRAGMA {name}")) for name in ("synchronous", "foreign_keys", "busy_timeout")
        }

    assert found == {"synchronous": 2, "foreign_keys": 1, "busy_timeout": 30_000}


@pytest.mark.parametrize(
    "url",
    [
        "postgresql://me:se@cret@db:5432/gaplab",
        "postgresql://me:x:se@cret:y@db/gaplab",
        "postgresql://me:x@cret#y@db/g",
    ],
)
def test_a_password_that_is_not_encoded_is_refused_without_a_part_of_it(url: str) -> None:
    with pytest.raises(StoreUnavailable, match="write @ as %40") as refused:
        Store(url)

    shown = "".join(traceback.format_exception(refused.value))
    assert "cret" not in shown
    assert "se@" not in shown


def test_a_password_that_is_encoded_arrives_as_it_is() -> None:
    assert parse("postgresql://me:p%40ss%2F%25@db/gaplab").password == "p@ss/%"
    assert parse("postgresql://me@/gaplab?host=/run/a@b").host is None
