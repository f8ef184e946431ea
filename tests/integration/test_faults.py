"""Faults of plug-ins, of reality and of hardware: each concerns the repetitions that it hits, and nothing else."""

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from datetime import timedelta
from functools import partial
from threading import Event, Lock, Thread
from threading import enumerate as enumerate_threads
from types import SimpleNamespace
from typing import Any, ClassVar

import numpy as np
import pytest
from sqlalchemy import update

from gaplab.schemas.lifecycle import Ending, State, Verb
from gaplab.schemas.spec import ExperimentSpec, StudySpec
from gaplab.services.core.errors import Conflict, InvalidSpec, TryAgain
from gaplab.services.core.loop import repetition
from gaplab.services.core.strategies import strategies
from gaplab.services.core.strategies.base import Strategy
from gaplab.services.core.types import Measured, Outcome, Probed, Sample, Tuned
from gaplab.services.engines import engines
from gaplab.services.engines.analytic import Analytic
from gaplab.services.experiments import checks, lease_ends, lifecycle, reading, submission
from gaplab.services.experiments.lease_ends import Silences
from gaplab.services.running import execution, sensitivity
from gaplab.services.running.leases import MAX_LOSSES
from gaplab.services.specs.assembly import setting
from gaplab.services.specs.resolution import resolve_experiment
from gaplab.services.store.clock import moment
from gaplab.services.store.lease import Claim, Failure, Pulse, TimedStep
from gaplab.services.store.models import EventRow, ExperimentRow, RepetitionRow
from gaplab.services.store.queries.experiments import lock
from gaplab.services.store.queries.logs import logs
from gaplab.services.store.session import Session, Store
from gaplab.workers import checkpoints, permits
from gaplab.workers.repetitions import Repetitions
from gaplab.workers.task import Patience, Run, stuck
from tests.experiments import submit_one
from tests.fakes import flat, install
from tests.without_ray import Here, HereTask, HereTasks

POLL_S = 0.001
CHECKPOINT_S = 60.0
SMALL = {
    "strategy": "simulated_fit",
    "robot": "toy_function",
    "iterations": 2,
    "repetitions": 2,
    "optimizer": {"name": "steady_state", "options": {"population": 4}},
    "budget": {"controller_evaluations": 8, "selection_evaluations": 8, "simulator_evaluations": 8},
}


class Liar(Strategy):
    """Returns what it is told to, or raises it."""

    name = "liar"
    searches = False
    answer: ClassVar[Any] = None

    def select(self, belief: Any, search: Any, rng: Any) -> Any:
        if isinstance(self.answer, BaseException):
            raise self.answer
        answer = type(self).answer
        return answer(belief.known) if callable(answer) else answer


class Bench(Analytic):
    """Hardware, as far as gaplab knows: it counts its measurements, and raises what it is told to."""

    name = "bench"
    repeatable = False
    asked: ClassVar[int] = 0
    errors: ClassVar[list[BaseException]] = []

    def rollouts(self, worlds: Any, motions: Any) -> Any:
        type(self).asked += 1
        if self.errors and (error := self.errors.pop(0)) is not None:
            raise error
        return super().rollouts(worlds, motions)


class Unsendable(Exception):
    """An error that cannot be pickled, nor shown."""

    def __init__(self) -> None:
        super().__init__(Lock())

    def __str__(self) -> str:
        raise RuntimeError


@pytest.fixture(autouse=True)
def plugins(monkeypatch: pytest.MonkeyPatch) -> None:
    install(monkeypatch, strategies, Liar)
    install(monkeypatch, engines, Bench)
    Bench.asked, Bench.errors, Liar.answer = 0, [], None
    monkeypatch.setattr(checkpoints, "PAUSES_S", (0.0, 0.0, 0.0))


def small(**changes: Any) -> ExperimentSpec:
    return ExperimentSpec.model_validate(SMALL | changes)


def on_the_bench(**changes: Any) -> ExperimentSpec:
    return small(reality={"engine": "bench"}, **changes)


def work(store: Store, here: Here | None = None) -> None:
    """Rounds of a supervisor until nothing can go on."""
    here = here or Here(store, CHECKPOINT_S)
    for _ in range(400):
        here.step()
        with store.reading() as session:
            if not here.busy and not session.query(RepetitionRow).filter_by(state=State.RUNNING).count():
                claimable = session.query(ExperimentRow).filter_by(claimable=True).count()
                if not claimable:
                    return
    raise AssertionError("it does not come to an end")


def stored(store: Store, experiment: str) -> dict[int, Any]:
    with store.reading() as session:
        rows = session.query(RepetitionRow).filter_by(experiment_id=experiment).all()
        return {row.number: flat(logs(session, [row.id])[row.id]) for row in rows}


def computed(spec: ExperimentSpec) -> dict[int, Any]:
    resolved = resolve_experiment(spec)
    return {number: flat(tuple(repetition(setting(resolved, number)))) for number in range(resolved.repetitions)}


@pytest.mark.parametrize(
    ("answer", "reason"),
    [
        (lambda known: known[None, :], "strategy 'liar' returned an array of shape (1, 1)"),
        pytest.param(lambda known: np.full_like(known, np.nan), "returned nan as number 0", marks=pytest.mark.release),
        pytest.param(lambda known: known + 1e9, "permitted: 0.0 to 1.0", marks=pytest.mark.release),
        pytest.param(None, "strategy 'liar' returned None", marks=pytest.mark.release),
        (SystemExit("the end"), "strategy 'liar' raised SystemExit (test_faults.py, line "),
        pytest.param(IndexError("no such leg"), "): no such leg", marks=pytest.mark.release),
        (Unsendable(), "its message cannot be shown"),
    ],
)
def test_a_strategy_that_lies_fails_alone_and_is_named(store: Store, answer: Any, reason: str) -> None:
    Liar.answer = answer
    lying = submit_one(store, small(strategy="liar")).id
    honest = submit_one(store, small()).id

    work(store)

    read = reading.read_experiment(store, lying)
    assert read.state is State.FAILED
    assert any(reason in each for each in read.reasons), read.reasons
    assert reading.read_experiment(store, honest).state is State.COMPLETED
    assert stored(store, honest) == computed(small())


class LeftOut(HereTasks):
    """Repetition 1 leaves out a part of what it has done, in its first attempts."""

    part: ClassVar[Any]
    attempts: ClassVar[int]

    def start(self, claim: Claim, expected: Any, checkpoint_s: float) -> HereTask:
        def stream() -> Iterator[Any]:
            steps = [TimedStep(step, 0.0) for step in repetition(setting(claim.spec, claim.number), claim.log)]
            if claim.number == 1 and claim.epoch <= self.attempts:
                del steps[self.part]
            yield tuple(steps)

        return HereTask(stream())


class Nonsense(HereTasks):
    """Repetition 1 delivers a step that no table holds."""

    def start(self, claim: Claim, expected: Any, checkpoint_s: float) -> HereTask:
        if claim.number != 1:
            return super().start(claim, expected, checkpoint_s)
        nonsense = TimedStep(Tuned(0, ("no simulator",)), 0.0)  # type: ignore[arg-type]
        return HereTask(each for each in [(nonsense,)])


def with_tasks(kind: type[HereTasks], store: Store) -> Here:
    return type("Such", (Here,), {"tasks": kind})(store, CHECKPOINT_S)  # type: ignore[no-any-return]


def test_what_cannot_be_stored_fails_its_repetition_alone(sqlite_store: Store) -> None:
    experiment = submit_one(sqlite_store, small()).id

    work(sqlite_store, with_tasks(Nonsense, sqlite_store))

    states = [each.state for each in reading.list_repetitions(sqlite_store, experiment)]
    assert states == [State.COMPLETED, State.FAILED]
    assert "what it delivered cannot be stored" in reading.read_experiment(sqlite_store, experiment).reasons[0]


@pytest.mark.parametrize(
    ("part", "reason"),
    [
        (slice(0, 1), "could not be stored: step 1 of repetition 1 cannot be recorded: the log has 0 steps"),
        (slice(-2, None), "it ended too early: repetition 1"),
    ],
)
def test_a_repetition_that_its_log_refuses_is_queued_again_alone(sqlite_store: Store, part: Any, reason: str) -> None:
    LeftOut.part, LeftOut.attempts = part, 1
    experiment = submit_one(sqlite_store, small()).id

    work(sqlite_store, with_tasks(LeftOut, sqlite_store))

    first, second = reading.list_attempts(sqlite_store, experiment, 1)
    assert (first.ending, second.ending) == (Ending.LOST, Ending.COMPLETED)
    assert reason in str(first.reason)
    assert [each.attempts for each in reading.list_repetitions(sqlite_store, experiment)] == [1, 2]
    assert stored(sqlite_store, experiment) == computed(small())


def test_a_repetition_that_its_log_refuses_again_and_again_is_failed_alone(sqlite_store: Store) -> None:
    LeftOut.part, LeftOut.attempts = slice(0, 1), 99
    experiment = submit_one(sqlite_store, small()).id

    work(sqlite_store, with_tasks(LeftOut, sqlite_store))

    repetitions = reading.list_repetitions(sqlite_store, experiment)
    assert [each.state for each in repetitions] == [State.COMPLETED, State.FAILED]
    assert "cannot be recorded" in str(repetitions[1].error)


def test_an_error_of_reality_pauses_says_so_hides_what_it_names_and_costs_no_sample(store: Store) -> None:
    spec = on_the_bench(repetitions=1)
    Bench.errors[:] = [None, None, ValueError("unstable in static_friction=0.987")]  # type: ignore[list-item]
    experiment = submit_one(store, spec).id

    work(store)

    read = reading.read_experiment(store, experiment)
    (paused,) = reading.list_repetitions(store, experiment)
    (attempt,) = reading.list_attempts(store, experiment, 0)
    assert (read.state, paused.state, attempt.ending) == (State.PAUSED, State.QUEUED, Ending.FAILED)
    assert "engine 'bench' raised ValueError (test_faults.py, line" in read.reasons[0]
    with store.reading() as session:
        events = [event.body for event in session.query(EventRow)]
    assert "0.987" not in f"{read} {paused} {attempt} {events}"

    lifecycle.ask(store, experiment, Verb.RESUME)
    work(store)

    ended = reading.read_experiment(store, experiment)
    assert (ended.state, ended.reasons) == (State.COMPLETED, ())
    assert "0.987" in str(reading.list_attempts(store, experiment, 0)[0].reason)
    assert stored(store, experiment) == computed(spec)
    assert Bench.asked == 2 * (1 + 2 * 2) + 1  # each once here and once in `computed`, and the one that failed


def test_an_error_that_may_pass_is_tried_again_by_itself(sqlite_store: Store) -> None:
    error = TryAgain("dropped")
    assert all(map(checkpoints.may_pass, (error, ConnectionError("wireless"), TimeoutError(), MemoryError())))
    Bench.errors[:] = [None, error, error, error]  # type: ignore[list-item]
    experiment = submit_one(sqlite_store, on_the_bench(repetitions=1)).id

    work(sqlite_store)

    (attempt,) = reading.list_attempts(sqlite_store, experiment, 0)
    assert attempt.ending is Ending.COMPLETED
    assert stored(sqlite_store, experiment) == computed(on_the_bench(repetitions=1))


def test_an_error_that_does_not_pass_pauses_after_three_tries(sqlite_store: Store) -> None:
    Bench.errors[:] = [TryAgain("dropped")] * 9
    experiment = submit_one(sqlite_store, on_the_bench(repetitions=1)).id

    work(sqlite_store)

    assert (reading.read_experiment(sqlite_store, experiment).state, Bench.asked) == (State.PAUSED, 4)


def test_what_failed_is_retried_from_its_stored_steps(store: Store) -> None:
    spec = small(strategy="liar")
    answers = iter([np.array([0.25]), None])
    Liar.answer = lambda _: next(answers, None)
    experiment = submit_one(store, spec).id
    work(store)
    failed = stored(store, experiment)

    Liar.answer = lambda _: np.array([0.75])
    retried = lifecycle.ask(store, experiment, Verb.RETRY)
    work(store)

    read = reading.read_experiment(store, experiment)
    assert (retried.state, retried.progress.failed) == (State.QUEUED, 0)
    assert (read.state, read.reasons) == (State.COMPLETED, ())
    again = stored(store, experiment)
    assert all(again[number][: len(steps)] == steps for number, steps in failed.items())
    assert max(len(steps) for steps in failed.values()) > 3
    with pytest.raises(Conflict, match=r"no repetition of study .* has FAILED"):
        lifecycle.ask(store, experiment, Verb.RETRY)


def test_a_failed_repetition_of_a_study_is_retried_while_others_go_on(store: Store) -> None:
    study = submission.submit(store, study_spec())
    first, second = (each.id for each in study.experiments)
    for claim in execution.claim(store, "me", 9):
        if claim.experiment_id == first and claim.number == 0:
            execution.fail(store, claim, Failure("a foot fell off"))
    running = reading.read_experiment(store, first).state

    lifecycle.ask(store, study.id, Verb.RETRY)

    states = [each.state for each in reading.list_repetitions(store, first)]
    assert (running, states) == (State.RUNNING, [State.QUEUED, State.RUNNING])
    assert reading.read_experiment(store, second).state is State.RUNNING
    with pytest.raises(Conflict, match="no repetition of study"):
        lifecycle.ask(store, study.id, Verb.RETRY)


def study_spec() -> StudySpec:
    return StudySpec.model_validate(
        {name: value for name, value in SMALL.items() if name != "strategy"} | {"strategies": ["random", "known_fit"]}
    )


def test_a_measurement_that_is_cut_off_is_no_fault_of_a_plugin(store: Store) -> None:
    experiment = submit_one(store, on_the_bench(repetitions=1)).id
    for loss in range(MAX_LOSSES):
        (claim,) = execution.claim(store, "me", 9)
        assert execution.note_measuring(store, [claim]) == (claim,)
        assert reading.list_repetitions(store, experiment)[0].measuring_at is not None
        assert execution.release(store, claim, "the worker was lost")
        state = State.PAUSED if loss == MAX_LOSSES - 1 else State.RUNNING
        assert reading.read_experiment(store, experiment).state is state

    assert "a measurement was cut off 5 times" in reading.read_experiment(store, experiment).reasons[0]
    lifecycle.ask(store, experiment, Verb.RESUME)
    (claim,) = execution.claim(store, "me", 9)
    assert execution.release(store, claim, "the worker was lost")
    assert reading.list_repetitions(store, experiment)[0].state is State.QUEUED


@pytest.mark.dialects
def test_hardware_has_one_holder_at_a_time(store: Store) -> None:
    first, second = (submit_one(store, on_the_bench(repetitions=3)).id for _ in range(2))
    other = submit_one(store, small()).id

    (held,) = (each for each in execution.claim(store, "me", 9) if each.experiment_id != other)

    assert held.experiment_id == first
    assert execution.claim(store, "you", 9) == ()
    lifecycle.ask(store, first, Verb.CANCEL)
    assert execution.claim(store, "you", 9) == ()  # its worker may still move the hardware
    execution.free_hardware(store, [held])
    (following,) = execution.claim(store, "you", 9)
    assert following.experiment_id == second
    assert execution.hand_back(store, following)
    (lost,) = execution.claim(store, "gone", 9)
    execution.requeue_lost(store, stale_after_s=-1.0)
    again = next(each for each in execution.claim(store, "next", 9) if each.experiment_id == second)
    assert (again.id, again.epoch) == (lost.id, lost.epoch + 1)


@pytest.mark.dialects
@pytest.mark.parametrize("measuring", [False, True])
def test_a_heartbeat_that_comes_while_others_are_given_up_keeps_its_lease(
    store: Store, monkeypatch: pytest.MonkeyPatch, measuring: Any
) -> None:
    """As on Postgres, where another transaction may be committed between two statements of one."""
    submit_one(store, on_the_bench(repetitions=1))
    (held,) = execution.claim(store, "me", 9)
    if measuring:
        execution.note_measuring(store, [held])
    row = RepetitionRow

    def beaten(session: Session, experiments: Any) -> Any:
        session.execute(update(row).where(row.id == held.id).values(heartbeat_at=moment(session)))
        return lock(session, experiments)

    with store.transaction() as session:
        session.execute(update(row).values(heartbeat_at=moment(session) - timedelta(seconds=60)))
    monkeypatch.setattr(lease_ends, "lock", beaten)

    assert execution.requeue_lost(store, stale_after_s=30.0) == 0
    assert execution.heartbeat(store, [held]) == (held,)


@pytest.mark.dialects
@pytest.mark.parametrize("by_s", [3600.0, -3600.0])
def test_a_clock_that_was_set_does_not_give_hardware_to_a_second_holder(store: Store, by_s: float) -> None:
    submit_one(store, on_the_bench(repetitions=2))
    (held,) = execution.claim(store, "me", 9)
    time = [0.0]
    silences = Silences[int](lambda: time[0])
    look = partial(execution.requeue_lost, store, stale_after_s=30.0, silences=silences)

    assert look() == 0
    with store.transaction() as session:  # the heartbeat was given by the clock before it was set
        row = session.get_one(RepetitionRow, held.id)
        row.heartbeat_at = row.heartbeat_at - timedelta(seconds=by_s)
    assert look() == 0
    time[0] = 25.0
    assert look() == 0
    assert execution.heartbeat(store, [held]) == (held,)
    time[0] = 50.0
    assert look() == 0
    time[0] = 81.0
    assert look() == 1
    (again,) = execution.claim(store, "you", 1)
    assert (again.id, again.epoch) == (held.id, held.epoch + 1)


def test_an_ended_lease_frees_its_hardware_once_its_holder_is_silent(store: Store) -> None:
    first, _ = (submit_one(store, on_the_bench()).id for _ in range(2))
    execution.claim(store, "me", 9)
    lifecycle.ask(store, first, Verb.CANCEL)
    time = [0.0]
    silences = Silences[int](lambda: time[0])

    for time[0], claimed in ((0.0, 0), (20.0, 0), (31.0, 1)):
        execution.requeue_lost(store, stale_after_s=30.0, silences=silences)
        assert len(execution.claim(store, "you", 9)) == claimed


@pytest.mark.dialects
def test_the_database_itself_refuses_a_second_holder(store: Store) -> None:
    submit_one(store, on_the_bench())
    execution.claim(store, "me", 9)

    with pytest.raises(Exception, match=r"(?i)unique"), store.transaction() as session:
        session.query(RepetitionRow).update({"hardware": "the same"})


def test_the_baseline_that_evolves_in_reality_is_refused_on_hardware() -> None:
    with pytest.raises(InvalidSpec, match="may move hardware"):
        resolve_experiment(on_the_bench(strategy="direct"))
    assert resolve_experiment(small(strategy="direct")).iterations


def test_a_hung_rollout_and_a_hung_step_are_told_but_hardware_takes_as_long_as_it_takes() -> None:
    claim = SimpleNamespace(spec=resolve_experiment(small()), experiment_id="x", number=0)
    patience, hung = Patience(1.0, 1_000.0), Run(claim, None)  # type: ignore[arg-type]

    def reason(pulse: Pulse | None, **changes: Any) -> str | None:
        for name, value in ({"begun": True, "pulse": pulse, "hardware": False} | changes).items():
            setattr(hung, name, value)
        return hung.overdue(patience)

    assert reason(None) is None
    assert reason(Pulse(3, False, 99.0, 99.0)) is None
    assert "no rollout ended for 101 s; GAPLAB_ROLLOUT_LIMIT_S is 1 s" in str(reason(Pulse(3, False, 101.0, 101.0)))
    assert "reality did not answer for 101 s" in str(reason(Pulse(3, True, 101.0, 101.0)))
    assert reason(Pulse(3, True, 1e9, 1e9), hardware=True) is None
    assert "a step took 1001 s; GAPLAB_STEP_LIMIT_S" in str(reason(Pulse(3, False, 0.0, 1_001.0)))
    assert reason(Pulse(3, False, 101.0, 101.0), begun=False) is None


def test_it_is_told_that_no_worker_begins() -> None:
    claim = SimpleNamespace(spec=resolve_experiment(small()), experiment_id="x", number=0)
    waiting, begun = Run(claim, None), Run(claim, None, begun=True)  # type: ignore[arg-type]
    waiting.heard_at -= 100.0

    assert "no worker has begun for 1" in stuck([waiting], 90.0)
    assert stuck([waiting], 1e6) == stuck([waiting, begun], 90.0) == stuck([], 90.0) == ""


def test_a_repetition_that_does_nothing_gives_signs_of_life(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(checkpoints, "PULSE_S", 0.01)
    pulses, going = [], Event()

    def waiting(genome: Any) -> Outcome:
        assert going.wait(60)
        return Outcome(1.0)

    whole = setting(resolve_experiment(small(repetitions=1)), 0)
    for item in checkpoints.recorded(replace(whole, reality=waiting), (), ()):
        if isinstance(item, Pulse) and item.measuring:
            pulses.append(item)
            if len(pulses) > 3:
                going.set()
        if isinstance(item, TimedStep) and going.is_set():
            break

    assert pulses[0].step == 2
    assert pulses[-1].idle_s > pulses[0].idle_s


@pytest.mark.parametrize("raises", [False, True])
def test_a_measurement_that_is_cut_off_when_its_permit_runs_out_gives_no_answer(raises: bool) -> None:
    left, stopped, asked, ended = [0.0, 0.0], Event(), Event(), Event()
    events: list[str] = []

    def moving(genome: Any) -> Outcome:
        events.append("moves")
        asked.set()
        assert stopped.wait(60)
        if raises:
            raise RuntimeError("stopped")
        return Outcome(1.0)

    def stop() -> None:
        events.append("stops")
        stopped.set()
        measuring.join(0.2)

    def end() -> None:
        events.append("ends")
        ended.set()

    def remaining(_: int) -> float:
        if asked.is_set():
            return -1.0
        return left.pop() if left else 1e9

    def measure() -> None:
        with suppress(RuntimeError):
            reality(np.zeros(1))
        events.append("answers")

    reality = permits.PermittedReality(moving, stop, remaining, end, POLL_S)
    measuring = Thread(target=measure, daemon=True)
    measuring.start()

    assert ended.wait(60)
    assert measuring.is_alive()
    assert events == ["moves", "stops", "ends"]


def test_a_permit_is_for_one_measurement_and_comes_after_its_beginning_is_stored(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    permitted: list[Any] = []
    ends: list[float] = []

    def renew(keys: Any, until: float) -> None:
        permitted.append(keys)
        ends.append(until)

    handle: Any = SimpleNamespace(versions={}, permit=renew)
    held, moving = measuring(handle)

    def note(_: Any, claims: Any) -> Any:
        permitted.append("noted")
        return claims

    monkeypatch.setattr(execution, "note_measuring", note)

    for batch in ((Pulse(3, True, 0.0, 0.0),), (TimedStep(Measured(1, Sample(np.zeros(1), 1.0)), 1.0),),
                  (Pulse(8, True, 0.0, 0.0),), (TimedStep(Probed(1, 1.0, 1.0), 1.0),)):  # fmt: skip
        moving.take(batch)
        held._permit()
        held._note_measuring()

    assert permitted == [[], "noted", [(7, 1, 3)], [], [], "noted", [(7, 1, 8)], []]
    assert max(ends) < held._renewed + held._lease_s, "a robot moves after its lease"


def measuring(handle: Any) -> "tuple[Repetitions, LastAnswers]":
    """A supervisor with one run, which permits hardware."""
    repetitions, claim = Repetitions(None, "here", handle), Claim(7, 1, "x", 0, None)  # type: ignore[arg-type]
    run = LastAnswers(claim, None, hardware=True)  # type: ignore[arg-type]
    repetitions.runs = [run]
    return repetitions, run


class LastAnswers(Run):
    """A run whose task gives its last deliveries once it is told to end."""

    last: tuple[Any, ...] = ()
    waits: int = 0

    def wait_for_end(self, tasks: Any, longest_s: float) -> None:
        """Take the last deliveries."""
        self.waits += 1
        self.take(self.last)

    def cancel(self) -> None:
        """It has no task."""


def test_no_robot_moves_for_an_experiment_that_was_cancelled(monkeypatch: pytest.MonkeyPatch) -> None:
    permitted: list[Any] = []
    handle: Any = SimpleNamespace(versions={}, permit=lambda keys, until: permitted.extend(keys))
    held, moving = measuring(handle)
    freed: list[Any] = []
    monkeypatch.setattr(execution, "note_measuring", lambda store, claims: ())
    monkeypatch.setattr(execution, "free_hardware", lambda store, claims: freed.extend(claims))
    moving.take((Pulse(3, True, 0.0, 0.0),))

    held.store_received()

    assert (held.runs, permitted, freed) == ([], [], [moving.claim])


@pytest.mark.parametrize(("measures", "waits"), [(None, 0), (3, 1)])
def test_only_a_run_that_may_move_hardware_is_waited_for(
    monkeypatch: pytest.MonkeyPatch, measures: int | None, waits: int
) -> None:
    handle: Any = SimpleNamespace(versions={}, permit=lambda keys, until: None)
    held, run = measuring(handle)
    monkeypatch.setattr(execution, "hand_back", lambda store, claim: (claim,))
    run.measuring = measures

    held.hand_back([run])

    assert run.waits == waits


def test_an_answer_of_reality_that_arrives_during_the_hand_back_is_stored(store: Store) -> None:
    experiment = submit_one(store, on_the_bench(repetitions=1)).id
    (claim,) = execution.claim(store, "me", 1)
    steps = steps_to_the_first_answer(claim)
    execution.record_all(store, [(claim, [TimedStep(step, 0.0) for step in steps[:-1]])])
    handle: Any = SimpleNamespace(versions={}, permit=lambda keys, until: None)
    held, run = Repetitions(store, "me", handle), LastAnswers(claim, None, hardware=True)  # type: ignore[arg-type]
    run.last, run.measuring = (TimedStep(steps[-1], 1.0),), len(steps) - 1
    held.runs = [run]

    held.hand_back(held.runs)

    (handed_back,) = reading.list_repetitions(store, experiment)
    assert (held.runs, handed_back.state) == ([], State.QUEUED)
    assert stored(store, experiment) == {0: flat(steps)}


def steps_to_the_first_answer(claim: Claim) -> tuple[Any, ...]:
    steps = []
    for step in repetition(setting(claim.spec, 0)):
        steps.append(step)
        if isinstance(step, Measured):
            break
    return tuple(steps)


def test_a_worker_asks_for_the_permit_of_its_step() -> None:
    asked: list[int] = []

    def left(step: int) -> float:
        asked.append(step)
        return 1e9

    whole = setting(resolve_experiment(small(repetitions=1)), 0)
    moving = permits.PermittedReality(whole.reality, lambda: None, left)
    steps = [each.step for each in checkpoints.recorded(replace(whole, reality=moving), (), ())
             if isinstance(each, TimedStep)]  # fmt: skip

    assert asked == [place for place, step in enumerate(steps) if isinstance(step, Measured | Probed)]


def test_an_answer_ends_its_permit_and_no_process() -> None:
    """The supervisor may withdraw the permit while the worker still asks for it."""
    events: list[str] = []
    asks, answered = Event(), Event()

    def left(_: int) -> float:
        if not events:
            events.append("permitted")
            return 1e9
        asks.set()
        assert answered.wait(60)
        return 0.0

    def moving(genome: Any) -> Outcome:
        assert asks.wait(60)
        return Outcome(1.0)

    reality = permits.PermittedReality(
        moving, lambda: events.append("stops"), left, lambda: events.append("ends"), POLL_S
    )
    reality(np.zeros(1))
    answered.set()
    for thread in enumerate_threads():
        if thread.name == "permit":
            thread.join(60)

    assert events == ["permitted"]


def test_a_permit_runs_out_although_nobody_answers() -> None:
    answers, ended = [0.05], Event()

    def silent(_: int) -> float:
        if answers:
            return answers.pop()
        raise TimeoutError

    reality = permits.PermittedReality(
        lambda _: Outcome(float(ended.wait(60))), lambda: None, silent, ended.set, POLL_S
    )
    Thread(target=reality, args=(np.zeros(1),), daemon=True).start()

    assert ended.wait(60)


def test_a_measurement_waits_for_permits_whose_process_has_died() -> None:
    answers: list[Any] = [1e9, TimeoutError("it starts again"), TimeoutError("it died")]

    def answering(_: int) -> float:
        answer = answers.pop() if answers else 1e9
        if isinstance(answer, Exception):
            raise answer
        return float(answer)

    assert (
        permits.PermittedReality(lambda _: Outcome(0.5), lambda: None, answering, poll_s=POLL_S)(np.zeros(1)).fitness
        == 0.5
    )
    assert answers == []


def test_a_check_that_no_experiment_needs_any_more_ends(store: Store) -> None:
    spec = small()
    first, second = (submit_one(store, spec) for _ in range(2))
    claim = sensitivity.claim(store, "me")
    assert claim is not None

    lifecycle.ask(store, first.id, Verb.CANCEL)
    still = sensitivity.heartbeat(store, [claim])
    lifecycle.ask(store, second.id, Verb.CANCEL)

    assert (still, sensitivity.heartbeat(store, [claim])) == ((claim,), ())
    assert checks.read(store, claim.id).state is State.CANCELLED
    submit_one(store, spec)
    assert checks.read(store, claim.id).state is State.QUEUED
