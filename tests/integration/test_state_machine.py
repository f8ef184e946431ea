"""Experiments under whatever may be done to them, in any order, against a model of a page.

People submit, pause, resume, stop, cancel and extend; fake workers claim, compute with the real loop, deliver (now and
then twice), complete and fail, and are killed; leases run out. After every move the store says what the model says, no
step is there twice or missing, and what was stored before stands.
"""

from contextlib import suppress
from dataclasses import dataclass, field
from functools import cache
from typing import Any

import pytest
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule, run_state_machine_as_test

from gaplab.schemas.lifecycle import ENDS, MOVES, PERMITTED, Ending, ExtensionSpec, State, Verb
from gaplab.schemas.spec import ExperimentSpec
from gaplab.services.core.errors import Conflict, InvalidSpec
from gaplab.services.core.loop import repetition
from gaplab.services.experiments import lifecycle
from gaplab.services.running import execution
from gaplab.services.specs.assembly import setting
from gaplab.services.specs.resolution import resolve_experiment
from gaplab.services.store.lease import Claim, Failure, TimedStep
from gaplab.services.store.models import AttemptRow, ExperimentRow, RepetitionRow
from gaplab.services.store.queries.logs import logs
from gaplab.services.store.session import Store
from tests.experiments import submit_one
from tests.fakes import flat

MOST_ITERATIONS, MOST_REPETITIONS = 2, 3
BUDGET = {"controller_evaluations": 20, "selection_evaluations": 20, "simulator_evaluations": 20}


def spec(iterations: Any, repetitions: Any) -> Any:
    toy = {"strategy": "simulated_fit", "robot": "toy_function", "optimizer": {"name": "steady_state"}}
    return ExperimentSpec.model_validate(toy | {"budget": BUDGET, "iterations": iterations, "repetitions": repetitions})


@cache
def whole(number: Any) -> Any:
    """The log of a repetition that nothing ever happened to, of as many iterations as any has here."""
    resolved = resolve_experiment(spec(MOST_ITERATIONS, MOST_REPETITIONS))
    return tuple(flat(step) for step in repetition(setting(resolved, number)))


def length(iterations: Any) -> Any:
    return 3 + 5 * iterations


def points(steps: Any) -> Any:
    """Iterations that are done, number 0 included."""
    return (steps + 2) // 5


@dataclass
class Repetition:
    """What is expected of one: its state, its steps, how its attempts ended, and who holds it."""

    state: State = State.QUEUED
    steps: int = 0
    losses: int = 0
    endings: list = field(default_factory=list)
    claim: Claim | None = None

    def leave(self, state: Any, ending: Any) -> None:
        self.state, self.claim = state, None
        self.endings[-1] = ending


@dataclass
class Experiment:
    """What is expected of one."""

    id: str
    iterations: int
    repetitions: list
    state: State = State.QUEUED

    def of(self, *states: Any) -> Any:
        return [each for each in self.repetitions if each.state in states]

    def settle(self) -> None:
        if self.state is State.STOPPING:
            for each in self.of(State.QUEUED):
                each.state = State.COMPLETED if points(each.steps) else State.CANCELLED
        if self.state in ENDS:
            return
        if not self.of(State.QUEUED, State.RUNNING):
            ends = (State.COMPLETED, State.FAILED, State.CANCELLED)
            self.state = next(end for end in ends if self.of(end))
        elif self.state is State.PAUSING and not self.of(State.RUNNING):
            self.state = State.PAUSED
        elif self.state is State.QUEUED and self.of(State.RUNNING):
            self.state = State.RUNNING

    def ask(self, verb: Any) -> None:
        running = bool(self.of(State.RUNNING))
        if verb is Verb.CANCEL:
            for each in self.of(State.RUNNING):
                each.leave(State.CANCELLED, Ending.CANCELLED)
            for each in self.of(State.QUEUED):
                each.state = State.CANCELLED
        self.state = {
            Verb.PAUSE: State.PAUSING,
            Verb.RESUME: State.RUNNING if running else State.QUEUED,
            Verb.STOP: State.STOPPING,
            Verb.CANCEL: State.CANCELLED,
        }[verb]
        self.settle()


class LifeCycle(RuleBasedStateMachine):
    """One database for all examples; each has its own experiments, and calls off what is left at its end."""

    store = None
    picks = st.integers(0, 10)

    def __init__(self) -> None:
        super().__init__()
        self.experiments: list[Any] = []
        self.gone: list[Any] = []  # claims that hold no more
        self.states: dict[Any, Any] = {}
        self.kept: dict[Any, Any] = {}  # the longest log that was seen of each repetition

    def running(self) -> Any:
        return [(one, each) for one in self.experiments for each in one.repetitions if each.claim]

    def one_of(self, found: Any, pick: Any) -> Any:
        return found[pick % len(found)]

    def claims(self) -> Any:
        return [each.claim for _, each in self.running()]

    @precondition(lambda self: len(self.experiments) < 2)
    @rule(iterations=st.integers(1, MOST_ITERATIONS), repetitions=st.integers(1, MOST_REPETITIONS - 1))
    def submit(self, iterations: Any, repetitions: Any) -> None:
        read = submit_one(self.store, spec(iterations, repetitions))
        made = [Repetition() for _ in range(repetitions)]
        self.experiments.append(Experiment(read.id, iterations, made))

    @precondition(lambda self: self.experiments)
    @rule(pick=picks, verb=st.sampled_from([Verb.PAUSE, Verb.RESUME, Verb.STOP, Verb.PAUSE, Verb.RESUME, Verb.CANCEL]))
    def ask(self, pick: Any, verb: Any) -> None:
        experiment = self.one_of(self.experiments, pick)
        held = self.claims()
        if experiment.state not in PERMITTED[verb]:
            with pytest.raises(Conflict):
                lifecycle.ask(self.store, experiment.id, verb)
            return
        experiment.ask(verb)
        assert lifecycle.ask(self.store, experiment.id, verb).state is experiment.state
        self.gone += [each for each in held if each not in self.claims()]

    @precondition(lambda self: any(each.state is State.COMPLETED for each in self.experiments))
    @rule(pick=picks, iterations=st.integers(1, MOST_ITERATIONS), repetitions=st.integers(1, MOST_REPETITIONS))
    def extend(self, pick: Any, iterations: Any, repetitions: Any) -> None:
        experiment = self.one_of([each for each in self.experiments if each.state is State.COMPLETED], pick)
        totals = ExtensionSpec(iterations=iterations, repetitions=repetitions)
        new = repetitions - len(experiment.repetitions)
        if new < 0 or iterations < experiment.iterations:
            with pytest.raises(InvalidSpec):
                lifecycle.extend(self.store, experiment.id, totals)
            return
        again = [
            each for each in experiment.of(State.COMPLETED, State.CANCELLED) if points(each.steps) < iterations + 1
        ]
        if not (again or new):
            with pytest.raises(Conflict):
                lifecycle.extend(self.store, experiment.id, totals)
            return
        for each in again:
            each.state, each.losses = State.QUEUED, 0
        experiment.repetitions += [Repetition() for _ in range(new)]
        experiment.iterations, experiment.state = iterations, State.QUEUED
        lifecycle.extend(self.store, experiment.id, totals)

    @rule(limit=st.integers(1, 3))
    def claim(self, limit: Any) -> None:
        able = [each for each in self.experiments if each.state in (State.QUEUED, State.RUNNING)]
        queued = sum(len(each.of(State.QUEUED)) for each in able)
        claims = execution.claim(self.store, "a worker", limit)
        assert len(claims) == min(limit, queued)
        for claim in claims:
            experiment = next(each for each in able if each.id == claim.experiment_id)
            each = experiment.repetitions[claim.number]
            assert each.state is State.QUEUED
            assert len(claim.log) == each.steps
            each.state, each.claim = State.RUNNING, claim
            each.endings.append(None)
            experiment.settle()

    @precondition(lambda self: self.running())
    @rule(pick=picks, count=st.integers(1, 6), again=st.booleans())
    def work(self, pick: Any, count: Any, again: Any) -> None:
        """The next steps by the real loop from the stored log; some are delivered a second time with them."""
        experiment, each = self.one_of(self.running(), pick)
        claim = each.claim
        log = self.stored(experiment)[claim.number][1]
        steps = repetition(setting(claim.spec, claim.number), log)
        fresh = [step for _, step in zip(range(count), steps, strict=False)]
        delivered = [TimedStep(step, 0.0) for step in (*(log[-2:] if again else ()), *fresh)]
        held = execution.record_all(self.store, [(claim, delivered)]) if delivered else (claim,)
        each.steps += len(fresh)
        each.losses = 0 if fresh else each.losses
        if fresh and experiment.state in (State.PAUSING, State.STOPPING):
            assert held == ()
            self.gone.append(claim)
            if each.steps == length(experiment.iterations):
                each.leave(State.COMPLETED, Ending.COMPLETED)
            else:
                each.leave(State.QUEUED, Ending.PAUSED if experiment.state is State.PAUSING else Ending.STOPPED)
            experiment.settle()
        else:
            assert held == (claim,)

    @precondition(lambda self: self.running())
    @rule(pick=picks)
    def complete(self, pick: Any) -> None:
        experiment, each = self.one_of(self.running(), pick)
        if each.steps < length(experiment.iterations):
            with pytest.raises(Conflict):
                execution.complete(self.store, each.claim)
            return
        self.end(experiment, each, State.COMPLETED, Ending.COMPLETED, execution.complete)

    @precondition(lambda self: self.running())
    @rule(pick=picks, seldom=st.integers(0, 3))
    def fail(self, pick: Any, seldom: Any) -> None:
        if not seldom:
            experiment, each = self.one_of(self.running(), pick)
            broken = Failure("broken")
            self.end(experiment, each, State.FAILED, Ending.FAILED, lambda *held: execution.fail(*held, broken))  # type: ignore[call-arg]

    @precondition(lambda self: self.running())
    @rule(pick=picks)
    def hand_back(self, pick: Any) -> None:
        experiment, each = self.one_of(self.running(), pick)
        asked = {State.PAUSING: Ending.PAUSED, State.STOPPING: Ending.STOPPED}
        ending = asked.get(experiment.state, Ending.HANDED_BACK)
        self.end(experiment, each, State.QUEUED, ending, execution.hand_back)

    @precondition(lambda self: self.running())
    @rule(pick=picks)
    def crash(self, pick: Any) -> None:
        """The worker of one is killed, and its supervisor says so."""
        experiment, each = self.one_of(self.running(), pick)
        each.losses += 1
        state = State.FAILED if each.losses == 5 else State.QUEUED
        self.end(experiment, each, state, Ending.LOST, lambda *held: execution.release(*held, "killed"))  # type: ignore[call-arg]

    @precondition(lambda self: self.running())
    @rule()
    def restart(self) -> None:
        """Everything that ran is forgotten; a new supervisor finds the leases run out."""
        held = self.running()
        assert execution.requeue_lost(self.store, stale_after_s=-1) == len(held)
        for experiment, each in held:
            self.gone.append(each.claim)
            each.losses += 1
            each.leave(State.FAILED if each.losses == 5 else State.QUEUED, Ending.LOST)
            experiment.settle()

    @precondition(lambda self: self.gone)
    @rule(pick=picks)
    def wake_up_late(self, pick: Any) -> None:
        """Who holds no more can change nothing, whatever it tries."""
        late = self.one_of(self.gone, pick)
        (following,) = [step for _, step in zip(range(1), repetition(setting(late.spec, late.number)), strict=False)]
        assert not execution.record(self.store, late, following)
        assert not execution.complete(self.store, late)
        assert not execution.fail(self.store, late, Failure("late"))
        assert not execution.release(self.store, late, "late")
        assert not execution.hand_back(self.store, late)
        assert execution.heartbeat(self.store, [late]) == ()

    def end(self, experiment: Any, each: Any, state: Any, ending: Any, how: Any) -> None:
        self.gone.append(each.claim)
        assert how(self.store, each.claim)
        each.leave(state, ending)
        experiment.settle()

    def stored(self, experiment: Any) -> Any:
        """The row and the log of each repetition."""
        with self.store.reading() as session:  # type: ignore[attr-defined]
            return self.read(session, experiment)

    def read(self, session: Any, experiment: Any) -> Any:
        of_this = session.query(RepetitionRow).filter_by(experiment_id=experiment.id)
        rows = of_this.order_by(RepetitionRow.number).all()
        found = logs(session, [row.id for row in rows])
        return [(row, found[row.id]) for row in rows]

    @invariant()
    def the_store_says_what_the_model_says(self) -> None:
        for experiment in self.experiments:
            with self.store.reading() as session:  # type: ignore[attr-defined]
                row, found = session.get_one(ExperimentRow, experiment.id), self.read(session, experiment)
                ids = [each.id for each, _ in found]
                tried = session.query(AttemptRow).where(AttemptRow.repetition_id.in_(ids)).order_by(AttemptRow.epoch)
                endings = [[each.ending for each in tried if each.repetition_id == id_] for id_ in ids]
            self.compare(experiment, row, [each for each, _ in found])
            assert endings == [each.endings for each in experiment.repetitions]
            for each, log in found:
                self.no_step_is_missing_or_there_twice_and_old_ones_stand(each, log)

    def compare(self, experiment: Any, row: Any, repetitions: Any) -> None:
        expected = experiment.repetitions
        assert row.state is experiment.state
        assert (row.ended_at is not None) == (row.state in ENDS)
        assert [each.state for each in repetitions] == [each.state for each in expected]
        assert [each.steps for each in repetitions] == [each.steps for each in expected]
        assert [each.iterations_done for each in repetitions] == [points(each.steps) for each in expected]
        assert row.running == len(experiment.of(State.RUNNING))
        for which, state in {None: row.state, **{each.number: each.state for each in repetitions}}.items():
            before = self.states.get((experiment.id, which), state)
            assert state is before or state in MOVES[before], (which, before, state)
            self.states[experiment.id, which] = state

    def no_step_is_missing_or_there_twice_and_old_ones_stand(self, row: Any, log: Any) -> None:
        assert tuple(map(flat, log)) == whole(row.number)[: row.steps]
        assert row.steps >= self.kept.get(row.id, 0)
        self.kept[row.id] = row.steps

    def teardown(self) -> None:
        for each in self.experiments:
            with suppress(Conflict):
                lifecycle.ask(self.store, each.id, Verb.CANCEL)


def drive(store: Store, examples: Any, steps: Any) -> None:
    machine = type("OnThisStore", (LifeCycle,), {"store": store})
    chosen = settings(
        max_examples=examples,
        stateful_step_count=steps,
        suppress_health_check=list(HealthCheck),
        derandomize=True,
    )
    run_state_machine_as_test(machine, settings=chosen)


@pytest.mark.parametrize("examples", [5, pytest.param(40, marks=pytest.mark.release)])
def test_any_order_of_events_on_sqlite(sqlite_store: Store, examples: int) -> None:
    drive(sqlite_store, examples, steps=40)


@pytest.mark.parametrize("examples", [1, pytest.param(8, marks=pytest.mark.release)])
def test_any_order_of_events_on_postgres(postgres_store: Store, examples: int) -> None:
    drive(postgres_store, examples, steps=30)
