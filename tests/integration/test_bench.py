"""A robot on a bench: repetitions wait for measurements, and go on from them."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from io import BytesIO
from typing import Any

import numpy as np
import pytest
from fastapi.testclient import TestClient
from sqlalchemy import func, select, update

from gaplab.api.app import create_app
from gaplab.schemas.corrections import ConflictSpec, CorrectionSpec, VoidSpec
from gaplab.schemas.lifecycle import State, Verb
from gaplab.schemas.measurements import HolderSpec, MeasurementSpec, ReleaseSpec, TakeSpec
from gaplab.schemas.records import ExperimentRead
from gaplab.schemas.resolved import ResolvedSpec
from gaplab.schemas.spec import ExperimentSpec
from gaplab.services.archives import export
from gaplab.services.archives.rerunning import Part, verify
from gaplab.services.core.errors import Conflict, InvalidSpec, NotFound
from gaplab.services.core.loop import repetition
from gaplab.services.experiments import lifecycle
from gaplab.services.experiments.editing import Deleter, delete
from gaplab.services.experiments.idempotency import KeyReused
from gaplab.services.experiments.lease_ends import Silences
from gaplab.services.experiments.limits import FREELY, Admission
from gaplab.services.experiments.reading import list_samples, read, read_experiment
from gaplab.services.experiments.states import settle
from gaplab.services.measuring import answering, attachments, corrections, doubts, taking
from gaplab.services.measuring.rewriting import list_branches
from gaplab.services.measuring.taking import RequestFilter
from gaplab.services.reports.content import facts_of, verdict_on
from gaplab.services.results.misfit import misfit
from gaplab.services.results.tuned_simulators import tuned_simulators
from gaplab.services.running import execution
from gaplab.services.specs.assembly import setting
from gaplab.services.specs.resolution import resolve_experiment
from gaplab.services.store.lease import Pulse
from gaplab.services.store.models import AttachmentRow, RepetitionRow, RequestRow, StepRow
from gaplab.services.store.queries import requests
from gaplab.services.store.queries.costs import work_of
from gaplab.services.store.queries.logs import logs
from gaplab.services.store.session import Store
from gaplab.workers.checkpoints import recorded
from tests.archiving import exported, imported
from tests.experiments import same, submit_one, toy

HOUR = timedelta(hours=1)
PHYSICAL = {"kind": "physical", "probes": "each"}


def bench(**changes: Any) -> ExperimentSpec:
    """An experiment on the toy function whose reality is on a bench."""
    reality = PHYSICAL | changes.pop("reality", {})
    return toy(**{"repetitions": 1, "reality": reality} | changes)


def compute(store: Store, owner: str = "here", most: int = 1_000) -> int:
    """Let a supervisor do all that can be done without an answer; return the number of claims."""
    count = 0
    while count < most and (claims := execution.claim(store, owner, 1)):
        (claim,) = claims
        count += 1
        held: tuple[Any, ...] = claims
        for item in recorded(setting(claim.spec, claim.number), claim.log, claim.checkpoints):
            if not isinstance(item, Pulse):
                held = execution.record_all(store, [(claim, [item])])
        if held:
            execution.complete(store, claim)
    return count


def pending(store: Store) -> Any:
    return taking.list_requests(store, RequestFilter()).items


def undecided(store: Store) -> Any:
    """Requests with an answer in conflict, also if they are answered."""
    return taking.list_requests(store, RequestFilter(pending=False, conflicts=True)).items


def truth(spec: ExperimentSpec) -> Callable[[Any], float]:
    """The fitness in a simulated reality with the robot's own parameters."""
    simulated = spec.model_copy(
        update={"reality": spec.reality.model_copy(update={"kind": "simulated", "bench": None})}
    )
    real = setting(resolve_experiment(simulated), 0).reality
    return lambda genome: real(np.array(genome)).fitness


def measure(store: Store, request: Any, *values: float, **changes: Any) -> Any:
    spec = MeasurementSpec(values=values, operator="Ada", **changes)
    return answering.answer(store, request.id, spec, FREELY).answer


def fall_silent(store: Store) -> int:
    """End the takes that are held, as a supervisor does that hears nothing for their whole lease."""
    silences = Silences[str](iter([0.0, 1e9]).__next__)
    return [taking.open_again(store, silences) for _ in range(2)][-1]


def finish(store: Store, fitness: Callable[[Any], float]) -> list[Any]:
    """Answer everything to the end, and return the requests in order."""
    asked = []
    compute(store)
    while items := pending(store):
        asked.append(items[0])
        assert len(asked) < 100
        measure(store, items[0], *[fitness(items[0].genome)] * items[0].repeats)
        compute(store)
    return asked


def log_of(store: Store, experiment: ExperimentRead) -> Any:
    with store.reading() as session:
        from gaplab.services.store.queries.experiments import repetitions_of

        ids = [row.id for row in repetitions_of(session, experiment.id)]
        return [logs(session, [id_])[id_] for id_ in ids]


def test_without_noise_the_steps_equal_those_of_a_simulated_reality_to_the_bit(store: Store) -> None:
    spec = bench(strategy="simulated_fit_and_informative", repetitions=2)
    experiment = submit_one(store, spec)
    finish(store, truth(spec))

    simulated = spec.model_copy(update={"reality": spec.reality.model_copy(update={"kind": "simulated"})})
    resolved = resolve_experiment(simulated)
    expected = [tuple(repetition(setting(resolved, number))) for number in range(2)]
    assert read_experiment(store, experiment.id).state is State.COMPLETED
    found = log_of(store, experiment)
    for mine, theirs in zip(found, expected, strict=True):
        assert [type(step) for step in mine] == [type(step) for step in theirs]
        assert all(map(same, mine, theirs))


def test_a_repetition_that_waits_holds_nothing_and_its_experiment_says_so(store: Store) -> None:
    experiment = submit_one(store, bench())
    assert compute(store) == 1

    (request,) = pending(store)
    assert (request.state, request.iteration, request.kind, request.ended_at) == ("open", 0, "probe", None)
    assert read_experiment(store, experiment.id).state is State.WAITING
    assert compute(store) == 0
    assert execution.requeue_lost(store, stale_after_s=0.0) == 0

    measure(store, request, 0.5)
    assert read_experiment(store, experiment.id).state is State.RUNNING
    assert compute(store) == 1
    assert [each.iteration for each in pending(store)] == [1]


def test_probes_that_are_left_out_are_not_asked_for(store: Store) -> None:
    experiment = submit_one(store, bench(reality={"probes": "last"}))
    asked = finish(store, lambda _: 0.5)
    assert [(each.iteration, each.kind) for each in asked] == [(1, "sample"), (2, "sample"), (2, "probe")]
    (log,) = log_of(store, experiment)
    assert [step.left_out for step in log if hasattr(step, "left_out")] == [True, True, False]
    assert [step.recorded for step in log if hasattr(step, "recorded")][1:] == [0.5, 0.5]
    with store.reading() as session:
        assert work_of(session, [experiment.id])[experiment.id].probes == 1
    measured = list_samples(store, experiment.id, limit=100, cursor=None).items
    assert [(each.iteration, each.kind) for each in measured] == [(1, "sample"), (2, "sample"), (2, "probe")]


def test_a_controller_is_measured_once_even_if_it_is_probe_and_sample(store: Store) -> None:
    spec = bench(budget={"preset": "smoke", "reuse_transfer": True})
    submit_one(store, spec)
    asked = finish(store, truth(spec))
    genomes = [each.genome for each in asked]
    assert len(genomes) == len(set(genomes))
    assert {each.kind for each in asked} == {"probe"}


@pytest.mark.dialects
def test_a_take_has_one_holder_and_a_bench_one_take(store: Store) -> None:
    submit_one(store, bench(repetitions=2))
    compute(store)
    first, second = pending(store)
    taken = taking.take(store, first.id, TakeSpec(operator="Ada"), FREELY).answer
    assert (taken.state, taken.takes, taken.taken_by) == ("taken", 1, "Ada")
    with pytest.raises(Conflict, match="Ada has taken it"):
        taking.take(store, first.id, TakeSpec(operator="Bo"), FREELY)
    with pytest.raises(Conflict, match="one is taken at a time"):
        taking.take(store, second.id, TakeSpec(operator="Bo"), FREELY)
    with pytest.raises(Conflict, match="take 2"):
        taking.heartbeat(store, first.id, HolderSpec(take=2))
    assert taking.heartbeat(store, first.id, HolderSpec(take=1)).state == "taken"
    assert taking.release(store, first.id, ReleaseSpec(take=1)).state == "open"
    assert taking.take(store, second.id, TakeSpec(operator="Bo"), FREELY).answer.taken_by == "Bo"


@pytest.mark.dialects
@pytest.mark.parametrize("by_s", [-3600, 3600])
def test_a_take_ends_by_silence_and_a_clock_that_was_set_ends_none(store: Store, by_s: float) -> None:
    submit_one(store, bench(repetitions=2))
    compute(store)
    request, other = pending(store)
    time = [0.0]
    silences = Silences[str](lambda: time[0])
    for state in ("open", "open", "open", "open", "stuck"):
        take = taking.take(store, request.id, TakeSpec(operator="Ada"), FREELY).answer.takes
        assert taking.open_again(store, silences) == 0
        with store.transaction() as session:  # the heartbeat was given by the clock before it was set
            until = session.get_one(RequestRow, request.id).taken_until
            assert until is not None
            session.execute(update(RequestRow).values(taken_until=until + timedelta(seconds=by_s)))
        with pytest.raises(Conflict, match="one is taken at a time"):
            taking.take(store, other.id, TakeSpec(operator="Bo"), FREELY)
        for _ in range(2):
            assert taking.open_again(store, silences) == 0
            time[0] += 599.0
            assert taking.open_again(store, silences) == 0
            assert taking.heartbeat(store, request.id, HolderSpec(take=take)).state == "taken"
        assert taking.open_again(store, silences) == 0
        time[0] += 601.0
        restarted = Silences[str](lambda: time[0])
        assert (taking.open_again(store, restarted), taking.open_again(store, silences)) == (0, 1)
        assert pending(store)[0].state == state
    with pytest.raises(Conflict, match="5 times in a row"):
        taking.take(store, request.id, TakeSpec(operator="Ada"), FREELY)
    assert taking.reopen(store, request.id).state == "open"


@pytest.mark.dialects
@pytest.mark.parametrize("taken_since", [False, True])
def test_an_answer_of_a_take_that_ended_by_silence_counts_unless_another_took_the_bench_since(
    store: Store, taken_since: bool
) -> None:
    submit_one(store, bench(repetitions=2))
    compute(store)
    hers, his = pending(store)
    taking.take(store, hers.id, TakeSpec(operator="Ada"), FREELY)
    assert fall_silent(store) == 1
    if taken_since:
        taking.take(store, his.id, TakeSpec(operator="Bo"), FREELY)
        taking.release(store, his.id, ReleaseSpec(take=1))

    late = measure(store, hers, 0.3, take=1)

    assert late.state == ("conflict" if taken_since else "counted")
    if taken_since:
        again = taking.take(store, hers.id, TakeSpec(operator="Bo"), FREELY).answer
        assert measure(store, hers, 0.5, take=again.takes).state == "counted"


@pytest.mark.dialects
def test_a_bench_is_one_however_its_name_is_spaced_and_capitalised(store: Store) -> None:
    for name in ("The table", " the  TABLE "):
        submit_one(store, bench(reality={"bench": name}))
        compute(store)
    first, second = pending(store)
    taking.take(store, first.id, TakeSpec(operator="Ada"), FREELY)

    with pytest.raises(Conflict, match="one is taken at a time"):
        taking.take(store, second.id, TakeSpec(operator="Bo"), FREELY)

    found = taking.list_requests(store, RequestFilter(bench="THE TABLE")).items
    assert [(each.bench, each.busy) for each in found] == [("The table", False), ("The table", True)]


def test_no_take_ends_while_its_request_is_answered(postgres_store: Store) -> None:
    """As it would if a supervisor ended takes between the moment a request is read and the moment it is written."""
    submit_one(postgres_store, bench())
    compute(postgres_store)
    (request,) = pending(postgres_store)
    seen = select(RequestRow.id).with_for_update(skip_locked=True)
    with postgres_store.transaction() as session, postgres_store.transaction() as another:
        requests.locked(session, request.id)
        assert another.scalars(seen).all() == []
    with postgres_store.transaction() as session:
        assert session.scalars(seen).all() == [request.id]


@pytest.mark.dialects
def test_the_same_answer_twice_counts_once_and_another_is_a_conflict(store: Store) -> None:
    submit_one(store, bench())
    compute(store)
    (request,) = pending(store)
    taking.take(store, request.id, TakeSpec(operator="Ada"), FREELY)
    other = measure(store, request, 0.3)
    assert other.state == "conflict"
    once = Admission(key="one")
    spec = MeasurementSpec(take=1, values=(0.5,))
    first = answering.answer(store, request.id, spec, once)
    again = answering.answer(store, request.id, spec, once)
    assert (first.answer.state, again.answer, again.replayed) == ("counted", first.answer, True)
    assert answering.answer(store, request.id, spec, FREELY).answer.id == first.answer.id
    with pytest.raises(KeyReused):
        answering.answer(store, request.id, MeasurementSpec(take=1, values=(0.6,)), once)
    late = measure(store, request, 0.6)
    assert late.state == "conflict"

    assert [each.id for each in undecided(store)] == [request.id]

    corrections.decide(store, other.id, ConflictSpec(counts="other", reason="Bo was on the wrong robot"), FREELY)
    corrections.decide(store, late.id, ConflictSpec(counts="this", reason="Ada misread"), FREELY)
    states = {each.id: each.state for each in taking.read_request(store, request.id).answers}
    assert states == {other.id: "dismissed", first.answer.id: "replaced", late.id: "counted"}
    assert undecided(store) == ()


def test_an_answer_that_comes_to_count_when_nobody_wants_it_any_more_is_refused(store: Store) -> None:
    experiment = submit_one(store, bench())
    compute(store)
    (request,) = pending(store)
    taking.take(store, request.id, TakeSpec(operator="Ada"), FREELY)
    other = measure(store, request, 0.3)
    lifecycle.ask(store, experiment.id, Verb.CANCEL)

    with pytest.raises(Conflict, match="no longer needed"):
        corrections.decide(store, other.id, ConflictSpec(counts="this", reason="Bo is right"), FREELY)

    assert taking.read_request(store, request.id).answers[0].state == "conflict"


def test_bad_values_are_refused_with_their_place(store: Store) -> None:
    submit_one(store, bench(reality={"repeats": 3}))
    compute(store)
    (request,) = pending(store)
    with pytest.raises(InvalidSpec) as refused:
        measure(store, request, 0.5, unit="km/h", readings=(((1.0,),),))
    assert {each.pointer for each in refused.value.violations} >= {"/unit", "/values", "/readings/0"}
    assert pending(store)[0].answers == ()


@pytest.mark.dialects
def test_a_correction_closes_what_followed_and_measurements_are_reused(store: Store) -> None:
    spec = bench(iterations=3)
    experiment = submit_one(store, spec)
    real = truth(spec)
    asked = finish(store, real)
    wrong = next(each for each in asked if (each.iteration, each.kind) == (1, "sample"))
    answer = taking.read_request(store, wrong.id).answers[0]
    (before,) = log_of(store, experiment)

    change = CorrectionSpec(values=(0.123,), reason="a slip")
    told = corrections.correct(store, answer.id, change, FREELY, dry_run=True).answer
    assert (told.steps, told.branch) == (len(before) - 5, None)
    assert len(log_of(store, experiment)[0]) == len(before)

    done = corrections.correct(store, answer.id, change, FREELY).answer
    assert (done.steps, done.branch) == (told.steps, 1)
    assert read_experiment(store, experiment.id).state is State.QUEUED
    (cut,) = log_of(store, experiment)
    assert len(cut) == 5
    assert cut[-1].sample.fitness == 0.123
    (branch,) = list_branches(store, experiment.id)
    assert len(branch.steps) == told.steps

    back = CorrectionSpec(values=answer.values, reason="it was right after all")
    corrections.correct(store, done.answer, back, FREELY)
    assert finish(store, lambda _: pytest.fail("a measurement was asked for twice")) == []
    assert all(each.ended_at for each in taking.list_requests(store, RequestFilter(pending=False)).items)
    (after,) = log_of(store, experiment)
    assert all(map(same, after, before))
    assert read_experiment(store, experiment.id).state is State.COMPLETED


def test_seconds_of_closed_steps_are_taken_back(store: Store) -> None:
    submit_one(store, bench(strategy="random", iterations=3))
    asked = finish(store, lambda genome: genome[0])
    with store.transaction() as session:  # as if each took ten seconds
        session.execute(update(StepRow).values(seconds=10.0))
    sample = next(each for each in asked if (each.iteration, each.kind) == (2, "sample"))
    answer = taking.read_request(store, sample.id).answers[0]

    corrections.correct(store, answer.id, CorrectionSpec(values=(0.9,), reason="a slip"), FREELY)

    with store.reading() as session:
        (repetition,) = session.scalars(select(RepetitionRow))
        spent = session.execute(select(func.sum(StepRow.seconds)).group_by(StepRow.branch).order_by(StepRow.branch))
        assert repetition.steps == 10
        assert repetition.seconds == 100.0
        assert [*spent.scalars()] == [100.0, 80.0]


def test_a_void_measurement_is_asked_for_again(store: Store) -> None:
    spec = bench()
    experiment = submit_one(store, spec)
    asked = finish(store, truth(spec))
    (before,) = log_of(store, experiment)
    sample = next(each for each in asked if each.kind == "sample")
    answer = taking.read_request(store, sample.id).answers[0]
    wet = VoidSpec(reason="the floor was wet")
    told = corrections.void(store, answer.id, wet, FREELY, dry_run=True).answer
    assert read_experiment(store, experiment.id).state is State.COMPLETED
    done = corrections.void(store, answer.id, wet, FREELY).answer
    assert (told.steps, told.words) == (done.steps, done.words)
    assert told.steps > 0
    assert "stopped" not in told.words
    assert read_experiment(store, experiment.id).state is State.WAITING
    (again,) = pending(store)
    assert (again.id, again.unanswered) == (sample.id, 0)
    with pytest.raises(Conflict, match="it is void"):
        corrections.void(store, answer.id, VoidSpec(reason="once more"), FREELY)
    measure(store, again, truth(spec)(again.genome))
    assert finish(store, lambda _: pytest.fail("a measurement was asked for twice")) == []
    (after,) = log_of(store, experiment)
    assert all(map(same, after, before))


def test_a_void_answer_of_a_paused_experiment_leaves_it_paused(store: Store) -> None:
    experiment = submit_one(store, bench()).id
    compute(store)
    (request,) = pending(store)
    measure(store, request, 0.5)
    compute(store)
    lifecycle.ask(store, experiment, Verb.PAUSE)
    answer = taking.read_request(store, request.id).answers[0]

    corrections.void(store, answer.id, VoidSpec(reason="the floor was wet"), FREELY)

    assert read_experiment(store, experiment).state is State.PAUSED


def test_requests_come_in_pages(store: Store) -> None:
    submit_one(store, bench(repetitions=3))
    compute(store)
    with store.transaction() as session:
        for hours, each in enumerate(session.scalars(select(RequestRow).order_by(RequestRow.id)).all()):
            each.created_at += hours * HOUR

    first = taking.list_requests(store, RequestFilter(), limit=2)
    second = taking.list_requests(store, RequestFilter(), limit=2, cursor=first.next)

    assert (*first.items, *second.items) == pending(store)
    assert (len(second.items), second.next) == (1, None)


@pytest.mark.dialects
def test_a_correction_of_a_probe_changes_its_point_alone(store: Store) -> None:
    experiment = submit_one(store, bench())
    asked = finish(store, lambda _: 0.5)
    answer = taking.read_request(store, asked[0].id).answers[0]
    told = corrections.correct(store, answer.id, CorrectionSpec(values=(0.9,), reason="a slip"), FREELY).answer
    assert (told.steps, told.branch) == (0, None)
    (log,) = log_of(store, experiment)
    assert [step.recorded for step in log if hasattr(step, "recorded")] == [0.9, 0.5, 0.5]
    assert read_experiment(store, experiment.id).state is State.COMPLETED


def stopped_after_a_step(store: Store) -> tuple[ExperimentRead, list[Any]]:
    """An experiment of three iterations that was stopped after its first sample and probe, with its requests."""
    experiment = submit_one(store, bench(iterations=3))
    asked = []
    for _ in range(3):
        compute(store)
        asked.append(pending(store)[0])
        measure(store, asked[-1], 0.5)
    compute(store)
    assert lifecycle.ask(store, experiment.id, Verb.STOP).state is State.COMPLETED
    return experiment, [taking.read_request(store, each.id) for each in asked]


def test_a_correction_of_a_probe_leaves_a_stopped_experiment_stopped(store: Store) -> None:
    experiment, asked = stopped_after_a_step(store)
    probe = next(each for each in asked if each.kind == "probe")
    slip = CorrectionSpec(values=(0.9,), reason="a slip")

    told = corrections.correct(store, probe.answers[0].id, slip, FREELY).answer

    assert told.words == "nothing follows from it"
    assert read_experiment(store, experiment.id).state is State.COMPLETED
    assert compute(store) == 0


def test_a_correction_of_a_sample_says_that_a_stopped_experiment_goes_on(store: Store) -> None:
    experiment, asked = stopped_after_a_step(store)
    sample = next(each for each in asked if each.kind == "sample")
    slip = CorrectionSpec(values=(0.9,), reason="a slip")

    told = corrections.correct(store, sample.answers[0].id, slip, FREELY, dry_run=True).answer
    corrections.correct(store, sample.answers[0].id, slip, FREELY)

    steps = "1 stored step" if told.steps == 1 else f"{told.steps} stored steps"
    assert told.words.startswith(f"{steps} after it will be computed again")
    assert told.words.endswith("; the repetition, which was stopped, goes on to its last iteration")
    assert read_experiment(store, experiment.id).state is State.QUEUED


@pytest.mark.dialects
def test_a_void_answer_of_a_closed_branch_is_not_answered_again(store: Store) -> None:
    experiment = submit_one(store, bench(strategy="simulated_fit", iterations=3))
    finish(store, lambda genome: genome[0])
    asked = taking.list_requests(store, RequestFilter(pending=False)).items
    first = next(each for each in asked if each.kind == "sample")
    corrections.correct(store, first.answers[0].id, CorrectionSpec(values=(9.0,), reason="a slip"), FREELY)
    compute(store)
    (wanted,) = pending(store)
    closed = next(
        each for each in asked if (each.iteration, each.kind) == (wanted.iteration, wanted.kind) and each.answers
    )
    assert closed.genome != wanted.genome
    told = corrections.void(store, closed.answers[0].id, VoidSpec(reason="the robot slipped"), FREELY).answer
    assert (told.steps, told.measurements) == (0, 0)
    (before,) = log_of(store, experiment)

    with pytest.raises(Conflict, match="a correction closed its branch"):
        measure(store, closed, 0.77)

    (after,) = log_of(store, experiment)
    assert len(after) == len(before)
    assert pending(store)[0].id == wanted.id


@pytest.mark.dialects
def test_a_correction_while_the_repetition_is_computed_fences_its_worker(store: Store) -> None:
    experiment = submit_one(store, bench())
    compute(store)
    measure(store, pending(store)[0], 0.5)
    compute(store)
    sample = pending(store)[0]
    given = measure(store, sample, 0.4)
    (claim,) = execution.claim(store, "slow", 1)
    steps: Any = recorded(setting(claim.spec, claim.number), claim.log, claim.checkpoints)
    first = next(steps)
    corrections.correct(store, given.id, CorrectionSpec(values=(0.3,), reason="a slip"), FREELY)
    assert execution.record_all(store, [(claim, [first])]) == ()
    steps.close()
    finish(store, lambda _: 0.5)
    (log,) = log_of(store, experiment)
    assert next(step for step in log if hasattr(step, "sample")).sample.fitness == 0.3


def test_pause_stop_and_cancel_of_what_waits(store: Store) -> None:
    one, two, three = (submit_one(store, bench(reality={"bench": name})) for name in "abc")
    compute(store)
    requests = {each.experiment: each for each in pending(store)}
    taken = taking.take(store, requests[one.id].id, TakeSpec(operator="Ada"), FREELY).answer
    assert lifecycle.ask(store, one.id, Verb.PAUSE).state is State.PAUSED
    assert {each.experiment for each in pending(store)} == {one.id, two.id, three.id}  # a taken one is being measured
    taking.release(store, taken.id, ReleaseSpec(take=taken.takes))
    assert {each.experiment for each in pending(store)} == {two.id, three.id}
    with pytest.raises(Conflict, match="PAUSED"):
        taking.take(store, requests[one.id].id, TakeSpec(operator="Ada"), FREELY)
    measure(store, requests[one.id], 0.4)  # whoever measured it nevertheless is not sent away
    assert lifecycle.ask(store, one.id, Verb.RESUME).state is State.QUEUED
    assert lifecycle.ask(store, two.id, Verb.STOP).state is State.CANCELLED
    assert lifecycle.ask(store, three.id, Verb.CANCEL).state is State.CANCELLED
    with pytest.raises(Conflict, match="no longer needed"):
        measure(store, requests[three.id], 0.4)
    waiting_for = [RequestFilter(experiment=id_) for id_ in (one.id, three.id)]
    assert [taking.none_will_follow(store, each) for each in (*waiting_for, RequestFilter())] == [False, True, False]


@pytest.mark.dialects
def test_a_bench_stays_taken_until_its_holder_has_let_go_or_is_silent(store: Store) -> None:
    """Also if the request is no longer needed, or somebody else's answer counts: a driver may still move the robot."""
    first, second, third = (submit_one(store, bench(reality={"bench": "table"})) for _ in range(3))
    compute(store)
    one, two, three = pending(store)
    for request, experiment in ((one, first), (two, second)):
        taking.take(store, request.id, TakeSpec(operator="Ada"), FREELY)
        if request is one:
            lifecycle.ask(store, experiment.id, Verb.CANCEL)
        else:
            other = measure(store, request, 0.3)
            corrections.decide(store, other.id, ConflictSpec(counts="this", reason="Ada's phone is dead"), FREELY)
        with pytest.raises(Conflict, match="take 1 of request"):
            taking.heartbeat(store, request.id, HolderSpec(take=1))
        with pytest.raises(Conflict, match="one is taken at a time"):
            taking.take(store, three.id, TakeSpec(operator="Bo"), FREELY)
        if request is one:
            assert taking.release(store, request.id, ReleaseSpec(take=1)).state == "withdrawn"
        else:
            assert fall_silent(store) == 1

    assert taking.take(store, three.id, TakeSpec(operator="Bo"), FREELY).answer.experiment == third.id


def test_known_samples_tune_the_first_simulators(store: Store) -> None:
    spec = bench()
    real = truth(spec)
    genomes = [[0.2], [0.7]]
    known = [{"genome": genome, "values": [real(genome)]} for genome in genomes]
    experiment = submit_one(store, bench(reality={"samples": known}))
    compute(store)
    (log,) = log_of(store, experiment)
    assert log[0].cost.rollouts > 0
    assert log[0].simulators[0].squared_error < 1e-2


def test_without_iterations_one_tunes_on_what_was_measured_before(store: Store) -> None:
    real = truth(bench())
    known = [{"genome": [gene], "values": [real([gene])]} for gene in (0.2, 0.7, 0.4, 0.9)]
    spec = bench(iterations=0, held_out=0.25, reality={"samples": known, "probes": None})
    experiment = submit_one(store, spec)

    assert compute(store) == 1

    assert pending(store) == ()
    shown = read_experiment(store, experiment.id)
    (log,) = log_of(store, experiment)
    found = misfit(store, experiment.id)
    assert (shown.state, shown.level, shown.progress.counted_iterations) == (State.COMPLETED, False, 0)
    assert log[0].simulators[0].squared_error < 1e-2
    assert [(point.error.n, point.held_out_error.n) for point in found.points] == [(1, 1)]
    assert found.verdicts
    assert tuned_simulators(store, experiment.id).samples == {0: {0: 3}}
    outcome = facts_of(store, read(store, experiment.id)).outcome
    assert outcome is not None
    assert outcome.samples == 3

    with pytest.raises(InvalidSpec, match="0 iterations tune on samples from before alone, and the spec has none"):
        resolve_experiment(bench(iterations=0))


def test_an_unlikely_number_stays_a_remark_until_a_person_confirms_or_corrects_it(store: Store) -> None:
    experiment = submit_one(store, bench(reality={"repeats": 3}))
    compute(store)
    request, slip = pending(store)[0], (0.31, 31.0, 0.29)

    told = doubts.read(store, request.id, MeasurementSpec(values=slip)).doubts
    likely = doubts.read(store, request.id, MeasurementSpec(values=(0.31, 0.4, 0.29))).doubts
    failed = doubts.read(store, request.id, MeasurementSpec(failed="it fell")).doubts
    answer = measure(store, request, *slip)

    assert told[0] == "31 is 1e+02 times the other repeats"
    assert "times the largest fitness that was simulated or measured" in told[1]
    assert (likely, failed, answer.state.value, answer.doubts) == ((), (), "counted", told)
    (warning,) = read_experiment(store, experiment.id).warnings
    assert warning.startswith("repetition 0, iteration 0: 31 is 1e+02 times the other repeats; ")
    assert f"gaplab decide {answer.id} this" in warning
    assert any(warning in sentence for sentence in verdict_on(store, read(store, experiment.id)).sentences)

    decision = ConflictSpec(counts="this", reason="it flew")
    assert "confirmed" in corrections.decide(store, answer.id, decision, FREELY, dry_run=True).answer.words
    assert read_experiment(store, experiment.id).doubts
    corrections.decide(store, answer.id, decision, FREELY)
    assert read_experiment(store, experiment.id).doubts == ()
    with pytest.raises(Conflict, match="is counted, not in conflict"):
        corrections.decide(store, answer.id, decision, FREELY)

    compute(store)
    second = measure(store, pending(store)[0], 0.3, 0.3, 200.0)
    corrections.correct(store, second.id, CorrectionSpec(values=(0.3, 0.3, 0.2), reason="a slip"), FREELY)
    assert read_experiment(store, experiment.id).doubts == ()
    compute(store)
    sure = MeasurementSpec(values=(0.3, 0.3, 200.0), confirmed=True)
    assert answering.answer(store, pending(store)[0].id, sure, FREELY).answer.doubts == ()


def test_repeats_weigh_samples_and_put_a_floor_under_weights(store: Store) -> None:
    experiment = submit_one(store, bench(reality={"repeats": 3}, strategy="simulated_fit_and_informative"))
    compute(store)
    while items := pending(store):
        measure(store, items[0], 0.4, 0.5, 0.6)
        compute(store)
    (log,) = log_of(store, experiment)
    samples = [step.sample for step in log if hasattr(step, "sample")]
    assert [list(each.repeats) for each in samples] == [[0.4, 0.5, 0.6]] * 2
    assert [each.fitness for each in samples] == [0.5, 0.5]


def test_specs_that_make_no_sense_on_a_bench_are_refused() -> None:
    physical = {"kind": "physical", "engine": "pybullet", "parameters": {"restitution": 0.1}}
    with pytest.raises(InvalidSpec) as refused:
        resolve_experiment(toy(strategy="direct", reality=physical))
    pointers = {each.pointer for each in refused.value.violations}
    assert pointers == {"/strategy", "/reality/engine", "/reality/parameters"}
    with pytest.raises(InvalidSpec, match="physical reality"):
        resolve_experiment(toy(reality={"repeats": 3}))


def test_a_resolved_physical_spec_resolves_to_itself() -> None:
    resolved = resolve_experiment(bench(reality={"repeats": 3}))
    again = resolve_experiment(ExperimentSpec.model_validate(resolved.model_dump(mode="json")))
    assert again == resolved == ResolvedSpec.model_validate(resolved.model_dump(mode="json"))
    assert replace(setting(resolved, 0)).reality is not None


@pytest.mark.dialects
def test_an_archive_of_what_waits_goes_on_elsewhere(store: Store, other: Store) -> None:
    spec = bench(iterations=3)
    experiment = submit_one(store, spec)
    real = truth(spec)
    compute(store)
    measure(store, pending(store)[0], real(pending(store)[0].genome))
    compute(store)
    (sample,) = pending(store)
    given = measure(store, sample, 0.1)
    compute(store)
    corrections.correct(store, given.id, CorrectionSpec(values=(real(sample.genome),), reason="a slip"), FREELY)
    compute(store)
    taken = taking.take(store, pending(store)[0].id, TakeSpec(operator="Ada"), FREELY).answer
    archive = exported(export(store, experiment.id))
    taking.release(store, taken.id, ReleaseSpec(take=1))

    for _ in range(2):  # the second time under other ids
        there = imported(other, archive)
    assert there.called_off == ()
    first, second = (read_experiment(other, id_) for id_ in (experiment.id, there.experiments[0]))
    for each in (first, second):
        assert (each.state, each.reasons) == (State.PAUSED, ("it was imported",))
        assert len(list_branches(other, each.id)) == 1
        asked = taking.list_requests(other, RequestFilter(experiment=each.id, pending=False)).items
        assert [request.state for request in asked] == ["measured", "measured", "withdrawn", "withdrawn"]
    assert compute(other) == 0
    for each in (first, second):
        lifecycle.ask(other, each.id, Verb.RESUME)
    finish(other, real)
    finish(store, real)
    (expected,) = log_of(store, experiment)
    for each in (first, second):
        (found,) = log_of(other, each)
        assert all(map(same, found, expected))


def test_a_rerun_of_a_bench_takes_the_stored_answers(sqlite_store: Store) -> None:
    experiment = submit_one(sqlite_store, bench(reality={"repeats": 2}, repetitions=2))
    finish(sqlite_store, truth(bench()))
    archive = exported(export(sqlite_store, experiment.id))

    found = verify(BytesIO(archive), cores=1)
    part = verify(BytesIO(archive), Part(experiment=experiment.name, repetition=1), cores=1)
    none = verify(BytesIO(archive), Part(repetition=0, minutes=0.0), cores=1)

    assert (found.same, found.different, found.not_computed) == (2, 0, 0)
    assert [each.repetition for each in part.repetitions] == [1]
    assert (none.repetitions[0].outcome, none.repetitions[0].reason) == ("not computed", "the time was over")
    with pytest.raises(NotFound, match=f"no repetition 7 of any; it has {experiment.name}"):
        verify(BytesIO(archive), Part(repetition=7), cores=1)


def test_a_deleted_experiment_leaves_no_requests(store: Store) -> None:
    experiment = submit_one(store, bench())
    finish(store, lambda _: 0.5)
    delete(store, experiment.id, Deleter(None))
    assert taking.list_requests(store, RequestFilter(pending=False)).items == ()


def sent(store: Store, name: str) -> str:
    return attachments.store_attachment(store, name.encode(), name, "text/plain").id


def test_a_file_has_a_byte_or_more(sqlite_store: Store) -> None:
    with pytest.raises(InvalidSpec, match="an attachment has 1 to"):
        attachments.store_attachment(sqlite_store, b"", "empty", "text/plain")

    assert attachments.store_attachment(sqlite_store, b"1", "contact", "text/plain").size == 1


@pytest.mark.dialects
def test_a_file_goes_with_the_last_answer_that_names_it(store: Store) -> None:
    shared, own, waits, old, again = (sent(store, name) for name in ("shared", "own", "waits", "old", "again"))
    first, second = (submit_one(store, bench(iterations=1, reality={"probes": "never"})) for _ in range(2))
    compute(store)
    for request in pending(store):
        named = [shared, own] if request.experiment == first.id else [shared]
        measure(store, request, 0.5, attachments=named)
    compute(store)
    long_ago = update(AttachmentRow).where(AttachmentRow.id.in_([shared, old, again]))
    store.write(lambda session: session.execute(long_ago.values(created_at=datetime.now(UTC) - timedelta(days=8))))
    sent(store, "again")

    delete(store, first.id, Deleter(None))

    assert set(store.write(lambda session: session.scalars(select(AttachmentRow.id)).all())) == {shared, waits, again}
    delete(store, second.id, Deleter(None))
    with pytest.raises(NotFound, match="no attachment"):
        attachments.read_attachment(store, shared)


def test_every_result_of_a_bench_is_served(store: Store) -> None:
    experiment = submit_one(store, bench(reality={"repeats": 2, "probes": "last"}))
    finish(store, lambda genome: genome[0])
    api = TestClient(create_app(store))
    of_it = f"/experiments/{experiment.id}"
    figures = ("predictions", "squared-error", "simulators", "toy")
    paths = [f"{of_it}{each}" for each in ("", "/curve", "/samples", "/misfit", "/simulators", "/repetitions")]
    paths += [f"/figures/{kind}?experiment={experiment.id}&format=json" for kind in figures]
    paths += [f"/figures/{kind}?study={experiment.id}&format=json" for kind in ("curves", "coordinates")]
    paths += [f"/studies/{experiment.id}/spec"]

    refused = {path: answer.text for path in paths if (answer := api.get(path)).status_code != 200}

    assert refused == {}


@pytest.mark.dialects
def test_fifty_operators_at_once_get_one_request_each_or_none(store: Store) -> None:
    submit_one(store, bench(repetitions=3, reality={"bench": "one"}))
    submit_one(store, bench(repetitions=2, reality={"bench": "two"}))
    submit_one(store, bench(repetitions=1, reality={"bench": "one"}))
    compute(store)
    wanted = [each.id for each in pending(store)]
    assert len(wanted) == 6

    def take(number: int) -> Any:
        try:
            spec = TakeSpec(operator=f"operator {number}")
            return taking.take(store, wanted[number % 6], spec, FREELY).answer
        except Conflict:
            return None

    with ThreadPoolExecutor(50) as pool:
        taken = [each for each in pool.map(take, range(50)) if each]
    assert {each.bench for each in taken} == {"one", "two"}
    assert len(taken) == 2
    held = {each.id: each.taken_by for each in pending(store) if each.state == "taken"}
    assert held == {each.id: each.taken_by for each in taken}


@pytest.mark.dialects
@pytest.mark.parametrize("claimed", [False, True])
def test_an_answer_counts_also_while_a_repetition_is_on_its_way_to_the_request(store: Store, claimed: bool) -> None:
    experiment = submit_one(store, bench())
    compute(store)
    with store.transaction() as session:  # as earlier versions imported it
        session.execute(update(RepetitionRow).values(state=State.QUEUED))
        settle(session, [experiment.id], State.QUEUED)
    claims = execution.claim(store, "slow", 1) if claimed else ()
    assert measure(store, pending(store)[0], 0.5).state == "counted"
    for claim in claims:
        items = [each for each in recorded(setting(claim.spec, 0), claim.log, ()) if not isinstance(each, Pulse)]
        assert execution.record_all(store, [(claim, items)]) == ()
    compute(store)
    assert [each.iteration for each in pending(store)] == [1]
