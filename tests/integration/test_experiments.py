"""Submitting, looking at and cancelling experiments and studies."""

from collections.abc import Callable
from datetime import UTC
from typing import Any

import pytest
from sqlalchemy import event

from gaplab.schemas.lifecycle import State
from gaplab.schemas.records import MeasurementKind
from gaplab.schemas.spec import StudySpec
from gaplab.services.core.errors import Conflict, InvalidSpec, NotFound
from gaplab.services.experiments import listing, reading, submission
from gaplab.services.experiments.listing import ListFilter
from gaplab.services.running import execution
from gaplab.services.specs.resolution import expected_rollouts, resolve_experiment
from gaplab.services.store.lease import Failure
from gaplab.services.store.session import Store
from tests.experiments import AWKWARD, cancel, listed, run, some_log, submit_one, toy

SECRET = 0.987654321


def small_study(**changes: Any) -> Any:
    common = toy().model_dump(exclude={"strategy", "name"})
    return StudySpec.model_validate(common | {"repetitions": 1, "reality": {"parameters": {}}} | changes)


def finish_all(store: Store) -> None:
    for claim in execution.claim(store, "me", 99):
        run(store, claim, some_log(iterations=0 if claim.spec.strategy.name == "direct" else 2))


def every_page(list_page: Any, **filters: Any) -> Any:
    items, cursor, pages = [], None, 0  # type: ignore[var-annotated]
    while cursor is not None or not pages:
        page = list_page(cursor=cursor, **filters)
        items, cursor, pages = [*items, *page.items], page.next, pages + 1
    return items, pages


def test_a_submitted_experiment_is_stored_resolved_and_queued(store: Store) -> None:
    submitted = submit_one(store, toy(name="mine"))

    found = reading.read_experiment(store, submitted.id)

    resolved = resolve_experiment(toy(name="mine"))
    assert found == submitted
    assert (found.name, found.strategy, found.state, found.study) == ("mine", "simulated_fit", State.QUEUED, found.id)
    assert found.spec["budget"] == resolved.budget.model_dump(mode="json")
    assert found.created_at.tzinfo is UTC
    assert (found.progress.repetitions, found.progress.iterations) == (3, 9)
    assert found.progress.rollouts == 3 * expected_rollouts(resolved)


def test_an_experiment_without_a_name_has_that_of_its_strategy_and_so_has_its_study(store: Store) -> None:
    study = submission.submit(store, toy())

    (alone,) = study.experiments
    assert (study.id, study.name) == (alone.id, alone.name) == (alone.study, "simulated_fit")


def test_an_id_is_that_of_a_study_or_of_one_of_its_experiments_which_alone_is_then_meant(store: Store) -> None:
    study = submission.submit(store, small_study(strategies=["random", "simulated_fit"], name="both"))
    first, second = study.experiments

    cancelled = cancel(store, first.id)
    one, both = reading.read(store, first.id), reading.read(store, study.id)

    assert (one.id, one.name, one.state, one.experiments) == (first.id, "random", State.CANCELLED, (cancelled,))
    assert one.progress == cancelled.progress
    assert (both.id, both.name, both.experiments) == (study.id, "both", (cancelled, second))
    with pytest.raises(NotFound, match=rf"this needs an experiment: {first.id} \(random\), {second.id}"):
        reading.read_experiment(store, study.id)


@pytest.mark.dialects
def test_a_name_may_have_any_character(store: Store) -> None:
    experiment = submit_one(store, toy(name="nul\0 ü 漢 🤖"))
    study = submission.submit(store, small_study(name="'\0'"))

    assert reading.read_experiment(store, experiment.id).name == "nul\ufffd ü 漢 🤖"
    assert reading.read(store, study.id).name == "'\ufffd'"


def test_an_invalid_spec_stores_nothing(store: Store) -> None:
    with pytest.raises(InvalidSpec):
        submission.submit(store, small_study(strategies=["random", "no_such"]))

    assert listing.list_studies(store).items == ()
    assert listed(store) == []


def test_a_study_has_an_experiment_for_each_strategy_in_its_order(store: Store) -> None:
    submitted = submission.submit(store, small_study(name="all", direct_repetitions=4))

    found = reading.read(store, submitted.id)

    assert found == submitted
    assert (found.name, found.state) == ("all", State.QUEUED)
    assert [each.strategy for each in found.experiments] == [each.name for each in StudySpec().strategies]
    assert {each.study for each in found.experiments} == {found.id}
    assert [each.progress.repetitions for each in found.experiments] == [1] * 6 + [4]
    assert found.progress.iterations == 6 * 3 + 4 * 1
    assert found.progress.rollouts == sum(each.progress.rollouts for each in found.experiments)


def test_the_state_of_a_study_is_that_of_its_experiments_together(store: Store) -> None:
    study = submission.submit(store, small_study(strategies=["simulated_fit", "direct"])).id
    states = []

    (first,) = execution.claim(store, "me", 1)
    states.append(reading.read(store, study).state)
    execution.fail(store, first, Failure("x"))
    states.append(reading.read(store, study).state)
    finish_all(store)
    states.append(reading.read(store, study).state)

    assert states == [State.RUNNING, State.RUNNING, State.COMPLETED]


@pytest.mark.dialects
def test_an_unknown_id_is_not_found_and_the_message_names_it(store: Store) -> None:
    results: tuple[Any, ...] = (reading.list_repetitions, reading.list_samples, reading.list_simulators)
    for name in ("no-such", "", "nul\0", "ü" * 1000, "'; DROP TABLE study; --"):
        for look in (reading.read_experiment, cancel, reading.read, *results):
            with pytest.raises(NotFound) as caught:
                look(store, name)

            assert repr(name) in str(caught.value)


@pytest.mark.dialects
def test_pages_have_every_study_once_newest_first_whatever_is_submitted_meanwhile(store: Store) -> None:
    made = [submission.submit(store, small_study(strategies=["random"])).id for _ in range(4)]

    first = listing.list_studies(store, limit=2)
    submit_one(store, toy())
    second = listing.list_studies(store, limit=2, cursor=first.next)

    assert [each.id for page in (first, second) for each in page.items] == made[::-1]
    assert second.next is None


def test_pages_of_studies_have_every_study_once_newest_first(store: Store) -> None:
    submitted = [submission.submit(store, small_study(name=str(number))) for number in range(5)]

    found, pages = every_page(lambda **page: listing.list_studies(store, limit=2, **page))

    assert found == submitted[::-1]
    assert pages == 3


def test_a_list_is_filtered_by_state_and_strategy(store: Store) -> None:
    study = submission.submit(store, small_study())
    alone = submit_one(store, toy())
    cancel(store, alone.id)

    def found(**filters: Any) -> Any:
        return {each.id for each in listing.list_studies(store, ListFilter(**filters)).items}

    assert found(state=State.CANCELLED) == {alone.id}
    assert found(strategy="simulated_fit") == {alone.id, study.id}
    assert found(strategy="simulated_fit", state=State.QUEUED) == {study.id}
    assert found(strategy="no\0such") == set()


CURSORS = ("", "x", "ü", "W10", "WzEsMiwzXQ", "WyIyMDI2LTAxLTAxIiwgMSwgMV0", "W" * 100_000, "W1tb" * 497)
"""None of them was given out."""


def test_a_cursor_that_no_page_gave_is_refused(store: Store) -> None:
    experiment = submit_one(store, toy()).id
    pages: tuple[Callable[[str], Any], ...] = (
        lambda cursor: listing.list_studies(store, cursor=cursor),
        lambda cursor: reading.list_samples(store, experiment, cursor=cursor + "a"),
        lambda cursor: reading.list_simulators(store, experiment, cursor=cursor + "a"),
    )

    for page in pages:
        for cursor in CURSORS:
            with pytest.raises(InvalidSpec) as caught:
                page(cursor)
            assert [each.pointer for each in caught.value.violations] == ["cursor"]


def test_a_list_takes_as_many_queries_for_many_as_for_one(store: Store) -> None:
    counted = []
    event.listen(store._engine, "before_cursor_execute", lambda *details: counted.append(details[2]))

    def queries() -> Any:
        counted.clear()
        listing.list_studies(store)
        return len(counted)

    submission.submit(store, small_study(strategies=["simulated_fit"]))
    one = queries()
    for _ in range(5):
        submission.submit(store, small_study())

    assert queries() == one


def test_samples_and_probes_are_rows_in_the_order_of_the_log(store: Store) -> None:
    experiment = submit_one(store, toy()).id
    for claim in execution.claim(store, "me", 2):
        run(store, claim)

    page = reading.list_samples(store, experiment)

    sample, probe = MeasurementKind.SAMPLE, MeasurementKind.PROBE
    kinds = [(0, probe), (1, sample), (1, probe), (2, sample), (2, probe)]
    assert [(each.repetition, each.iteration, each.kind) for each in page.items] == [
        (repetition, *each) for repetition in range(2) for each in kinds
    ]
    assert [each.fitness for each in page.items[:5]] == [1.0, None, None, 1 / 3, 1.0]
    assert page.items[1].genome == AWKWARD
    assert page.items[0].genome == AWKWARD[::-1]
    assert {each.measured_by for each in page.items} == {"analytic"}
    assert page.next is None


@pytest.mark.dialects
def test_samples_and_simulators_are_filtered_and_paged(store: Store) -> None:
    experiment = submit_one(store, toy()).id
    for claim in execution.claim(store, "me", 3):
        run(store, claim)

    samples, pages = every_page(
        lambda **page: reading.list_samples(store, experiment, kind=MeasurementKind.SAMPLE, limit=4, **page)
    )
    every, _ = every_page(lambda **page: reading.list_samples(store, experiment, limit=4, **page))
    of_one = reading.list_samples(store, experiment, repetition=1).items
    simulators, _ = every_page(lambda **page: reading.list_simulators(store, experiment, limit=4, **page))
    of_iteration = reading.list_simulators(store, experiment, repetition=2, iteration=1).items

    assert (len(samples), pages) == (6, 2)
    assert tuple(every) == reading.list_samples(store, experiment).items
    assert [each for each in every if each.repetition == 1] == list(of_one)
    assert [(each.repetition, each.iteration, each.rank) for each in simulators] == [
        (repetition, iteration, rank) for repetition in range(3) for iteration in range(3) for rank in range(2)
    ]
    assert [each.squared_error for each in of_iteration] == [1e-300, None]
    assert of_iteration[0].parameters == {"static_friction": 0.1, "dynamic_friction": 1 / 3}


def test_realitys_parameters_are_shown_only_after_the_end(store: Store) -> None:
    spec = toy(repetitions=1, reality={"parameters": {"static_friction": SECRET}})
    experiment = submit_one(store, spec).id
    before = reading.read_experiment(store, experiment)
    (claim,) = execution.claim(store, "me", 1)
    while_running = listed(store)[0]

    run(store, claim)

    after = reading.read_experiment(store, experiment)
    for found in (before, while_running):
        assert found.spec["reality"]["parameters"] == {"static_friction": None, "dynamic_friction": None}
        assert str(SECRET) not in found.model_dump_json()
    assert after.spec["reality"]["parameters"] == {"static_friction": SECRET, "dynamic_friction": 0.8}


def test_realitys_parameters_are_hidden_while_any_experiment_of_the_study_can_learn_them(store: Store) -> None:
    spec = small_study(strategies=["random", "simulated_fit"], reality={"parameters": {"static_friction": SECRET}})
    study = submission.submit(store, spec)
    first, second = study.experiments

    cancel(store, first.id)
    meanwhile = reading.read(store, study.id)
    cancel(store, second.id)

    assert str(SECRET) not in study.model_dump_json() + meanwhile.model_dump_json()
    assert str(SECRET) not in listing.list_studies(store, ListFilter(state=State.RUNNING)).model_dump_json()
    assert reading.read_experiment(store, first.id).spec["reality"]["parameters"]["static_friction"] == SECRET


def test_a_queued_experiment_can_be_cancelled_once(store: Store) -> None:
    experiment = submit_one(store, toy()).id

    cancelled = cancel(store, experiment)

    assert (cancelled.state, cancelled.started_at) == (State.CANCELLED, None)
    assert cancelled.ended_at is not None
    assert cancelled.progress.time_left is None
    assert cancelled == reading.read_experiment(store, experiment)
    with pytest.raises(Conflict, match="CANCELLED"):
        cancel(store, experiment)


def test_what_has_ended_cannot_be_cancelled(store: Store) -> None:
    experiment = submit_one(store, toy()).id
    finish_all(store)

    with pytest.raises(Conflict, match="COMPLETED"):
        cancel(store, experiment)


def test_repetitions_tell_how_far_they_are(store: Store) -> None:
    experiment = submit_one(store, toy()).id
    first, second = execution.claim(store, "me", 2)
    run(store, first)
    execution.fail(store, second, Failure("the code raised"))

    found = reading.list_repetitions(store, experiment)

    assert [each.number for each in found] == [0, 1, 2]
    assert [each.state for each in found] == [State.COMPLETED, State.FAILED, State.QUEUED]
    assert [each.iterations_done for each in found] == [3, 0, 0]
    assert [each.attempts for each in found] == [1, 1, 0]
    assert [each.error for each in found] == [None, "the code raised", None]
