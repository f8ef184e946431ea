"""The schema's migrations, on both databases."""

import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime
from math import inf, nan
from pathlib import Path
from typing import Any

import pytest
from alembic import command
from alembic.autogenerate import compare_metadata
from alembic.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import Connection, MetaData, insert, inspect, select

from gaplab import migrations
from gaplab.services.core.arrays import frozen
from gaplab.services.core.types import (
    Cost,
    Fit,
    Measured,
    Probed,
    Sample,
    Selected,
    Simulator,
    Step,
    Transferred,
    Tuned,
)
from gaplab.services.store.database_errors import StoreUnavailable
from gaplab.services.store.engine import WRITES, open_engine
from gaplab.services.store.models import REVISION, Base, ExperimentRow, NotificationRow, StepRow, StudyRow, ViewRow
from gaplab.services.store.queries.logs import is_whole, logs, unknown_branch
from gaplab.services.store.session import Store
from tests.experiments import same

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
        "ck_file_kind",
        "ck_repetition_state",
        "ck_request_kind",
        "ck_request_state",
        "ck_sensitivity_state",
        "ck_step_kind",
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


MOMENT = datetime(2026, 11, 30, 12, tzinfo=UTC)
SEEN = {"genome": [0.5], "fitness": 0.25, "readings": [0.1, None], "repeats": [0.2, 0.3], "measured_by": "Ada"}
POSTERIOR = {"parameters": [0.1], "lower": [0.0], "upper": [0.2], "weight": 0.75, "held_out_error": 1.5}
SELECTED = {"selected_genome": [-0.0], "selection_rollouts": 30, "selection_failures": 1, "selection_saved": 2}
TUNED = {"tuning_rollouts": 60, "tuning_failures": 0, "tuning_saved": 4}
TRANSFERRED = {"transferred_genome": [0.75], "simulated_fitness": 0.5}
TRANSFERRED |= {"transfer_rollouts": 10, "transfer_failures": 3, "transfer_saved": 0}
ITERATIONS: list[dict[str, Any]] = [
    {"number": 0, **TUNED, **TRANSFERRED, "recorded_fitness": 0.3, "seconds": 7.0, "ended_at": MOMENT},
    {"number": 1, **SELECTED, **TUNED, **TRANSFERRED, "recorded_fitness": 0.4, "seconds": 10.0, "ended_at": MOMENT},
    {"number": 2, **SELECTED, "seconds": 3.0},
]
MEASUREMENTS: list[dict[str, Any]] = [
    SEEN | {"iteration": 0, "kind": "probe", "genome": [0.75]},
    SEEN | {"iteration": 1, "kind": "sample"},
    {"iteration": 1, "kind": "probe", "genome": [0.75], "left_out": True, "measured_by": "nobody"},
    SEEN | {"iteration": 2, "kind": "sample", "fitness": None, "repeats": None},
]
SIMULATORS: list[dict[str, Any]] = [
    {"iteration": 0, "rank": 0, "parameters": [0.3], "squared_error": 0.0},
    {"iteration": 1, "rank": 1, "parameters": [0.2], "squared_error": None},
    {"iteration": 1, "rank": 0, "squared_error": 1e-300, **POSTERIOR, "fit": [1.0, 2.0, 3.0, None]},
]
CLOSED = [
    {"kind": "transferred", "iteration": 1, "genome": [0.9], "simulated_fitness": None},
    {"kind": "probed", "iteration": 1, "fitness": 0.1, "recorded_fitness": 0.2, "repeats": [0.1, 0.1]},
    {"kind": "selected", "iteration": 2, "genome": [0.4]},
    {"kind": "measured", "iteration": 2, "genome": [0.4], "fitness": None, "repeats": []},
    {"kind": "tuned", "iteration": 2, "simulators": [{"parameters": [0.1], "squared_error": None}]},
]
LOG: list[Step] = [
    Tuned(0, (Simulator(frozen([0.3]), 0.0),), Cost(60, 0, 4)),
    Transferred(0, frozen([0.75]), 0.5, Cost(10, 3, 0)),
    Probed(0, 0.25, 0.3, frozen([0.1, nan]), frozen([0.2, 0.3])),
    Selected(1, frozen([-0.0]), Cost(30, 1, 2)),
    Measured(1, Sample(frozen([0.5]), 0.25, frozen([0.1, nan]), frozen([0.2, 0.3]))),
    Tuned(
        1,
        (
            Simulator(frozen([0.1]), 1e-300, frozen([[0.0, 0.2]]), 0.75, 1.5, fit=Fit(1.0, 2.0, 3.0, frozen([nan]))),
            Simulator(frozen([0.2]), inf),
        ),
        Cost(60, 0, 4),
    ),
    Transferred(1, frozen([0.75]), 0.5, Cost(10, 3, 0)),
    Probed(1, nan, 0.4, left_out=True),
    Selected(2, frozen([-0.0]), Cost(30, 1, 2)),
    Measured(2, Sample(frozen([0.5]), nan, frozen([0.1, nan]))),
]


def fill_with_iterations(connection: Connection) -> None:
    """Store an experiment without a study at revision 0003, whose only repetition has rows of each kind."""
    found = MetaData()
    found.reflect(connection)
    experiment = {"id": "alone", "position": 0, "name": "alone", "strategy": "random", "state": "CANCELLED", "spec": {}}
    experiment |= {"spec_version": 1, "iterations": 3, "rollouts": 1, "precedence": 0, "running": 0, "claimable": False}
    experiment |= {"created_at": MOMENT, "turn_at": MOMENT}
    repetition = {"id": 1, "experiment_id": "alone", "number": 0, "state": "CANCELLED", "steps": len(LOG), "epoch": 1}
    repetition |= {"attempts": 1, "losses": 0, "iterations_done": 2, "rollouts_done": 1, "rollouts_failed": 0}
    repetition |= {"rollouts_saved": 0, "seconds": 20.0}
    branch = {"number": 1, "iteration": 1, "reason": "typed wrongly", "steps": CLOSED, "closed_at": MOMENT}
    rows = {
        "experiment": [experiment],
        "repetition": [repetition],
        "iteration": ITERATIONS,
        "measurement": [{"measured_at": MOMENT, "left_out": False} | each for each in MEASUREMENTS],
        "simulator": SIMULATORS,
        "branch": [branch],
    }
    for name, some in rows.items():
        of_it = {} if name in {"experiment", "repetition"} else {"repetition_id": 1}
        for each in some:
            connection.execute(insert(found.tables[name]).values(each | of_it))


def test_iterations_become_a_log_of_steps(database_url: str) -> None:
    migrations.upgrade(database_url, to="0003")
    engine = open_engine(database_url).execution_options(**{WRITES: True})
    with engine.begin() as connection:
        fill_with_iterations(connection)
    engine.dispose()

    migrations.upgrade(database_url)

    with Store(database_url) as store, store.reading() as session:
        (log,) = logs(session, [1]).values()
        rows = session.scalars(select(StepRow).order_by(StepRow.branch, StepRow.place)).all()
        assert all(map(same, log, LOG))
        assert len(log) == len(LOG)
        assert is_whole(session, 1, len(LOG), 10)
        assert unknown_branch(session) is None
        assert [sum(each.seconds for each in rows if each.iteration == at) for at in range(3)] == pytest.approx(
            [7, 10, 3]
        )
        assert [each.measured_by for each in rows if each.branch == 0 and each.measured_by] == ["Ada"] * 3
        assert {each.at for each in rows if each.iteration < 2} == {MOMENT}
        assert [(each.kind, each.iteration) for each in rows if each.branch == 1] == [
            (each["kind"], each["iteration"]) for each in CLOSED
        ]
        assert [(each.fitness, each.recorded) for each in rows if each.branch == 1][:2] == [(None, None), (0.1, 0.2)]


def test_a_log_of_steps_is_not_taken_back(store_url: str) -> None:
    engine = open_engine(store_url, enforce_foreign_keys=False).execution_options(**{WRITES: True})
    with engine.begin() as connection:
        row = {"repetition_id": 1, "branch": 0, "kind": "tuned", "iteration": 0, "place": 0, "body": {}, "rollouts": 0}
        row |= {"failures": 0, "saved": 0, "seconds": 0.0, "at": MOMENT}
        if connection.dialect.name == "postgresql":
            connection.exec_driver_sql("SET session_replication_role = replica")  # without its repetition
        connection.execute(insert(StepRow).values(row))
    with engine.connect() as connection, pytest.raises(ValueError, match="restore a backup"):
        command.downgrade(migrations.configuration(connection), "0003")
    engine.dispose()
