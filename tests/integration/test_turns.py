"""Whose turn it is, on both databases: priority, then fairness, then the longest wait; and who gives way."""

from typing import Any

import pytest
from sqlalchemy import text

from gaplab.schemas.lifecycle import ScheduleChange
from gaplab.services.experiments import lifecycle, reading
from gaplab.services.running import execution, turns
from gaplab.services.running.versions import provenance as present_provenance
from gaplab.services.store.session import Store
from tests.experiments import run, submit_one, toy


def submitted(store: Store, **changes: Any) -> Any:
    return submit_one(store, toy(**changes)).id


def claimed(store: Store, limit: Any) -> Any:
    """Experiment and number of each, in the order in which they are given out."""
    return [(each.experiment_id, each.number) for each in execution.claim(store, "me", limit)]


@pytest.mark.dialects
def test_experiments_take_turns_and_their_repetitions_come_in_order(store: Store) -> None:
    first, second = submitted(store), submitted(store, repetitions=2)

    found = [*claimed(store, 3), *claimed(store, 9)]

    assert found == [(first, 0), (second, 0), (first, 1), (second, 1), (first, 2)]
    assert claimed(store, 9) == []


def test_who_has_the_fewest_running_is_next(store: Store) -> None:
    large = submitted(store, repetitions=9)
    claims = execution.claim(store, "me", 4)
    small = submitted(store, repetitions=2)

    at_once = claimed(store, 3)
    for each in claims:
        run(store, each)
    later = claimed(store, 1)

    assert at_once == [(small, 0), (small, 1), (large, 4)]
    assert later == [(large, 5)]


def test_all_experiments_of_a_study_advance_also_on_few_cores(store: Store) -> None:
    ids = [submitted(store, repetitions=2) for _ in range(3)]
    given = [execution.claim(store, "me", 1)[0] for _ in range(2)]

    for oldest in range(3):
        run(store, given[oldest])
        given += execution.claim(store, "me", 1)

    found = [(ids.index(each.experiment_id), each.number) for each in given]
    assert found == [(0, 0), (1, 0), (2, 0), (0, 1), (1, 1)]


def test_the_higher_priority_comes_first_whatever_runs(store: Store) -> None:
    usual, urgent, idle = (submitted(store, priority=each) for each in (0, 10, -10))

    found = claimed(store, 9)

    assert found == [(each, number) for each in (urgent, usual, idle) for number in range(3)]


@pytest.mark.dialects
def test_no_more_than_max_parallel_run_at_once(store: Store) -> None:
    narrow = submitted(store, max_parallel=2, repetitions=4)
    claims = execution.claim(store, "me", 9)
    wide = submitted(store, repetitions=1)

    meanwhile = claimed(store, 9)
    run(store, claims[0])

    assert [each.number for each in claims] == [0, 1]
    assert meanwhile == [(wide, 0)]
    assert claimed(store, 9) == [(narrow, 2)]


def test_the_schedule_can_be_changed_and_is_shown_and_the_spec_is_as_it_was(store: Store) -> None:
    first, second = submitted(store, max_parallel=1), submitted(store)
    spec = reading.read_experiment(store, second).spec

    (changed,) = lifecycle.schedule(store, second, ScheduleChange(priority=3)).experiments
    (free,) = lifecycle.schedule(store, first, ScheduleChange(max_parallel=None)).experiments

    assert (changed.priority, changed.max_parallel, changed.spec) == (3, None, spec)
    assert (free.priority, free.max_parallel) == (0, None)
    assert claimed(store, 5) == [*((second, n) for n in range(3)), (first, 0), (first, 1)]


def test_two_experiments_that_differ_only_in_their_schedule_have_one_spec(store: Store) -> None:
    plain, hurried = submitted(store), submitted(store, priority=9, max_parallel=2)

    assert reading.read_experiment(store, plain).spec == reading.read_experiment(store, hurried).spec


@pytest.mark.dialects
def test_what_waits_for_a_core_gives_way_to_who_has_less(store: Store) -> None:
    large = submitted(store, repetitions=9)
    running, *waiting = execution.claim(store, "me", 4)
    assert execution.give_way(store, waiting) == ()
    small = submitted(store, repetitions=1)

    given = execution.give_way(store, waiting)

    assert given == tuple(waiting)
    assert not execution.complete(store, waiting[0])
    assert execution.heartbeat(store, [running]) == (running,)
    assert claimed(store, 3) == [(small, 0), (large, 1), (large, 2)]
    assert [each.attempts for each in reading.list_repetitions(store, large)][:4] == [1, 1, 1, 0]


def test_one_of_two_gives_way_to_who_has_none(store: Store) -> None:
    submitted(store, repetitions=2)
    _, *waiting = execution.claim(store, "me", 2)
    submitted(store, repetitions=1)

    assert execution.give_way(store, waiting) == tuple(waiting)


def test_nothing_gives_way_to_an_experiment_that_this_supervisor_may_not_run(store: Store) -> None:
    elsewhere = submitted(store, repetitions=2)
    other = present_provenance().model_copy(update={"architecture": "another"})
    for claim in execution.claim(store, "them", 2, other):
        execution.hand_back(store, claim)
    submitted(store, repetitions=9)
    _, *waiting = execution.claim(store, "me", 4)

    assert execution.give_way(store, waiting) == ()
    assert execution.give_way(store, waiting, other) == tuple(waiting)
    assert {each.attempts for each in reading.list_repetitions(store, elsewhere)} == {0}


def test_nobody_gives_way_for_what_would_be_no_fairer(store: Store) -> None:
    submitted(store, repetitions=9)
    submitted(store, repetitions=9)
    waiting = execution.claim(store, "me", 3)

    assert execution.give_way(store, waiting) == ()


@pytest.mark.dialects
def test_the_next_turn_is_found_by_an_index(store: Store) -> None:
    submitted(store)
    with store.reading() as session:
        dialect = session.connection().dialect.name
        if dialect == "postgresql":
            session.execute(text("SET LOCAL enable_seqscan = off"))
        query = turns.next_experiments(5).compile(session.connection(), compile_kwargs={"literal_binds": True})
        plan = session.execute(text(f"EXPLAIN {'QUERY PLAN ' if dialect == 'sqlite' else ''}{query}")).all()

    said = " ".join(str(each) for each in plan)
    assert "ix_experiment_turn" in said
    assert "TEMP B-TREE" not in said
    assert "Sort" not in said
