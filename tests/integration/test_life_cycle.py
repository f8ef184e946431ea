"""Pause, resume, stop, cancel and extend, on both databases: what each does to states, leases and numbers."""

from typing import Any

import pytest

from gaplab.schemas.lifecycle import PERMITTED, Ending, ExtensionSpec, State, Verb
from gaplab.schemas.spec import StudySpec
from gaplab.services.core.errors import Conflict, InvalidSpec, NotFound
from gaplab.services.core.loop import repetition
from gaplab.services.experiments import lifecycle, reading, submission
from gaplab.services.results import curves
from gaplab.services.running import execution
from gaplab.services.specs.assembly import setting
from gaplab.services.store.lease import Failure, TimedStep
from gaplab.services.store.models import RepetitionRow
from gaplab.services.store.queries.logs import logs
from gaplab.services.store.session import Store
from tests.experiments import run, same, some_log, submit_one, toy
from tests.integration.test_bench import compute as supervise


def submitted(store: Store, **changes: Any) -> Any:
    return submit_one(store, toy(**changes)).id


def state(store: Store, experiment: Any) -> Any:
    return reading.read_experiment(store, experiment).state


def states(store: Store, experiment: Any) -> Any:
    return [each.state for each in reading.list_repetitions(store, experiment)]


def ask(store: Store, experiment: Any, verb: Any) -> Any:
    return lifecycle.ask(store, experiment, verb).state


def deliver(store: Store, claim: Any, count: Any, log: Any = some_log) -> Any:
    """The next `count` steps of a log whose first are stored; whether the claim holds on."""
    done = len(stored(store, claim.experiment_id)[claim.number])
    return [execution.record(store, claim, step) for step in tuple(log())[done : done + count]]


def stored(store: Store, experiment: Any) -> Any:
    with store.reading() as session:
        rows = session.query(RepetitionRow).filter_by(experiment_id=experiment).order_by(RepetitionRow.number).all()
        found = logs(session, [row.id for row in rows])
        return [found[row.id] for row in rows]


def endings(store: Store, experiment: Any, number: Any = 0) -> Any:
    return [each.ending for each in reading.list_attempts(store, experiment, number)]


def compute(store: Store, experiment: Any = None) -> Any:
    """Run whatever is queued, by the real loop."""
    while claims := execution.claim(store, "me", 9):
        for each in claims:
            steps = repetition(setting(each.spec, each.number), each.log)
            execution.record_all(store, [(each, [TimedStep(step, 0.1) for step in steps])])
        assert execution.complete(store, *claims) == claims
    return stored(store, experiment) if experiment else None


@pytest.mark.dialects
def test_a_paused_repetition_finishes_its_step_and_keeps_its_place(store: Store) -> None:
    experiment = submitted(store)
    (claim,) = execution.claim(store, "me", 1)
    deliver(store, claim, 3)

    asked = ask(store, experiment, Verb.PAUSE)
    still = execution.heartbeat(store, [claim])
    last, after = deliver(store, claim, 2)

    assert (asked, still, last, after) == (State.PAUSING, (claim,), False, False)
    assert same(stored(store, experiment)[0], tuple(some_log())[:4])
    assert states(store, experiment) == [State.QUEUED] * 3
    assert state(store, experiment) is State.PAUSED
    assert execution.claim(store, "me", 9) == ()
    assert endings(store, experiment) == [Ending.PAUSED]


def test_a_resumed_experiment_goes_on_from_where_it_was(store: Store) -> None:
    experiment = submitted(store, repetitions=1)
    (claim,) = execution.claim(store, "me", 1)
    deliver(store, claim, 3)
    ask(store, experiment, Verb.PAUSE)
    deliver(store, claim, 1)

    resumed = ask(store, experiment, Verb.RESUME)
    (again,) = execution.claim(store, "me", 1)

    assert resumed is State.QUEUED
    assert same(again.log, tuple(some_log())[:4])
    assert not execution.record(store, claim, tuple(some_log())[4])
    assert all(deliver(store, again, 99))
    assert execution.complete(store, again)
    assert endings(store, experiment) == [Ending.PAUSED, Ending.COMPLETED]
    assert reading.list_repetitions(store, experiment)[0].attempts == 2


def test_resuming_before_the_step_is_over_interrupts_nothing(store: Store) -> None:
    experiment = submitted(store, repetitions=1)
    (claim,) = execution.claim(store, "me", 1)

    moves = [ask(store, experiment, verb) for verb in (Verb.PAUSE, Verb.RESUME)]

    assert moves == [State.PAUSING, State.RUNNING]
    run(store, claim)
    assert endings(store, experiment) == [Ending.COMPLETED]


def test_a_step_that_is_delivered_again_is_not_the_one_under_way(store: Store) -> None:
    experiment = submitted(store, repetitions=1)
    (claim,) = execution.claim(store, "me", 1)
    first, second, *_ = some_log()
    execution.record(store, claim, first)
    ask(store, experiment, Verb.PAUSE)

    again, following = execution.record(store, claim, first), execution.record(store, claim, second)

    assert (again, following) == (True, False)
    assert len(stored(store, experiment)[0]) == 2


@pytest.mark.dialects
def test_the_step_under_way_may_be_the_last_of_all(store: Store) -> None:
    experiment = submitted(store, repetitions=1)
    (claim,) = execution.claim(store, "me", 1)
    submitted(store, repetitions=1, iterations=9)
    deliver(store, claim, 12)
    ask(store, experiment, Verb.PAUSE)

    deliver(store, claim, 1)

    assert (state(store, experiment), states(store, experiment)) == (State.COMPLETED, [State.COMPLETED])
    assert endings(store, experiment) == [Ending.COMPLETED]


def test_what_waits_at_a_core_gives_way_to_a_pause(store: Store) -> None:
    experiment = submitted(store)
    running, *waiting = execution.claim(store, "me", 3)
    ask(store, experiment, Verb.PAUSE)

    given = execution.give_way(store, waiting)

    assert given == tuple(waiting)
    assert state(store, experiment) is State.PAUSING
    deliver(store, running, 1)
    assert state(store, experiment) is State.PAUSED


@pytest.mark.parametrize("lose", ["release", "requeue_lost", "hand_back"])
def test_a_worker_lost_while_pausing_leaves_it_paused(store: Store, lose: Any) -> None:
    experiment = submitted(store, repetitions=1)
    (claim,) = execution.claim(store, "me", 1)
    ask(store, experiment, Verb.PAUSE)

    if lose == "release":
        execution.release(store, claim, "killed")
    elif lose == "requeue_lost":
        execution.requeue_lost(store, stale_after_s=-1)
    else:
        execution.hand_back(store, claim)

    assert state(store, experiment) is State.PAUSED
    assert ask(store, experiment, Verb.RESUME) is State.QUEUED


def test_stopping_keeps_what_is_there(store: Store) -> None:
    experiment = submitted(store, repetitions=4)
    whole, half, begun = execution.claim(store, "me", 3)
    run(store, whole)
    deliver(store, half, 9)
    deliver(store, begun, 1)

    asked = ask(store, experiment, Verb.STOP)
    deliver(store, half, 2)
    meanwhile = state(store, experiment)
    deliver(store, begun, 1)

    assert (asked, meanwhile, state(store, experiment)) == (State.STOPPING, State.STOPPING, State.COMPLETED)
    assert states(store, experiment) == [State.COMPLETED, State.COMPLETED, State.CANCELLED, State.CANCELLED]
    assert [len(each) for each in stored(store, experiment)] == [13, 10, 2, 0]
    assert [point.n for point in curves.curve(store, experiment).points] == [2, 2, 1]
    assert reading.read_experiment(store, experiment).progress.time_left is None
    assert endings(store, experiment, 1) == [Ending.STOPPED]


@pytest.mark.parametrize("steps", [None, 0, 2])
def test_an_experiment_stopped_before_its_first_point_is_not_completed_with_nothing(store: Store, steps: Any) -> None:
    experiment = submitted(store)
    if steps is not None:
        (claim,) = execution.claim(store, "me", 1)
        deliver(store, claim, steps)

    ask(store, experiment, Verb.STOP)
    if steps is not None:
        execution.release(store, claim, "killed")

    assert state(store, experiment) is State.CANCELLED
    assert set(states(store, experiment)) == {State.CANCELLED}
    assert reading.read_experiment(store, experiment).ended_at is not None


def test_cancelling_ends_the_attempts(store: Store) -> None:
    experiment = submitted(store)
    (claim,) = execution.claim(store, "me", 1)

    ask(store, experiment, Verb.CANCEL)

    assert endings(store, experiment) == [Ending.CANCELLED]
    assert not execution.record(store, claim, next(some_log()))


def in_state(store: Store, wanted: Any) -> Any:
    """An experiment that has got there by permitted moves."""
    if wanted is State.WAITING:
        experiment = submitted(store, strategy="random", reality={"kind": "physical"})
        supervise(store)
        assert state(store, experiment) is wanted
        return experiment
    experiment = submitted(store)
    (claim,) = execution.claim(store, "me", 1) if wanted not in (State.QUEUED, State.PAUSED) else (None,)
    if wanted is State.COMPLETED:
        run(store, claim)
        compute_with(store, some_log)
    elif wanted is State.FAILED:
        for each in (claim, *execution.claim(store, "me", 9)):
            execution.fail(store, each, Failure("broken"))
    else:
        verbs = {State.PAUSING: Verb.PAUSE, State.PAUSED: Verb.PAUSE, State.STOPPING: Verb.STOP}
        verbs[State.CANCELLED] = Verb.CANCEL
        if wanted in verbs:
            ask(store, experiment, verbs[wanted])
    assert state(store, experiment) is wanted
    return experiment


def compute_with(store: Store, log: Any) -> None:
    for each in execution.claim(store, "me", 9):
        run(store, each, log())


def obey(store: Store, experiment: Any, verb: Any) -> Any:
    if verb is Verb.EXTEND:
        return lifecycle.extend(store, experiment, ExtensionSpec(iterations=9)).state
    return ask(store, experiment, verb)


@pytest.mark.parametrize("here", list(State))
def test_a_forbidden_verb_is_refused_and_changes_nothing(store: Store, here: Any) -> None:
    experiment = in_state(store, here)
    before = reading.read_experiment(store, experiment)
    failed = here is State.FAILED
    able = (
        ", ".join(each for each in Verb if here in PERMITTED[each] and (failed or each is not Verb.RETRY)) or "nothing"
    )

    for verb in (each for each in Verb if here not in PERMITTED[each]):
        with pytest.raises(Conflict, match=f"is {here} and cannot be .*: {able}$"):
            obey(store, experiment, verb)

    after = reading.read_experiment(store, experiment)
    assert after.model_copy(update={"progress": before.progress}) == before


@pytest.mark.dialects
def test_a_verb_of_a_study_goes_to_all_of_its_experiments_that_permit_it(store: Store) -> None:
    small = {"robot": "toy_function", "budget": "smoke", "strategies": ["random", "simulated_fit", "direct"]}
    study = submission.submit(store, StudySpec.model_validate(small))
    first, second, third = (each.id for each in study.experiments)
    ask(store, first, Verb.CANCEL)
    ask(store, second, Verb.PAUSE)

    paused = lifecycle.ask(store, study.id, Verb.PAUSE)
    with pytest.raises(Conflict, match="is CANCELLED and PAUSED and cannot be paused; permitted: resume, stop, cancel"):
        lifecycle.ask(store, study.id, Verb.PAUSE)
    resumed = lifecycle.ask(store, study.id, Verb.RESUME)
    cancelled = lifecycle.ask(store, study.id, Verb.CANCEL)

    assert [each.state for each in paused.experiments] == [State.CANCELLED, State.PAUSED, State.PAUSED]
    assert (paused.state, resumed.state, cancelled.state) == (State.PAUSED, State.RUNNING, State.CANCELLED)
    assert [each.id for each in cancelled.experiments] == [first, second, third]
    with pytest.raises(NotFound):
        lifecycle.ask(store, "nope", Verb.STOP)


@pytest.mark.parametrize("strategy", ["simulated_fit_and_informative", "simulated_fit"])
def test_an_extended_experiment_equals_one_that_was_submitted_with_the_larger_totals(
    store: Store, strategy: Any
) -> None:
    small = submitted(store, strategy=strategy, iterations=1, repetitions=1)
    before = compute(store, small)
    large = submitted(store, strategy=strategy, iterations=3, repetitions=2)
    expected = compute(store, large)

    extended = lifecycle.extend(store, small, ExtensionSpec(iterations=3, repetitions=2))
    queued = states(store, small)
    found = compute(store, small)

    assert extended.state is State.QUEUED
    assert queued == [State.QUEUED, State.QUEUED]
    assert same(tuple(found), tuple(expected))
    assert same(found[0][: len(before[0])], before[0])
    one, other = (reading.read_experiment(store, each) for each in (small, large))
    assert (one.spec, one.state) == (other.spec, State.COMPLETED)
    assert one.progress == other.progress
    assert curves.curve(store, small).points == curves.curve(store, large).points


def test_an_extended_study_equals_one_that_was_submitted_with_the_larger_totals(store: Store) -> None:
    small = compared(store, iterations=1, repetitions=1)
    large = compared(store, iterations=2, repetitions=2)

    extended = lifecycle.extend(store, small.id, ExtensionSpec(iterations=2, repetitions=2))
    for experiment in (*small.experiments[:2], *large.experiments):
        compute(store, experiment.id)

    assert [each.state for each in extended.experiments] == [State.QUEUED, State.QUEUED, State.COMPLETED]
    found, expected = (reading.read(store, each.id) for each in (small, large))
    assert [each.spec for each in found.experiments[:2]] == [each.spec for each in expected.experiments[:2]]
    assert found.state is State.COMPLETED
    for one, other in zip(found.experiments, expected.experiments, strict=True):
        assert curves.curve(store, one.id).points == curves.curve(store, other.id).points
    with pytest.raises(Conflict, match="3 repetitions already, and none of these is left to run"):
        lifecycle.extend(store, small.id, ExtensionSpec(iterations=2, repetitions=2))
    with pytest.raises(InvalidSpec, match="give a total of iterations"):
        lifecycle.extend(store, small.id, ExtensionSpec())


def test_a_study_of_which_nothing_has_completed_is_not_extended(store: Store) -> None:
    study = compared(store, compute_it=False, iterations=1, repetitions=1)

    with pytest.raises(Conflict, match="is QUEUED and cannot be extended; permitted: pause, stop, cancel"):
        lifecycle.extend(store, study.id, ExtensionSpec(repetitions=9))
    with pytest.raises(NotFound):
        lifecycle.extend(store, "nope", ExtensionSpec(repetitions=9))


def compared(store: Store, *, compute_it: bool = True, **changes: Any) -> Any:
    """A study of two strategies and of the direct baseline, which has three repetitions."""
    spec = {"robot": "toy_function", "budget": "smoke", "strategies": ["random", "simulated_fit", "direct"], **changes}
    study = submission.submit(store, StudySpec.model_validate(spec | {"direct_repetitions": 3}))
    for experiment in study.experiments if compute_it else ():
        compute(store, experiment.id)
    return study


def test_extending_a_stopped_experiment_to_what_it_had_brings_it_to_its_end(store: Store) -> None:
    whole = submitted(store, repetitions=3)
    expected = compute(store, whole)
    experiment = submitted(store, repetitions=3)
    first, second = execution.claim(store, "me", 2)
    run(store, first, repetition(setting(first.spec, 0)))
    ask(store, experiment, Verb.STOP)
    execution.record(store, second, next(repetition(setting(second.spec, 1))))

    lifecycle.extend(store, experiment, ExtensionSpec(repetitions=3))
    found = compute(store, experiment)

    assert same(tuple(found), tuple(expected))
    assert states(store, experiment) == [State.COMPLETED] * 3
    with pytest.raises(Conflict, match="2 iterations and 3 repetitions already"):
        lifecycle.extend(store, experiment, ExtensionSpec(repetitions=3))


def test_repetitions_of_the_direct_baseline_can_be_extended_but_it_has_no_iterations(store: Store) -> None:
    experiment = submitted(store, strategy="direct", repetitions=1)
    before = compute(store, experiment)

    with pytest.raises(InvalidSpec, match="direct baseline has no iterations"):
        lifecycle.extend(store, experiment, ExtensionSpec(iterations=5))
    lifecycle.extend(store, experiment, ExtensionSpec(repetitions=2))

    found = compute(store, experiment)
    assert same(found[0], before[0])
    assert [len(each) for each in found] == [3, 3]


@pytest.mark.parametrize("totals", [{"iterations": 1}, {"repetitions": 2}, {"iterations": 9, "repetitions": 1}, {}])
def test_totals_below_what_is_there_are_refused(store: Store, totals: Any) -> None:
    experiment = in_state(store, State.COMPLETED)

    with pytest.raises(InvalidSpec, match=r"that there are; give a total|give a total of"):
        lifecycle.extend(store, experiment, ExtensionSpec(**totals))

    assert state(store, experiment) is State.COMPLETED


def test_a_failed_repetition_is_not_tried_again_by_extending(store: Store) -> None:
    experiment = submitted(store, repetitions=2)
    first, second = execution.claim(store, "me", 2)
    run(store, first)
    execution.fail(store, second, Failure("broken"))

    lifecycle.extend(store, experiment, ExtensionSpec(iterations=3))

    assert states(store, experiment) == [State.QUEUED, State.FAILED]


def test_reality_is_hidden_again_while_an_extended_experiment_runs(store: Store) -> None:
    experiment = in_state(store, State.COMPLETED)
    shown = reading.read_experiment(store, experiment).spec["reality"]["parameters"]

    extended = lifecycle.extend(store, experiment, ExtensionSpec(repetitions=9))

    assert set(extended.experiments[0].spec["reality"]["parameters"].values()) == {None}
    assert None not in shown.values()


def test_attempts_say_who_had_a_repetition_and_how_it_ended(store: Store) -> None:
    experiment = submitted(store, repetitions=1)
    for owner, end in (
        ("first", lambda claim: execution.release(store, claim, "its process was killed")),
        ("second", lambda claim: execution.requeue_lost(store, stale_after_s=-1)),
        ("third", lambda claim: execution.hand_back(store, claim)),
        ("fourth", lambda claim: execution.fail(store, claim, Failure("ZeroDivisionError"))),
    ):
        (claim,) = execution.claim(store, owner, 1)
        end(claim)

    found = reading.list_attempts(store, experiment, 0)

    assert [(each.number, each.owner, each.ending, each.reason) for each in found] == [
        (1, "first", Ending.LOST, "its process was killed"),
        (2, "second", Ending.LOST, "its worker was not heard of for -1 s"),
        (3, "third", Ending.HANDED_BACK, None),
        (4, "fourth", Ending.FAILED, "ZeroDivisionError"),
    ]
    assert all(each.started_at <= each.ended_at for each in found)
    with pytest.raises(NotFound, match="no repetition 1"):
        reading.list_attempts(store, experiment, 1)


def test_an_attempt_that_goes_on_has_no_end(store: Store) -> None:
    experiment = submitted(store)
    execution.claim(store, "me", 1)

    (found,) = reading.list_attempts(store, experiment, 0)

    assert (found.ended_at, found.ending) == (None, None)
    assert reading.list_attempts(store, experiment, 1) == ()
