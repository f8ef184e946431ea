"""Checkpoints of the step under way: made by the worker, kept by the store, and used once."""

import time
from itertools import islice
from threading import enumerate as threads
from typing import Any

import numpy as np
import pytest

from gaplab.schemas.lifecycle import State, Verb
from gaplab.schemas.records import Progress
from gaplab.services.core.answers import unpack
from gaplab.services.core.errors import Conflict
from gaplab.services.core.loop import repetition
from gaplab.services.experiments import reading
from gaplab.services.experiments.lifecycle import ask
from gaplab.services.running import execution
from gaplab.services.running.leases import MAX_LOSSES
from gaplab.services.specs.assembly import setting
from gaplab.services.store.lease import Checkpoint, Failure, Pulse, TimedStep
from gaplab.services.store.models import CheckpointRow
from gaplab.services.store.session import Store
from gaplab.workers.checkpoints import StepRecorder, recorded
from tests.experiments import cancel, same, some_log, submit_one, toy
from tests.fakes import Recorder, flat, paraboloid, small_setting
from tests.waiting import wait_until


def steps_of(told: Any) -> Any:
    return [each for each in told if not isinstance(each, Checkpoint)]


def test_a_repetition_told_at_any_moment_goes_on_from_there() -> None:
    whole = [flat(step) for step in repetition(small_setting())]
    told = list(recorded(small_setting(), (), (), 0.0))

    for until in range(0, len(told), 7):
        log = [each.step for each in steps_of(told[:until])]
        checkpoints = [each for each in told[:until] if isinstance(each, Checkpoint) and each.step == len(log)]
        assert [each.part for each in checkpoints] == list(range(len(checkpoints)))
        rest = steps_of(recorded(small_setting(), log, checkpoints, 0.0))
        assert [flat(step) for step in (*log, *(each.step for each in rest))] == whole
        assert not rest or rest[0].seconds > sum(each.seconds for each in checkpoints)


def test_what_a_checkpoint_has_is_not_simulated_again() -> None:
    first, second = Recorder(), Recorder()
    told = list(recorded(small_setting(simulate=first), (), (), 0.0))
    checkpoints = [each for each in told if isinstance(each, Checkpoint) and each.step == 1]

    list(recorded(small_setting(simulate=second, iterations=0), [told[0].step], checkpoints, 3600.0))  # type: ignore[list-item, union-attr]

    answered = sum(len(row) for each in checkpoints for _, row in unpack(each.answers))
    assert answered == 40
    assert second.rollouts == 0


def test_short_steps_have_no_checkpoints() -> None:
    assert not any(isinstance(each, Checkpoint) for each in recorded(small_setting(), (), (), 3600.0))


def test_a_call_that_would_take_long_is_made_in_several() -> None:
    def slow(genomes: Any, parameters: Any) -> Any:
        time.sleep(0.002 * len(genomes))
        return paraboloid(genomes, parameters)

    calls, told = Recorder(slow), []  # type: ignore[var-annotated]
    answers = StepRecorder(told.append, 0.02, tuple(islice(repetition(small_setting()), 5))).answers(
        small_setting(simulate=calls)
    )
    genomes = np.random.default_rng(0).random((30, 2))

    fitnesses = answers(genomes, genomes[:2])

    np.testing.assert_array_equal(fitnesses, paraboloid(genomes, genomes[:2]))
    assert len(calls.calls) > 2
    assert [(each.step, each.part) for each in told] == [(5, number) for number in range(len(told))]
    assert told


def test_what_a_repetition_raises_is_raised_where_its_steps_are_taken() -> None:
    def broken(genomes: Any, parameters: Any) -> None:
        msg = "broken"
        raise ZeroDivisionError(msg)

    steps = recorded(small_setting(simulate=broken), (), ())

    next(steps)
    with pytest.raises(ZeroDivisionError, match="broken"):
        next(steps)


def test_a_repetition_that_nobody_wants_ends() -> None:
    steps = recorded(small_setting(iterations=100_000), (), ())
    next(steps)

    steps.close()  # type: ignore[attr-defined]

    wait_until(lambda: all(each.name != "repetition" for each in threads()))


def part(step: Any, number: Any, answers: Any = b"answers", seconds: Any = 2.0) -> Any:
    return Checkpoint(step, number, answers, seconds)


def checkpoints_left(store: Store) -> Any:
    with store.reading() as session:
        return session.query(CheckpointRow).count()


@pytest.mark.dialects
def test_checkpoints_of_the_step_under_way_are_handed_out_with_the_claim(store: Store) -> None:
    submit_one(store, toy())
    (claim,) = execution.claim(store, "me", 1)
    first = next(some_log())

    assert execution.record_all(store, [(claim, [TimedStep(first, 1.0), part(1, 0, b"a\0b"), part(1, 1)])])
    assert execution.record_all(store, [(claim, [part(1, 2, b"")])])
    execution.release(store, claim, "killed")

    (claim,) = execution.claim(store, "me", 1)
    assert same(claim.log, (first,))
    assert claim.checkpoints == (part(1, 0, b"a\0b"), part(1, 1), part(1, 2, b""))


@pytest.mark.dialects
def test_a_checkpoint_that_is_delivered_twice_is_stored_once(store: Store) -> None:
    submit_one(store, toy())
    (claim,) = execution.claim(store, "me", 1)

    for delivered in ([part(0, 0)], [part(0, 0)], [part(0, 0), part(0, 1)]):
        assert execution.record_all(store, [(claim, delivered)])

    assert checkpoints_left(store) == 2


def test_checkpoints_are_gone_once_their_step_is_recorded(store: Store) -> None:
    submit_one(store, toy())
    claims = execution.claim(store, "me", 2)
    execution.record_all(store, [(claim, [part(0, 0), part(0, 1)]) for claim in claims])
    first, second, *_ = [TimedStep(each, 0.5) for each in some_log()]

    execution.record_all(store, [(claims[0], [first, part(1, 0), second])])
    execution.record_all(store, [(claims[0], [part(0, 1), part(1, 0)])])

    assert checkpoints_left(store) == 2
    execution.release(store, claims[1], "killed")
    assert execution.claim(store, "me", 1)[0].checkpoints == (part(0, 0), part(0, 1))


@pytest.mark.parametrize("wrong", [part(0, 1), part(1, 0)])
def test_a_checkpoint_that_would_leave_a_hole_is_refused(store: Store, wrong: Any) -> None:
    submit_one(store, toy())
    (claim,) = execution.claim(store, "me", 1)

    with pytest.raises(Conflict, match="next is part 0 of step 0"):
        execution.record_all(store, [(claim, [wrong])])

    assert checkpoints_left(store) == 0


def test_a_late_checkpoint_of_a_holder_who_lost_the_lease_is_not_stored(store: Store) -> None:
    submit_one(store, toy())
    (late,) = execution.claim(store, "me", 1)
    execution.release(store, late, "killed")
    execution.claim(store, "you", 1)

    assert execution.record_all(store, [(late, [part(0, 0)])]) == ()

    assert checkpoints_left(store) == 0


def test_one_that_gets_on_within_a_step_may_be_lost_any_number_of_times(store: Store) -> None:
    submitted = submit_one(store, toy(repetitions=1))

    for number in range(2 * MAX_LOSSES):
        (claim,) = execution.claim(store, "me", 1)
        execution.record_all(store, [(claim, [part(0, number)])])
        execution.release(store, claim, "killed")

    assert reading.read_experiment(store, submitted.id).state is State.RUNNING


def test_cancelling_forgets_checkpoints(store: Store) -> None:
    submitted = submit_one(store, toy())
    (claim,) = execution.claim(store, "me", 1)
    execution.record_all(store, [(claim, [part(0, 0)])])

    cancel(store, submitted.id)

    assert checkpoints_left(store) == 0


@pytest.mark.parametrize("hopeless", [True, False])
def test_a_repetition_that_fails_leaves_no_checkpoints(store: Store, hopeless: Any) -> None:
    submit_one(store, toy(repetitions=1))
    (claim,) = execution.claim(store, "me", 1)
    execution.record_all(store, [(claim, [part(0, 0)])])

    for _ in range(MAX_LOSSES if hopeless else 0):
        assert checkpoints_left(store) == 1
        execution.release(store, claim, "killed")
        (claim,) = execution.claim(store, "me", 1) or (claim,)
    assert execution.fail(store, claim, Failure("no")) is not hopeless

    assert checkpoints_left(store) == 0


def test_a_repetition_that_is_retried_stores_checkpoints_again(store: Store) -> None:
    submitted = submit_one(store, toy(repetitions=1))
    (claim,) = execution.claim(store, "me", 1)
    execution.record_all(store, [(claim, [part(0, 0), part(0, 1)])])
    execution.fail(store, claim, Failure("no"))
    ask(store, submitted.id, Verb.RETRY)
    (claim,) = execution.claim(store, "me", 1)
    assert claim.checkpoints == ()

    execution.record_all(store, [(claim, [part(0, 0)])])
    execution.hand_back(store, claim)

    (claim,) = execution.claim(store, "me", 1)
    assert claim.checkpoints == (part(0, 0),)


def test_a_claim_that_timed_out_is_handed_back_and_those_that_are_known_stay(store: Store) -> None:
    submitted = submit_one(store, toy())
    (known,) = execution.claim(store, "me", 1)
    execution.claim(store, "me", 1)
    (others,) = execution.claim(store, "you", 1)

    assert execution.hand_back_unheard(store, "me", [known]) == 1

    states = [(each.state, each.attempts) for each in reading.list_repetitions(store, submitted.id)]
    assert states == [(State.RUNNING, 1), (State.QUEUED, 0), (State.RUNNING, 1)]
    assert execution.heartbeat(store, [known, others]) == (known, others)


@pytest.mark.dialects
def test_progress_tells_how_far_a_tuning_has_come(store: Store) -> None:
    spec = toy(repetitions=1, iterations=1)
    submitted = submit_one(store, spec)
    (claim,) = execution.claim(store, "me", 1)
    seen: list[Progress] = []

    for each in recorded(setting(claim.spec, claim.number), (), (), 0.0):
        if not isinstance(each, Pulse):
            execution.record_all(store, [(claim, [each])])
            seen.append(reading.read_experiment(store, submitted.id).progress)

    tuning = [(step, progress) for progress in seen for step in progress.steps if step.kind == "tuning"]
    assert {(step.repetition, step.iteration, step.budget) for step, _ in tuning} == {(0, 1, tuning[0][0].budget)}
    assert 0 < tuning[0][0].rollouts < tuning[-1][0].rollouts <= tuning[0][0].budget
    assert f"; tuning 1: {100 * tuning[1][0].rollouts // tuning[1][0].budget} %" in tuning[1][1].text
    done = [progress.rollouts_done + progress.rollouts_saved for progress in seen]
    assert done == sorted(done)
    assert (done[-1], seen[-1].steps) == (seen[-1].rollouts, ())
