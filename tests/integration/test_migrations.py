"""The schema's migrations, on both databases."""

import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest
from alembic import command
from alembic.autogenerate import compare_metadata
from alembic.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import Connection, MetaData, inspect, select

from gaplab import migrations
from gaplab.services.core.errors import StoreUnavailable
from gaplab.services.store.engine import WRITES, open_engine
from gaplab.services.store.models import REVISION, Base, ExperimentRow, NotificationRow, StudyRow, ViewRow
from gaplab.services.store.session import Store

pytestmark = pytest.mark.dialects


def tables(connection: Connection) -> set[str]:
    return set(inspect(connection).get_table_names()) - {"alembic_version"}


def test_the_store_needs_the_head_of_the_migrations() -> None:
    script = ScriptDirectory.from_config(migrations.configuration())

    heads = script.get_heads()

    assert heads == [REVISION]


def test_the_schema_goes_up_to_what_the_models_say_and_down_to_nothing(database_url: str) -> None:
    engine = open_engine(database_url, enforce_foreign_keys=False).execution_options(**{WRITES: True})
    found = []

    for move, revision in ((command.upgrade, "head"), (command.downgrade, "base"), (command.upgrade, "head")):
        with engine.begin() as connection:
            move(migrations.configuration(connection), revision)
            found.append(tables(connection))
    with engine.connect() as connection:
        context = MigrationContext.configure(connection, opts={"compare_type": True})
        differences = compare_metadata(context, Base.metadata)
        checks = [each["name"] for table in found[-1] for each in inspect(connection).get_check_constraints(table)]
    engine.dispose()

    assert found == [set(Base.metadata.tables), set(), set(Base.metadata.tables)]
    assert differences == []
    assert sorted(checks) == [
        "ck_answer_state",
        "ck_attempt_ending",
        "ck_experiment_state",
        "ck_measurement_kind",
        "ck_repetition_state",
        "ck_request_kind",
        "ck_request_state",
        "ck_sensitivity_state",
        "ck_token_role",
    ]


def test_an_experiment_without_a_study_gets_one_and_what_people_wrote_goes_to_the_study(database_url: str) -> None:
    engine = open_engine(database_url, enforce_foreign_keys=False).execution_options(**{WRITES: True})
    with engine.begin() as connection:
        command.upgrade(migrations.configuration(connection), "0003")
        before = MetaData()
        before.reflect(connection)
        at = datetime(2026, 11, 5, tzinfo=UTC)
        named: dict[str, Any] = {"strategy": "random", "state": "QUEUED", "spec": {}, "spec_version": 1, "position": 0}
        row = named | {"iterations": 1, "rollouts": 1, "created_at": at, "turn_at": at}
        alone = row | {"id": "a", "study_id": None, "name": "alone", "notes": "wet", "tags": " gait ", "webhook": "w"}
        member = row | {"id": "m", "study_id": "s", "name": "member", "notes": "bent", "tags": " b ", "webhook": None}
        study = {"id": "s", "name": "both", "notes": "all", "tags": " a ", "created_at": at}
        message = {"event": 1, "subject_id": "a", "experiment_id": "a", "channel": "webhook", "attempts": 0}
        view = {"name": "v", "shows": "experiments", "sort": "-state", "created_at": at}
        connection.execute(before.tables["study"].insert(), study)
        connection.execute(before.tables["experiment"].insert(), [alone, member])
        connection.execute(before.tables["notification"].insert(), message | {"message": {"kind": "study", "id": "1"}})
        connection.execute(before.tables["view"].insert(), view)
        command.upgrade(migrations.configuration(connection), "head")
        studies = connection.execute(select(StudyRow.id, StudyRow.name, StudyRow.notes, StudyRow.tags)).all()
        kept = dict(connection.execute(select(ExperimentRow.id, ExperimentRow.study_id)).all())
        sent, sort = connection.scalar(select(NotificationRow.message)), connection.scalar(select(ViewRow.sort))
    engine.dispose()

    assert sorted(studies) == [("a", "alone", "wet", " gait "), ("s", "both", "all\n\nmember: bent", " a b ")]
    assert kept == {"a": "a", "m": "s"}
    assert (sent, sort) == ({"id": "1"}, "-created_at")


def test_upgrading_at_head_changes_nothing(store_url: str) -> None:
    migrations.upgrade(store_url)

    store = Store(store_url)
    store.check()
    store.dispose()


def test_two_processes_that_upgrade_at_once_wait_for_each_other(database_url: str) -> None:
    with ThreadPoolExecutor(2) as pool:
        list(pool.map(migrations.upgrade, [database_url] * 2))

    store = Store(database_url)
    store.check()
    store.dispose()


def test_a_database_of_a_later_version_is_left_as_it_is(store_url: str) -> None:
    engine = open_engine(store_url).execution_options(**{WRITES: True})
    with engine.begin() as connection:
        connection.exec_driver_sql("UPDATE alembic_version SET version_num = 'future'")

    for only_new in (False, True):
        with pytest.raises(StoreUnavailable, match=r"at revision future.* use the version of gaplab that it is of"):
            migrations.upgrade(store_url, only_new=only_new)

    with engine.connect() as connection:
        assert tables(connection) == set(Base.metadata.tables)
    engine.dispose()


@pytest.mark.parametrize("place", ["sqlite:////no/such/folder/gaplab.db", "postgresql://me:secret@127.0.0.1:1/none"])
def test_migrating_an_unreachable_database_is_refused_in_one_sentence(place: Any) -> None:
    run = migrated({"GAPLAB_DATABASE_URL": place})

    assert run.returncode == 1
    assert run.stderr.startswith("the database cannot be used now")
    assert run.stderr.count("\n") == 1
    assert "secret" not in run.stderr


def migrated(environment: dict[str, str]) -> "subprocess.CompletedProcess[str]":
    """Run the program that migrates, with these variables."""
    return subprocess.run(
        [sys.executable, "-m", "gaplab.migrations"],
        env=os.environ | environment,
        cwd=Path(__file__).parents[2],
        capture_output=True,
        text=True,
        check=False,
    )


def test_a_setting_that_is_none_ends_the_migration_with_a_sentence() -> None:
    run = migrated({"GAPLAB_LEASE_S": "abc"})

    assert (run.returncode, run.stderr) == (
        1,
        "GAPLAB_LEASE_S is 'abc'; it must be a whole number of at least 1\n",
    )


def test_a_migration_that_fails_is_a_sentence_and_changes_nothing(store_url: str) -> None:
    engine = open_engine(store_url).execution_options(**{WRITES: True})
    with engine.begin() as connection:
        connection.exec_driver_sql("DELETE FROM alembic_version")

    run = migrated({"GAPLAB_DATABASE_URL": store_url})

    with engine.connect() as connection:
        assert tables(connection) == set(Base.metadata.tables)
    engine.dispose()
    assert run.returncode == 1
    assert run.stderr.startswith("the database")
    assert "already exists" in run.stderr
    assert run.stderr.count("\n") == 1


def test_a_database_that_has_a_revision_stays_at_it_if_only_new_ones_are_wanted(store_url: str) -> None:
    engine = open_engine(store_url).execution_options(**{WRITES: True})
    with engine.begin() as connection:
        connection.exec_driver_sql("UPDATE alembic_version SET version_num = '0000'")
    engine.dispose()
    store = Store(store_url)

    migrations.upgrade(store_url, only_new=True)

    with pytest.raises(StoreUnavailable, match=r"at revision 0000.* run `python -m migrations`"):
        store.check()
    store.dispose()


def test_a_store_whose_schema_is_missing_is_unavailable_and_says_what_to_do(database_url: str) -> None:
    store = Store(database_url)

    with pytest.raises(StoreUnavailable, match="python -m migrations"):
        store.check()

    store.dispose()


def test_a_store_at_another_revision_is_unavailable(store_url: str) -> None:
    engine = open_engine(store_url).execution_options(**{WRITES: True})
    with engine.begin() as connection:
        connection.exec_driver_sql("UPDATE alembic_version SET version_num = 'future'")
    engine.dispose()
    store = Store(store_url)

    with pytest.raises(StoreUnavailable, match="at revision future"):
        store.check()

    store.dispose()
