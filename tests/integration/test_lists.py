"""Lists and curves cost what they show, not what is stored."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import event

from gaplab.schemas.lifecycle import State
from gaplab.services.archives import export, import_archive
from gaplab.services.experiments import listing, reading
from gaplab.services.experiments.listing import ListFilter
from gaplab.services.results import curves
from gaplab.services.running import execution
from gaplab.services.store.models import Base
from gaplab.services.store.session import Store
from tests.experiments import submit_one, toy
from tests.filling import IN_A_STUDY, experiment_id, fill, study_id

READS = {
    "studies": lambda store: listing.list_studies(store, limit=2),
    "studies in a state": lambda store: listing.list_studies(store, ListFilter(state=State.COMPLETED), limit=2),
    "a study": lambda store: reading.read(store, study_id(0)),
    "an experiment": lambda store: reading.read_experiment(store, experiment_id(0)),
    "samples": lambda store: reading.list_samples(store, experiment_id(0)),
    "a curve": lambda store: curves.curve(store, experiment_id(0)),
    "a study's curves": lambda store: curves.curves(store, [study_id(0)]),
}


@contextmanager
def statements(store: Store) -> Iterator[Any]:
    """Those that the store executes meanwhile, each with its parameters."""
    found = []
    with store.reading() as session:
        engine = session.get_bind().engine

    def note(connection: Any, cursor: Any, statement: Any, parameters: Any, context: Any, many: Any) -> None:
        found.append((statement, parameters))

    event.listen(engine, "before_cursor_execute", note)
    yield found
    event.remove(engine, "before_cursor_execute", note)


def asked(store: Store) -> Any:
    counts = {}
    for name, read in READS.items():
        with statements(store) as found:
            read(store)
        counts[name] = len(found)
    return counts


def test_what_benchmarks_fill_a_database_with_is_what_the_service_stores(store: Store, tmp_path: Path) -> None:
    fill(store, 2 * IN_A_STUDY)

    with export(store, study_id(1)).file as archive:
        assert len(import_archive(store, archive).experiments) == IN_A_STUDY  # whole logs, or it would be refused
    shown = reading.read(store, study_id(0)).experiments
    assert {each.state for each in shown} == {State.COMPLETED}
    assert all(each.progress.iterations_done == each.progress.iterations == 44 for each in shown)
    assert [point.n for point in curves.curve(store, experiment_id(3)).points] == [4] * 11
    submitted = submit_one(store, toy())
    assert {each.experiment_id for each in execution.claim(store, "me", 9)} == {submitted.id}


@pytest.mark.dialects
def test_no_list_asks_more_often_when_it_shows_more(store: Store) -> None:
    fill(store, 1)
    few = asked(store)
    with store.transaction() as session:
        for table in reversed(Base.metadata.sorted_tables):
            if table.name != "event_counter":
                session.execute(table.delete())
    fill(store, 3 * IN_A_STUDY)

    assert asked(store) == few


def test_every_read_finds_its_rows_by_an_index(sqlite_store: Store) -> None:
    fill(sqlite_store, 12 * IN_A_STUDY)
    with statements(sqlite_store) as found:
        for read in READS.values():
            read(sqlite_store)

    with sqlite_store.reading() as session:
        for statement, parameters in found:
            if statement.startswith("SELECT"):
                plan = session.connection().exec_driver_sql(f"EXPLAIN QUERY PLAN {statement}", parameters)
                steps = [step for *_, step in plan]
                assert not [step for step in steps if step.startswith("SCAN") and "INDEX" not in step], statement


def test_a_page_of_studies_is_read_in_its_order_and_not_sorted(sqlite_store: Store) -> None:
    fill(sqlite_store, 12 * IN_A_STUDY)
    with statements(sqlite_store) as found:
        listing.list_studies(sqlite_store)
    page, parameters = next(each for each in found if "FROM study" in each[0] and "LIMIT" in each[0])

    with sqlite_store.reading() as session:
        steps = [step for *_, step in session.connection().exec_driver_sql(f"EXPLAIN QUERY PLAN {page}", parameters)]

    assert len(steps) == 1
    assert "created_at_id" in steps[0]
