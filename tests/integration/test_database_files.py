"""The file of a SQLite database under a running service: replaced, deleted, copied over, damaged, read by others."""

import asyncio
import logging
import os
import shutil
import sqlite3
import stat
from collections.abc import Iterator
from contextlib import closing
from datetime import timedelta
from pathlib import Path
from typing import Any

import pytest
from fastapi.testclient import TestClient
from sqlalchemy import event, text, update

from gaplab import migrations
from gaplab.api.app import create_app
from gaplab.api.http.event_feed import EventFeed
from gaplab.api.process.service import migrate, warn_of_readers
from gaplab.services.events import WantedEvents
from gaplab.services.running import execution, supervisors
from gaplab.services.store import sqlite_file
from gaplab.services.store.database_errors import StoreChanged, StoreDamaged, StoreUnavailable
from gaplab.services.store.models import SupervisorRow
from gaplab.services.store.session import Store
from gaplab.services.store.sqlite_file import url_of
from tests.experiments import listed, some_log, submit_one, toy


@pytest.fixture
def file(sqlite_url: str) -> Path:
    return Path(sqlite_url.removeprefix("sqlite:///"))


@pytest.fixture
def other(sqlite_template: Path, file: Path) -> Iterator[Path]:
    """Another database, with one experiment."""
    other = Path(shutil.copy(sqlite_template, file.with_suffix(".other")))
    store = Store(f"sqlite:///{other}")
    submit_one(store, toy())
    store.dispose()
    yield other
    other.unlink(missing_ok=True)


def count(store: Store) -> int:
    return len(listed(store))


def readyz(store: Store) -> Any:
    return TestClient(create_app(store)).get("/readyz")


def damage(file: Path) -> bytes:
    """Overwrite all pages but the first, and return what was there."""
    whole = file.read_bytes()
    with file.open("r+b") as opened:
        opened.seek(4096)
        opened.write(os.urandom(len(whole) - 4096))
    return whole


def test_a_file_that_replaces_the_database_is_opened_and_it_is_said(
    sqlite_store: Store, file: Path, other: Path, caplog: pytest.LogCaptureFixture
) -> None:
    before = count(sqlite_store)

    other.replace(file)

    assert (before, count(sqlite_store)) == (0, 1)
    assert "was replaced by another file" in caplog.text
    submit_one(sqlite_store, toy())
    assert count(sqlite_store) == 2


def test_a_replacement_that_is_damaged_is_not_written_to(sqlite_store: Store, file: Path, other: Path) -> None:
    sqlite_store.check()
    damage(other)

    other.replace(file)

    with pytest.raises(StoreDamaged, match="gaplab restore"):
        submit_one(sqlite_store, toy())
    told = readyz(sqlite_store)
    assert told.status_code == 503
    assert "gaplab restore" in told.json()["detail"]


def test_a_supervisor_refuses_a_replacement_for_good(sqlite_url: str, file: Path, other: Path) -> None:
    store = Store(sqlite_url, pinned=True)
    store.check()
    shutil.copy(file, file.with_suffix(".first"))

    other.replace(file)

    for _ in range(2):
        with pytest.raises(StoreChanged, match="replaced"):
            supervisors.heartbeat(store, "me")
    store.dispose()
    file.with_suffix(".first").unlink()


def test_a_deleted_database_is_told_and_works_again_once_it_is_back(sqlite_store: Store, file: Path) -> None:
    sqlite_store.check()
    aside = file.rename(file.with_suffix(".aside"))

    gone = readyz(sqlite_store)
    with pytest.raises(StoreUnavailable, match="is gone"):
        submit_one(sqlite_store, toy())
    made = file.exists()
    aside.rename(file)

    assert gone.status_code == 503
    assert "put it back" in gone.json()["detail"]
    assert not made
    assert readyz(sqlite_store).status_code == 200


def test_a_database_that_is_copied_over_in_place_is_read_as_it_is_now(
    sqlite_store: Store, file: Path, other: Path
) -> None:
    before = count(sqlite_store)

    shutil.copyfile(other, file)

    assert (before, count(sqlite_store)) == (0, 1)


def test_damage_is_told_and_nothing_more_is_written_until_the_file_is_whole(
    sqlite_store: Store, file: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    submit_one(sqlite_store, toy())
    whole = damage(file)
    sqlite_store.dispose()  # pages in memory are still good

    with pytest.raises(StoreDamaged):
        count(sqlite_store)
    with pytest.raises(StoreDamaged):
        submit_one(sqlite_store, toy())
    told = readyz(sqlite_store)
    file.write_bytes(whole)
    still = readyz(sqlite_store)
    monkeypatch.setattr(sqlite_file, "CHECK_AGAIN_S", 0.0)

    assert told.status_code == still.status_code == 503
    assert "is damaged" in told.json()["detail"]
    assert "is damaged" in caplog.text
    assert readyz(sqlite_store).status_code == 200
    assert count(sqlite_store) == 1


def test_a_service_does_not_start_on_a_copy_that_lacks_its_journal(file: Path, sqlite_url: str) -> None:
    """A copy in the middle of a transaction: its first page is there, others are of another moment."""
    damage(file)

    with pytest.raises(StoreDamaged, match="gaplab restore"):
        migrate(sqlite_url)


def test_a_claim_never_fits_the_work_of_another_database(sqlite_store: Store, file: Path, other: Path) -> None:
    submit_one(sqlite_store, toy())
    (ours, *_) = execution.claim(sqlite_store, "us", 2)
    there = Store(f"sqlite:///{other}")
    (theirs, *_) = execution.claim(there, "them", 2)
    execution.heartbeat(there, [theirs])  # SQLite tells one content from another by the number of its changes
    there.dispose()

    shutil.copyfile(other, file)
    (step, *_) = some_log()

    assert (ours.id, ours.epoch) == (theirs.id, theirs.epoch)
    assert not execution.record(sqlite_store, ours, step)
    assert execution.heartbeat(sqlite_store, [ours]) == ()
    assert execution.hand_back(sqlite_store, ours) == ()
    assert execution.record(sqlite_store, theirs, step)


@pytest.mark.dialects
def test_a_supervisor_notices_that_its_database_is_of_an_earlier_moment(store: Store) -> None:
    first = supervisors.heartbeat(store, "me")
    second = supervisors.heartbeat(store, "me", first)
    earlier = update(SupervisorRow).values(heartbeat_at=second - timedelta(minutes=1))
    store.write(lambda session: session.execute(earlier))

    with pytest.raises(StoreChanged, match="replaced or restored"):
        supervisors.heartbeat(store, "me", second)
    store.write(lambda session: session.execute(text("DELETE FROM supervisor")))
    with pytest.raises(StoreChanged, match="replaced or restored"):
        supervisors.heartbeat(store, "me", first)


def test_streams_of_events_end_when_the_database_goes_back(
    sqlite_store: Store, file: Path, caplog: pytest.LogCaptureFixture
) -> None:
    empty = file.read_bytes()
    submit_one(sqlite_store, toy())

    async def follow() -> int:
        feed, found = EventFeed(sqlite_store, every_s=0.01), 0
        async for _ in feed.follow(0, WantedEvents()):
            found += 1
            file.write_bytes(empty)
        return found

    found = asyncio.run(asyncio.wait_for(follow(), 60))

    assert found > 0
    assert "replaced or restored" in caplog.text


def test_only_the_owner_can_open_a_new_database_and_its_journal(tmp_path: Path) -> None:
    file = tmp_path / "new.db"
    before = os.umask(0o022)
    try:
        migrations.upgrade(f"sqlite:///{file}")
        store = Store(f"sqlite:///{file}")
        with store.transaction() as session:
            session.execute(text("DELETE FROM supervisor"))
            modes = {each.name: stat.S_IMODE(each.stat().st_mode) for each in tmp_path.iterdir()}
        store.dispose()
        connection = sqlite3.connect(file)
        connection.execute("PRAGMA journal_mode=WAL")
        connection.execute("DELETE FROM supervisor")
        modes |= {each.name: stat.S_IMODE(each.stat().st_mode) for each in tmp_path.iterdir()}
        connection.close()
    finally:
        os.umask(before)

    assert {"new.db", "new.db-journal", "new.db-wal", "new.db-shm"} <= modes.keys()
    assert set(modes.values()) == {0o600}


@pytest.mark.parametrize("name", ["50% of?.db", "a%41b.db", "#é b.db"])
def test_a_database_has_any_name(tmp_path: Path, name: str) -> None:
    url = url_of(tmp_path / name)

    migrations.upgrade(url)
    with Store(url) as store:
        store.check()

    assert store.file == tmp_path / name
    assert stat.S_IMODE((tmp_path / name).stat().st_mode) == 0o600


@pytest.mark.parametrize(
    ("path", "said"),
    [
        ("what?.db", "write . as %3F"),
        ("a%41b.db", "and % as %25"),
        ("%00", "and % as %25"),
        ("x" * 248, "at most 504 bytes, and 247 of its name"),
        ("/".join(["x"] * 253), "at most 504 bytes"),
    ],
    ids=["options", "letter", "NUL", "name", "path"],
)
def test_a_path_that_a_url_or_a_journal_would_change_is_refused(here: Path, path: str, said: str) -> None:
    with pytest.raises(StoreUnavailable, match=said):
        migrations.upgrade(f"sqlite:///{path}")

    assert not list(here.iterdir())


def test_a_write_that_failed_is_told_until_another_succeeds(sqlite_store: Store, file: Path) -> None:
    submit_one(sqlite_store, toy())
    with closing(sqlite3.connect(file)) as connection:
        (pages,) = connection.execute("PRAGMA page_count").fetchone()

    @event.listens_for(sqlite_store._engine, "begin")
    def fill(connection: Any) -> None:
        connection.exec_driver_sql(f"PRAGMA max_page_count={pages}")

    sqlite_store.write(lambda session: None)
    api = TestClient(create_app(sqlite_store))
    while (refused := api.post("/experiments", json={"robot": "toy_function", "strategy": "random"})).is_success:
        pass
    told = api.get("/readyz").json()
    pages += 1_000
    room = api.post("/experiments", json={"robot": "toy_function", "strategy": "random"})

    assert refused.status_code == 503
    assert told["status"] == "degraded"
    assert "full" in told["warnings"][0]
    assert room.is_success
    assert "full" not in api.get("/readyz").text


def test_a_database_that_others_can_open_is_warned_about(
    file: Path, sqlite_url: str, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.WARNING)
    file.chmod(0o600)
    warn_of_readers(sqlite_url)
    quiet = caplog.text

    file.chmod(0o644)
    warn_of_readers(sqlite_url)

    assert quiet == ""
    assert f"chmod 600 {file}" in caplog.text
