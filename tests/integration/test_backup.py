"""A copy of a database that is in use: it is whole, it is of one moment, and it goes on computing."""

import os
import sqlite3
import subprocess
from pathlib import Path
from threading import Event, Thread
from typing import Any

import pytest

from gaplab.schemas.lifecycle import State
from gaplab.services.core.loop import repetition
from gaplab.services.experiments import listing
from gaplab.services.results import curves
from gaplab.services.running import execution
from gaplab.services.specs.assembly import setting
from gaplab.services.store import backup as backing_up
from gaplab.services.store.backup import backup
from gaplab.services.store.database_errors import StoreUnavailable, Unsupported
from gaplab.services.store.session import Store
from tests.commands import Gaplab
from tests.experiments import listed, submit_one, toy


def work(store: Store) -> None:
    """A supervisor of one: steps are recorded as they are computed, until nothing is queued."""
    while claims := execution.claim(store, "me", 1):
        for claim in claims:
            for step in repetition(setting(claim.spec, claim.number), claim.log):
                assert execution.record(store, claim, step)
            assert execution.complete(store, claim)


@pytest.mark.release
def test_copies_made_while_a_supervisor_writes_go_on_to_the_same_end(sqlite_url: str, tmp_path: Path) -> None:
    store = Store(sqlite_url)
    submitted = submit_one(store, toy(repetitions=2)).id
    worker = Thread(target=work, args=(store,))
    worker.start()
    copies: list[Any] = []
    while worker.is_alive() or not copies:
        copies.append(tmp_path / f"copy_{len(copies)}.db")
        backup(sqlite_url, copies[-1])
    worker.join()
    end = curves.curve(store, submitted)
    store.dispose()

    assert end.state is State.COMPLETED
    for file in {copies[0], copies[len(copies) // 2]}:
        with sqlite3.connect(file) as connection:
            assert connection.execute("PRAGMA integrity_check").fetchall() == [("ok",)]
        connection.close()
        copy = Store(f"sqlite:///{file}")
        copy.check()
        execution.requeue_lost(copy, stale_after_s=-1)
        work(copy)
        assert curves.curve(copy, submitted) == end
        copy.dispose()


def test_a_copy_waits_for_whoever_writes_and_has_all_of_it_or_nothing(sqlite_url: str, tmp_path: Path) -> None:
    store = Store(sqlite_url)
    half_way, made = Event(), []

    def copy() -> None:
        half_way.wait()
        made.append(backup(sqlite_url, tmp_path / "copy.db"))

    copying = Thread(target=copy)
    copying.start()
    submit_one(store, toy())
    with store.transaction() as session:
        session.connection().exec_driver_sql("UPDATE experiment SET name = 'written'")
        half_way.set()
    copying.join()
    store.dispose()

    copied = Store(f"sqlite:///{tmp_path / 'copy.db'}")
    names = [each.name for each in listed(copied)]
    copied.dispose()
    assert names in (["written"], ["simulated_fit"])
    assert made == [(tmp_path / "copy.db").stat().st_size]


def test_only_the_owner_may_read_a_copy_and_nothing_else_is_left(sqlite_url: str, tmp_path: Path) -> None:
    backup(sqlite_url, tmp_path / "copy.db")

    assert (tmp_path / "copy.db").stat().st_mode & 0o777 == 0o600
    assert [each.name for each in tmp_path.iterdir()] == ["copy.db"]


def with_space_left(url: str) -> Path:
    """Store two megabytes in a database, delete them, and return its file: it stays large."""
    file = Path(url.removeprefix("sqlite:///"))
    with sqlite3.connect(file) as connection:
        connection.execute("CREATE TABLE large AS SELECT randomblob(2000000) AS content")
    with connection:
        connection.execute("DROP TABLE large")
    connection.close()
    return file


def test_a_copy_lacks_the_space_that_deletion_left(sqlite_url: str, tmp_path: Path) -> None:
    store = Store(sqlite_url)
    submit_one(store, toy())
    file = with_space_left(sqlite_url)

    size = backup(sqlite_url, tmp_path / "copy.db")

    copy = Store(f"sqlite:///{tmp_path / 'copy.db'}")
    copy.check()
    assert file.stat().st_size > 2_000_000 > 2 * size
    assert listing.list_studies(copy) == listing.list_studies(store)
    assert (tmp_path / "copy.db").stat().st_mode & 0o777 == 0o600
    copy.dispose()
    store.dispose()


def test_a_file_that_is_there_stays_as_it_is(sqlite_url: str, tmp_path: Path) -> None:
    file = tmp_path / "precious.db"
    file.write_text("precious")

    with pytest.raises(FileExistsError):
        backup(sqlite_url, file)

    assert file.read_text() == "precious"


def test_without_a_database_none_is_made(tmp_path: Path) -> None:
    with pytest.raises(StoreUnavailable, match="no database"):
        backup(f"sqlite:///{tmp_path / 'none.db'}", tmp_path / "copy.db")

    assert list(tmp_path.iterdir()) == []


def test_what_is_no_database_is_not_copied(tmp_path: Path) -> None:
    (tmp_path / "text.db").write_text("this is not a database" * 100)

    with pytest.raises(StoreUnavailable, match="not a database"):
        backup(f"sqlite:///{tmp_path / 'text.db'}", tmp_path / "copy.db")

    assert [each.name for each in tmp_path.iterdir()] == ["text.db"]


def test_of_postgres_it_says_what_copies_one(tmp_path: Path) -> None:
    with pytest.raises(Unsupported, match="pg_dump --format=custom") as refusal:
        backup("postgresql://me:secret@127.0.0.1/gaplab", tmp_path / "copy")

    assert "secret" not in str(refusal.value)


@pytest.mark.parametrize("scheme", ["postgresql", "postgresql+psycopg"])
def test_the_line_that_copies_a_postgres_has_a_url_that_its_tool_knows(tmp_path: Path, scheme: Any) -> None:
    environment = os.environ | {"GAPLAB_DATABASE_URL": f"{scheme}://me:a:b@127.0.0.1/gaplab"}
    with pytest.raises(Unsupported) as refusal:
        backup("postgresql+psycopg://me:secret@127.0.0.1/gaplab", tmp_path / "my copy")

    line = str(refusal.value)[str(refusal.value).index("pg_dump") :].replace("pg_dump", "printf '%s\\n'", 1)
    done = subprocess.run(["sh", "-c", line], env=environment, capture_output=True, text=True, check=True)

    assert done.stdout.splitlines()[1:] == [f"--file={tmp_path / 'my copy'}", "postgresql://me:a:b@127.0.0.1/gaplab"]


@pytest.mark.parametrize(("existing", "code"), [(False, 0), (True, 7)])
def test_the_command_copies_the_database_of_the_environment(
    sqlite_url: str, tmp_path: Path, gaplab: Gaplab, existing: Any, code: Any
) -> None:
    file = tmp_path / "copy.db"
    if existing:
        file.touch()

    said = gaplab("backup", str(file), GAPLAB_DATABASE_URL=sqlite_url)

    assert said.code == code
    assert str(file) in (said.out if code == 0 else said.err)


def test_a_file_that_appears_meanwhile_is_not_written_over(
    sqlite_url: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    copied = backing_up.copy_checked

    def slowly(source: Any, part: Any) -> None:
        copied(source, part)
        (tmp_path / "copy.db").write_text("mine")

    monkeypatch.setattr(backing_up, "copy_checked", slowly)

    with pytest.raises(FileExistsError, match="there already"):
        backing_up.backup(sqlite_url, tmp_path / "copy.db")

    assert [each.read_text() for each in tmp_path.iterdir()] == ["mine"]


def test_what_a_copy_left_that_was_killed_is_in_no_ones_way(
    sqlite_url: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Killed(BaseException):
        """Stands for a death after which nothing is tidied up."""

    def die(*_: Any) -> None:
        raise Killed

    with monkeypatch.context() as patch:
        patch.setattr(backing_up, "copy_checked", die)
        patch.setattr("pathlib.Path.unlink", lambda *_, **__: None)
        with pytest.raises(Killed):
            backup(sqlite_url, tmp_path / "copy.db")
    left = list(tmp_path.iterdir())

    assert backup(sqlite_url, tmp_path / "copy.db") == (tmp_path / "copy.db").stat().st_size
    assert len(left) == 1
    assert {*tmp_path.iterdir()} == {*left, tmp_path / "copy.db"}
