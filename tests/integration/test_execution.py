"""Leases and the log: what supervisors rely on, on both databases."""

from concurrent.futures import ThreadPoolExecutor
from typing import Any

import pytest
from sqlalchemy import text

from gaplab.schemas.lifecycle import State
from gaplab.services import events
from gaplab.services.core.errors import Conflict
from gaplab.services.core.loop import repetition
from gaplab.services.core.types import Cost
from gaplab.services.events import WantedEvents
from gaplab.services.experiments import checks, reading
from gaplab.services.running import execution, sensitivity
from gaplab.services.running.leases import MAX_LOSSES
from gaplab.services.specs.assembly import setting
from gaplab.services.store.lease import Failure, TimedStep
from gaplab.services.store.session import Store
from gaplab.services.store.texts import LONGEST_REASON
from tests.experiments import cancel, listed, run, same, some_log, submit_one, toy


@pytest.mark.dialects
def test_a_claim_has_the_resolved_spec_and_no_log_at_first(store: Store) -> None:
    submitted = submit_one(store, toy(reality={"parameters": {"static_friction": 0.9}}))

    (claim,) = execution.claim(store, "me", 1)

    assert (claim.experiment_id, claim.number, claim.epoch, claim.log) == (submitted.id, 0, 1, ())
    assert claim.spec.engine is not None
    assert claim.spec.reality.parameters == {"static_friction": 0.9, "dynamic_friction": 0.8}


def test_the_first_claim_starts_the_experiment(store: Store) -> None:
    started = submit_one(store, toy())
    waiting = submit_one(store, toy())

    execution.claim(store, "me", 1)

    assert reading.read_experiment(store, started.id).state is State.RUNNING
    assert reading.read_experiment(store, started.id).started_at is not None
    assert reading.read_experiment(store, waiting.id).state is State.QUEUED


@pytest.mark.dialects
def test_claims_of_many_owners_never_overlap(store: Store) -> None:
    for _ in range(3):
        submit_one(store, toy(repetitions=20))

    def claim_all(owner: Any) -> Any:
        claimed = []
        while claims := execution.claim(store, owner, 3):
            claimed += [each.id for each in claims]
        return claimed

    with ThreadPoolExecutor(4) as pool:
        claimed = [each for claims in pool.map(claim_all, "abcd") for each in claims]

    assert len(claimed) == len(set(claimed)) == 60


@pytest.mark.dialects
def test_the_log_that_is_read_is_the_log_that_was_written(store: Store) -> None:
    submit_one(store, toy())
    (claim,) = execution.claim(store, "me", 1)
    for count, step in enumerate(some_log()):
        assert execution.record(store, claim, step)

        assert execution.release(store, claim, "killed")
        (claim,) = execution.claim(store, "me", 1)

        assert same(claim.log, tuple(some_log())[: count + 1])


def test_a_step_that_is_delivered_twice_is_stored_once(store: Store) -> None:
    submitted = submit_one(store, toy())
    (claim,) = execution.claim(store, "me", 1)

    for step in some_log():
        assert execution.record(store, claim, step, seconds=1.0)
        assert execution.record(store, claim, step, seconds=1.0)
    for step in some_log():
        assert execution.record(store, claim, step, seconds=1.0)

    execution.release(store, claim, "killed")
    assert same(execution.claim(store, "me", 1)[0].log, tuple(some_log()))
    assert reading.read_experiment(store, submitted.id).progress.rollouts_done == 3 * 60 + 2 * 90


def test_a_step_that_would_leave_a_hole_is_refused(store: Store) -> None:
    submit_one(store, toy())
    (claim,) = execution.claim(store, "me", 1)
    first, _, third, *_ = some_log()
    execution.record(store, claim, first)

    with pytest.raises(Conflict, match="the log has 1 steps"):
        execution.record(store, claim, third)

    execution.release(store, claim, "killed")
    assert len(execution.claim(store, "me", 1)[0].log) == 1


def timed(steps: Any) -> Any:
    return [TimedStep(each, 0.5) for each in steps]


def by_experiment(claims: Any, *ids: Any) -> Any:
    return tuple(sorted(claims, key=lambda each: (ids.index(each.experiment_id), each.number)))


@pytest.mark.dialects
def test_many_repetitions_at_once_are_recorded_as_one_step_after_another_would_be(store: Store) -> None:
    one_by_one, together = (submit_one(store, toy()).id for _ in range(2))
    claims = by_experiment(execution.claim(store, "me", 6), one_by_one, together)
    ends = (13, 7, 2)

    for claim, end in zip(claims[:3], ends, strict=True):
        for step in tuple(some_log())[:end]:
            execution.record(store, claim, step, seconds=0.5)
    for part in (slice(0, 2), slice(1, 7), slice(7, 13)):  # one step twice, and nothing new for some
        deliveries = [
            (claim, timed(tuple(some_log())[:end][part])) for claim, end in zip(claims[3:], ends, strict=True)
        ]
        assert execution.record_all(store, deliveries) == claims[3:]

    for each in claims:
        execution.hand_back(store, each)
    again = by_experiment(execution.claim(store, "me", 6), one_by_one, together)
    assert same(tuple(each.log for each in again[:3]), tuple(each.log for each in again[3:]))
    assert [len(each.log) for each in again] == [*ends] * 2
    first, second = (reading.read_experiment(store, each) for each in (one_by_one, together))
    assert first.progress == second.progress


def test_of_many_deliveries_only_those_whose_claim_holds_are_written(store: Store) -> None:
    submit_one(store, toy())
    lost, *held = execution.claim(store, "me", 3)
    execution.release(store, lost, "killed")

    assert execution.record_all(store, [(each, timed(some_log())) for each in (lost, *held)]) == tuple(held)
    assert execution.complete(store, lost, *held) == tuple(held)

    (again,) = execution.claim(store, "me", 3)
    assert (again.number, again.log) == (lost.number, ())


def test_a_hole_in_one_of_many_deliveries_refuses_them_all(store: Store) -> None:
    submit_one(store, toy())
    whole, holed, _ = execution.claim(store, "me", 3)
    first, _, third = tuple(some_log())[:3]

    with pytest.raises(Conflict, match="step 2 of repetition 1 cannot be recorded: the log has 1 steps"):
        execution.record_all(store, [(whole, timed(some_log())), (holed, timed((first, third)))])

    execution.hand_back(store, whole)
    assert execution.claim(store, "me", 1)[0].log == ()


def test_a_holder_who_wakes_up_late_cannot_write(store: Store) -> None:
    submitted = submit_one(store, toy(repetitions=1))
    (late,) = execution.claim(store, "late", 1)
    assert execution.requeue_lost(store, stale_after_s=-1) == 1
    (present,) = execution.claim(store, "present", 1)
    first, second, *_ = some_log()
    execution.record(store, present, first)

    refused = (
        execution.record(store, late, first),
        execution.record(store, late, second),
        bool(execution.complete(store, late)),
        execution.fail(store, late, Failure("x")),
        execution.release(store, late, "x"),
    )

    assert refused == (False,) * 5
    assert execution.heartbeat(store, [late, present]) == (present,)
    assert reading.read_experiment(store, submitted.id).state is State.RUNNING
    assert execution.record(store, present, second)


def test_a_heartbeat_keeps_a_claim(store: Store) -> None:
    submit_one(store, toy(repetitions=2))
    claims = execution.claim(store, "me", 2)

    held = execution.heartbeat(store, claims)

    assert held == claims
    assert execution.heartbeat(store, []) == ()
    assert execution.requeue_lost(store, stale_after_s=30) == 0


@pytest.mark.dialects
def test_a_repetition_that_was_lost_is_queued_again_and_goes_on_from_its_log(store: Store) -> None:
    submitted = submit_one(store, toy(repetitions=1))
    (claim,) = execution.claim(store, "killed", 1)
    first, *_ = some_log()
    execution.record(store, claim, first)

    assert execution.requeue_lost(store, stale_after_s=-1) == 1

    (lost,) = reading.list_repetitions(store, submitted.id)
    (again,) = execution.claim(store, "me", 1)
    assert (lost.state, lost.attempts) == (State.QUEUED, 1)
    assert "not heard of" in lost.error
    assert (again.epoch, len(again.log)) == (2, 1)
    assert reading.read_experiment(store, submitted.id).state is State.RUNNING


def test_a_repetition_that_kills_its_workers_is_failed_in_the_end(store: Store) -> None:
    submitted = submit_one(store, toy(repetitions=1))

    for _ in range(MAX_LOSSES):
        (claim,) = execution.claim(store, "me", 1)
        execution.release(store, claim, "its worker ran out of memory\0\udcff")

    found = reading.read_experiment(store, submitted.id)
    assert execution.claim(store, "me", 1) == ()
    assert found.state is State.FAILED
    assert found.ended_at is not None
    assert found.reasons == (
        f"lost {MAX_LOSSES} times without progress; the last time its worker ran out of memory\ufffd?",
    )


def test_a_repetition_that_gets_on_may_be_lost_any_number_of_times(store: Store) -> None:
    submit_one(store, toy(repetitions=1))

    for step in some_log():
        (claim,) = execution.claim(store, "me", 1)
        execution.record(store, claim, step)
        execution.release(store, claim, "killed")

    (claim,) = execution.claim(store, "me", 1)
    assert execution.complete(store, claim)


def test_a_repetition_may_be_handed_back_any_number_of_times(store: Store) -> None:
    experiment = submit_one(store, toy(repetitions=1)).id

    for _ in range(MAX_LOSSES + 1):
        (claim,) = execution.claim(store, "me", 1)
        assert execution.hand_back(store, claim)

    (found,) = reading.list_repetitions(store, experiment)
    assert (found.state, found.attempts, found.error) == (State.QUEUED, 0, None)
    assert not execution.hand_back(store, claim)
    assert not execution.record(store, claim, next(some_log()))
    assert reading.list_repetitions(store, experiment) == (found,)


def test_the_experiment_is_completed_with_its_last_repetition(store: Store) -> None:
    submitted = submit_one(store, toy(repetitions=3))
    claims = execution.claim(store, "me", 3)
    states = []

    run(store, claims[0])
    states.append(reading.read_experiment(store, submitted.id).state)
    execution.fail(store, claims[1], Failure("the code raised"))
    states.append(reading.read_experiment(store, submitted.id).state)
    run(store, claims[2])

    found = reading.read_experiment(store, submitted.id)
    assert [*states, found.state] == [State.RUNNING, State.RUNNING, State.COMPLETED]
    assert (found.progress.completed, found.progress.failed, found.reasons) == (2, 1, ("the code raised",))
    assert found.ended_at >= found.started_at >= found.created_at


def test_an_experiment_fails_when_all_of_its_repetitions_do_and_says_each_reason_once(store: Store) -> None:
    submitted = submit_one(store, toy(repetitions=3))

    for claim, reason in zip(execution.claim(store, "me", 3), ("zero division", "a key", "zero division"), strict=True):
        assert execution.fail(store, claim, Failure(reason))

    found = reading.read_experiment(store, submitted.id)
    assert found.state is State.FAILED
    assert found.reasons == ("zero division", "a key")


def test_a_long_reason_is_stored_and_shown_as_its_beginning(store: Store) -> None:
    long = "unstable: " + "x" * 5_000_000
    id_ = submit_one(store, toy(repetitions=3)).id
    fails, lost, short = execution.claim(store, "me", 3)
    check = sensitivity.claim(store, "me")
    assert check is not None

    assert execution.fail(store, fails, Failure(long, long))
    assert execution.release(store, lost, long)
    assert sensitivity.fail(store, check, long)
    assert execution.fail(store, short, Failure("short"))
    with store.transaction() as session:
        stored = session.scalars(text("SELECT length(error) FROM repetition")).all()

    told = events.page(store, 0, WantedEvents(), limit=100).items
    shown = [
        *reading.read_experiment(store, id_).reasons,
        *(each.error for each in reading.list_repetitions(store, id_)),
        *(reading.list_attempts(store, id_, number)[0].reason for number in (0, 1)),
        *(each.body["reason"] for each in told if each.body.get("reason")),
        checks.read(store, check.id).reason,
    ]
    assert len(shown) == 11
    assert {each for each in shown if not each.startswith("unstable: x")} == {"short"}
    assert max(map(len, shown)) <= LONGEST_REASON >= max(stored)


@pytest.mark.dialects
def test_repetitions_that_end_at_once_end_their_experiment(store: Store) -> None:
    submitted = submit_one(store, toy(repetitions=8))
    claims = execution.claim(store, "me", 8)
    for claim in claims:
        for step in some_log():
            execution.record(store, claim, step)

    with ThreadPoolExecutor(8) as pool:
        ended = list(pool.map(lambda claim: execution.complete(store, claim), claims))

    assert all(ended)
    assert reading.read_experiment(store, submitted.id).state is State.COMPLETED


def test_a_repetition_with_iterations_missing_is_not_completed(store: Store) -> None:
    submitted = submit_one(store, toy(repetitions=1))
    (claim,) = execution.claim(store, "me", 1)
    for step in some_log(iterations=1):
        execution.record(store, claim, step)

    with pytest.raises(Conflict, match="1 iterations are missing"):
        execution.complete(store, claim)

    assert reading.read_experiment(store, submitted.id).state is State.RUNNING


def test_a_cancelled_experiment_refuses_its_running_repetitions_and_keeps_what_is_stored(store: Store) -> None:
    submitted = submit_one(store, toy())
    (claim,) = execution.claim(store, "me", 1)
    first, second, *_ = some_log()
    execution.record(store, claim, first)

    cancel(store, submitted.id)

    assert not execution.record(store, claim, second)
    assert not execution.complete(store, claim)
    assert not execution.release(store, claim, "cancelled")
    assert execution.heartbeat(store, [claim]) == ()
    assert execution.claim(store, "me", 9) == ()
    assert {each.state for each in reading.list_repetitions(store, submitted.id)} == {State.CANCELLED}
    assert len(reading.list_simulators(store, submitted.id).items) == 2


@pytest.mark.dialects
def test_cancelling_while_repetitions_end_leaves_no_experiment_without_an_end(store: Store) -> None:
    ids = [submit_one(store, toy(repetitions=1)).id for _ in range(10)]
    claims = execution.claim(store, "me", 10)

    def called_off(experiment: str) -> str:
        try:
            cancel(store, experiment)
        except Conflict:
            return "ended before"
        return "cancelled"

    with ThreadPoolExecutor(4) as pool:
        failed = [pool.submit(execution.fail, store, each, Failure("x")) for each in claims]
        cancelled = [pool.submit(called_off, each) for each in ids]

    assert [each.result() for each in failed] == [each.result() == "ended before" for each in cancelled]
    assert all(reading.read_experiment(store, each).state.ended for each in ids)


@pytest.mark.dialects
def test_progress_counts_what_the_steps_took(store: Store) -> None:
    submitted = submit_one(store, toy())
    waiting = submitted.progress
    first, second, _ = execution.claim(store, "me", 3)
    run(store, first)
    for step in list(some_log())[:4]:
        execution.record(store, second, step, seconds=0.5)

    progress = reading.read_experiment(store, submitted.id).progress

    spent = Cost(3 * 60 + 2 * 90, 3 * 3 + 2 * 3)
    assert (waiting.iterations_done, waiting.rollouts_done, waiting.time_left) == (0, 0, None)
    assert (progress.repetitions, progress.completed, progress.failed) == (3, 1, 0)
    assert (progress.iterations, progress.iterations_done) == (9, 4)
    assert (progress.rollouts_done, progress.rollouts_failed) == (spent.rollouts + 90, spent.failures + 4)
    assert (progress.counted_iterations, progress.counted_iterations_done) == (6, 2)
    assert progress.time_left is None  # of a pace of milliseconds nothing is known


def test_nothing_is_left_to_do_at_the_end(store: Store) -> None:
    submitted = submit_one(store, toy(repetitions=1))
    (claim,) = execution.claim(store, "me", 1)

    run(store, claim)

    assert reading.read_experiment(store, submitted.id).progress.time_left is None


def test_the_budgeted_rollouts_are_those_that_a_repetition_takes_or_saves(store: Store) -> None:
    for strategy in ("simulated_fit_and_informative", "known_fit", "direct"):
        submit_one(store, toy(strategy=strategy, repetitions=1))
    for claim in execution.claim(store, "me", 3):
        run(store, claim, repetition(setting(claim.spec, claim.number)))

    found = [each.progress for each in listed(store)]

    assert [each.rollouts_done + each.rollouts_saved for each in found] == [each.rollouts for each in found]
