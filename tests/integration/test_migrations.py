"""The schema's history, on both databases."""

import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest
from alembic import command
from alembic.autogenerate import compare_metadata
from alembic.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import Connection, inspect, text

from gaplab import migrations
from gaplab.services.core.errors import StoreUnavailable
from gaplab.services.store.engine import WRITES, open_engine
from gaplab.services.store.models import REVISION, Base
from gaplab.services.store.session import Store


def tables(connection: Connection) -> set[str]:
    return set(inspect(connection).get_table_names()) - {"alembic_version"}


def test_the_store_needs_the_head_of_the_migrations() -> None:
    script = ScriptDirectory.from_config(migrations.configuration())

    heads = script.get_heads()

    assert heads == [REVISION]


def test_the_schema_goes_up_and_down_and_up(database_url: str) -> None:
    engine = open_engine(database_url, enforce_foreign_keys=False).execution_options(**{WRITES: True})
    found = []

    for move, revision in ((command.upgrade, "head"), (command.downgrade, "base"), (command.upgrade, "head")):
        with engine.begin() as connection:
            move(migrations.configuration(connection), revision)
            found.append(tables(connection))
    engine.dispose()

    assert found == [set(Base.metadata.tables), set(), set(Base.metadata.tables)]


def test_the_migrations_make_what_the_models_say(store_url: str) -> None:
    engine = open_engine(store_url)

    with engine.connect() as connection:
        context = MigrationContext.configure(connection, opts={"compare_type": True})
        differences = compare_metadata(context, Base.metadata)
    engine.dispose()

    assert differences == []


def test_every_constraint_has_the_name_that_the_models_give_it(store_url: str) -> None:
    engine = open_engine(store_url)

    with engine.connect() as connection:
        found = {
            (table, each["name"])
            for table in tables(connection)
            for each in inspect(connection).get_check_constraints(table)
        }
    engine.dispose()

    assert found == {
        ("experiment", "ck_experiment_state"),
        ("repetition", "ck_repetition_state"),
        ("measurement", "ck_measurement_kind"),
        ("sensitivity", "ck_sensitivity_state"),
        ("attempt", "ck_attempt_ending"),
        ("token", "ck_token_role"),
        ("request", "ck_request_kind"),
        ("request", "ck_request_state"),
        ("answer", "ck_answer_state"),
    }


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


def test_a_database_that_has_a_revision_stays_at_it_if_only_new_ones_are_wanted(database_url: str) -> None:
    engine = open_engine(database_url, enforce_foreign_keys=False).execution_options(**{WRITES: True})
    with engine.begin() as connection:
        command.upgrade(migrations.configuration(connection), "0013")
    engine.dispose()
    store = Store(database_url)

    migrations.upgrade(database_url, only_new=True)
    with pytest.raises(StoreUnavailable, match=r"at revision 0013.* run `python -m migrations`"):
        store.check()
    migrations.upgrade(database_url)

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


def test_what_ran_and_waited_before_there_were_turns_has_its_turn(database_url: str) -> None:
    engine = open_engine(database_url, enforce_foreign_keys=False).execution_options(**{WRITES: True})
    experiment = "INSERT INTO experiment VALUES ('{}', NULL, 0, 'x', 'random', '{}', '{{}}', 1, 3, 9, '{}', NULL, NULL)"
    repetition = (
        "INSERT INTO repetition (experiment_id, number, state, owner, epoch, started_at, attempts, losses, steps, "
        "iterations_done, rollouts_done, rollouts_failed, rollouts_saved, seconds) "
        "VALUES ('{}', {}, '{}', 'me', 4, '2012-11-05 09:00:00.000000', 1, 0, 0, 0, 0, 0, 0, 0)"
    )
    with engine.begin() as connection:
        command.upgrade(migrations.configuration(connection), "0002")
        for id_, state in (("old", "RUNNING"), ("over", "COMPLETED")):
            connection.exec_driver_sql(experiment.format(id_, state, "2012-11-05 09:00:00.000000"))
        for number, state in enumerate(("COMPLETED", "RUNNING", "QUEUED")):
            connection.exec_driver_sql(repetition.format("old", number, state))

    migrations.upgrade(database_url)

    with engine.connect() as connection:
        turns = connection.exec_driver_sql(
            "SELECT id, running, claimable, precedence FROM experiment ORDER BY id"
        ).all()
        attempts = connection.exec_driver_sql("SELECT epoch, owner, ending FROM attempt").all()
    engine.dispose()
    assert [tuple(each) for each in turns] == [("old", 1, True, 0), ("over", 0, False, 0)]
    assert [tuple(each) for each in attempts] == [(4, "me", None)]


def test_a_rebuilt_table_gives_no_id_of_a_deleted_repetition_again(tmp_path: Path) -> None:
    url = f"sqlite:///{tmp_path / 'gaplab.db'}"
    engine = open_engine(url, enforce_foreign_keys=False).execution_options(**{WRITES: True})
    with engine.begin() as connection:
        command.upgrade(migrations.configuration(connection), "0013")
        connection.execute(text("DELETE FROM sqlite_sequence WHERE name = 'repetition'"))
        connection.execute(text("INSERT INTO sqlite_sequence (name, seq) VALUES ('repetition', 41)"))

    migrations.upgrade(url)

    with engine.connect() as connection:
        last = connection.execute(text("SELECT seq FROM sqlite_sequence WHERE name = 'repetition'")).scalar_one()
        made = connection.execute(text("SELECT sql FROM sqlite_master WHERE name = 'repetition'")).scalar_one()
    engine.dispose()
    assert last == 41
    assert "AUTOINCREMENT" in made
