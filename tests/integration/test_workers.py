"""The supervisor on a real Ray: the same numbers as in one process, whatever happens on the way.

Faults of the database are in test_store_faults.py, and those of plug-ins and hardware in test_faults.py, without Ray.
"""

import ctypes
import os
import signal
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from threading import Event
from typing import Any

import pytest
import ray

from gaplab.schemas.lifecycle import State
from gaplab.schemas.sensitivity import SensitivitySpec, Verdict
from gaplab.schemas.spec import ExperimentSpec
from gaplab.services.core.loop import repetition
from gaplab.services.core.optimizers.steady_state import SteadyState
from gaplab.services.core.types import Outcome
from gaplab.services.engines import engines
from gaplab.services.engines.analytic import Analytic
from gaplab.services.experiments import checks, reading
from gaplab.services.findings.sensitivity import Effort, check
from gaplab.services.running import sensitivity
from gaplab.services.running.versions import versions
from gaplab.services.specs.assembly import setting, subject
from gaplab.services.specs.resolution import resolve_experiment
from gaplab.services.store.models import CheckpointRow, RepetitionRow
from gaplab.services.store.queries.logs import logs
from gaplab.services.store.session import Store
from gaplab.workers import nodes, ray_tasks, task
from gaplab.workers import sensitivity as checking
from gaplab.workers.checkpoints import recorded
from gaplab.workers.errors import ClusterUnusable
from gaplab.workers.permits import PermittedReality
from gaplab.workers.ray_tasks import Permits, RayTask, RayTasks, asking
from gaplab.workers.supervisor import Supervisor
from gaplab.workers.task import Patience, Run
from tests.arithmetic import told
from tests.experiments import cancel, submit_one
from tests.fakes import flat, install
from tests.processes import processes_of_ray
from tests.waiting import wait_until

pytestmark = pytest.mark.usefixtures("ray")


def test_the_processes_of_ray_run_the_same_code_of_numpy_as_this_one() -> None:
    assert ray.get(ray.remote(told).remote()) == told()


def toy(**changes: Any) -> Any:
    return ExperimentSpec.model_validate(
        {
            "strategy": "simulated_fit_and_informative",
            "robot": "toy_function",
            "iterations": 2,
            "repetitions": 3,
            "budget": {"controller_evaluations": 40, "selection_evaluations": 30, "simulator_evaluations": 30},
            "seed": 3,
        }
        | changes
    )


def long_toy() -> Any:
    """Some seconds of work in each repetition."""
    return toy(repetitions=2, budget={"controller_evaluations": 3_000, "selection_evaluations": 300}, iterations=1)


def run(supervisor: Any, store: Store, experiment: Any, until: Any = lambda: False) -> None:
    """Rounds of the supervisor until the experiment has ended, or something else is so."""
    ended = lambda: reading.read_experiment(store, experiment).state.ended  # noqa: E731
    wait_until(lambda: ended() or until(), meanwhile=supervisor.step)


def expected(spec: Any) -> Any:
    resolved = resolve_experiment(spec)
    return [[flat(step) for step in repetition(setting(resolved, number))] for number in range(resolved.repetitions)]


def stored(store: Store, experiment: Any) -> Any:
    """The logs of an experiment's repetitions, as the supervisor after this one would read them."""
    with store.reading() as session:
        rows = session.query(RepetitionRow).filter_by(experiment_id=experiment).order_by(RepetitionRow.number).all()
        found = logs(session, [row.id for row in rows])
        return [[flat(step) for step in found[row.id]] for row in rows]


def given_to(supervisor: Supervisor, task: Any) -> Supervisor:
    """The supervisor, which gives its repetitions to another task of Ray."""
    supervisor._repetitions.launch = lambda claim: Run(claim, RayTask(task.remote(claim)))  # type: ignore[method-assign]
    return supervisor


def test_the_numbers_do_not_depend_on_how_many_repetitions_run_at_once(store: Store) -> None:
    ids = []
    for at_once in (1, 4):
        ids.append(submit_one(store, toy()).id)
        run(Supervisor(store, lambda at_once=at_once: at_once, RayTasks()), store, ids[-1])  # type: ignore[misc]

    assert [reading.read_experiment(store, each).state for each in ids] == [State.COMPLETED] * 2
    assert [stored(store, each) for each in ids] == [expected(toy())] * 2


def test_a_repetition_whose_code_raises_is_failed_with_the_reason_and_the_others_go_on(sqlite_store: Store) -> None:
    @ray.remote(num_cpus=1, max_retries=0, num_returns="streaming")
    def raising(claim: Any) -> Iterator[Any]:
        if claim.number == 1:
            msg = "the second one is broken"
            raise ZeroDivisionError(msg)
        yield from task.batches(recorded(setting(claim.spec, claim.number), claim.log, ()))

    experiment = submit_one(sqlite_store, toy()).id

    run(given_to(Supervisor(sqlite_store, lambda: 4, RayTasks()), raising), sqlite_store, experiment)

    read = reading.read_experiment(sqlite_store, experiment)
    states = [each.state for each in reading.list_repetitions(sqlite_store, experiment)]
    assert states == [State.COMPLETED, State.FAILED, State.COMPLETED]
    assert (read.state, read.progress.failed) == (State.COMPLETED, 1)
    assert read.reasons == ("ZeroDivisionError: the second one is broken",)


@pytest.mark.release
def test_a_worker_that_hangs_is_ended_with_the_reason_even_if_it_holds_the_interpreter(sqlite_store: Store) -> None:
    @ray.remote(num_cpus=1, max_retries=0, num_returns="streaming")
    def hanging(claim: Any) -> Iterator[Any]:
        yield ()
        if claim.number == 1:
            ctypes.PyDLL(None).sleep(3600)  # with Python's lock
        yield from task.delivered(lambda: setting(claim.spec, claim.number), claim, 10.0)

    experiment = submit_one(sqlite_store, toy()).id
    supervisor = Supervisor(sqlite_store, lambda: 3, RayTasks(), lease_s=3.0, patience=Patience(rollout_s=0.3))

    run(given_to(supervisor, hanging), sqlite_store, experiment)

    states = [each.state for each in reading.list_repetitions(sqlite_store, experiment)]
    assert states == [State.COMPLETED, State.FAILED, State.COMPLETED]
    assert "GAPLAB_ROLLOUT_LIMIT_S is 0.3 s" in reading.read_experiment(sqlite_store, experiment).reasons[0]


class Bench(Analytic):
    """Hardware, as far as gaplab knows."""

    name = "bench"
    repeatable = False


def moving(told: Path) -> Any:
    """A task that moves hardware for an hour; it writes what happens to it into a file."""

    def say(word: str) -> None:
        with told.open("a") as file:
            file.write(f"{word}\n")

    def measure(genome: Any) -> Outcome:
        say("moves")
        time.sleep(3600)
        return Outcome(0.0)

    @ray.remote(num_cpus=1, max_retries=0, num_returns="streaming")
    def task_(claim: Any, expected: Any, checkpoint_s: Any, permits: Any) -> Iterator[Any]:
        def prepared() -> Any:
            computed = claim.spec.reality.model_copy(update={"engine": claim.spec.engine})
            whole = setting(claim.spec.model_copy(update={"reality": computed}), claim.number)
            left = asking(permits, claim.id, claim.epoch)
            return replace(whole, reality=PermittedReality(measure, lambda: say("stops"), left))

        yield ()
        yield from task.delivered(prepared, claim, 10.0)

    return task_


@pytest.mark.release
def test_permits_whose_process_was_killed_permit_again_once_they_are_renewed() -> None:
    handle: Any = Permits.remote()  # type: ignore[attr-defined]  # Ray adds it
    ask = asking(handle, 1, 1)
    renewed = lambda: handle.renew.remote([(1, 1, 3)], 1e9)  # noqa: E731
    renewed()
    wait_until(lambda: _answer(ask) > 0)
    handle.__ray_call__.remote(lambda _: os._exit(1))
    wait_until(lambda: _answer(ask) <= 0)

    wait_until(lambda: renewed() and _answer(ask) > 0)
    ray.kill(handle)


def _answer(ask: Any) -> float:
    try:
        return float(ask(3))
    except TimeoutError:
        return 0.0


@pytest.mark.parametrize("cancelled", [True, pytest.param(False, marks=pytest.mark.release)])
def test_hardware_stops_when_its_experiment_is_cancelled_or_its_supervisor_stands_still(
    sqlite_store: Store, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, cancelled: bool
) -> None:
    told = tmp_path / "told"
    install(monkeypatch, engines, Bench)
    monkeypatch.setattr(ray_tasks, "run", moving(told))
    experiment = submit_one(sqlite_store, toy(reality={"engine": "bench"})).id
    other = submit_one(sqlite_store, toy(reality={"engine": "bench"})).id
    supervisor = Supervisor(sqlite_store, lambda: 3, RayTasks(), lease_s=3.0)

    run(supervisor, sqlite_store, experiment, until=told.exists)
    (moves, *waiting) = reading.list_repetitions(sqlite_store, experiment)
    stopped = lambda: told.read_text().startswith("moves\nstops\n")  # noqa: E731
    if cancelled:
        cancel(sqlite_store, experiment)
        run(supervisor, sqlite_store, other, until=stopped)
    wait_until(stopped)
    assert moves.measuring_at is not None
    assert {each.state for each in waiting} == {State.QUEUED}


def test_cancelling_stops_what_runs_and_keeps_what_is_stored(sqlite_store: Store) -> None:
    experiment = submit_one(sqlite_store, long_toy()).id
    supervisor = Supervisor(sqlite_store, lambda: 2, RayTasks())
    run(
        supervisor,
        sqlite_store,
        experiment,
        until=lambda: reading.read_experiment(sqlite_store, experiment).progress.iterations_done,
    )

    cancel(sqlite_store, experiment)
    wait_until(lambda: not processes_of_ray("run"), meanwhile=supervisor.step)

    assert reading.read_experiment(sqlite_store, experiment).state is State.CANCELLED
    assert reading.read_experiment(sqlite_store, experiment).progress.iterations_done


def long_steps() -> Any:
    """A step of some seconds, twice."""
    budget = {"controller_evaluations": 4_000, "selection_evaluations": 20, "simulator_evaluations": 20}
    return toy(strategy="random", repetitions=1, budget=budget, iterations=1)


def parts_stored(store: Store) -> Any:
    with store.reading() as session:
        return session.query(CheckpointRow).count()


@pytest.mark.release
def test_a_worker_killed_in_the_middle_of_a_step_goes_on_from_what_the_step_had(sqlite_store: Store) -> None:
    experiment = submit_one(sqlite_store, long_steps()).id
    supervisor = Supervisor(sqlite_store, lambda: 1, RayTasks(), checkpoint_s=0.05)
    run(supervisor, sqlite_store, experiment, until=lambda: parts_stored(sqlite_store) > 1)

    for pid in processes_of_ray("run"):
        os.kill(pid, signal.SIGKILL)
    (lost,) = supervisor._repetitions.runs
    run(supervisor, sqlite_store, experiment, until=lambda: supervisor._repetitions.runs not in ([lost], []))
    (again,) = supervisor._repetitions.runs
    run(supervisor, sqlite_store, experiment)

    assert len(again.claim.checkpoints) > 1
    assert [each.attempts for each in reading.list_repetitions(sqlite_store, experiment)] == [2]
    assert stored(sqlite_store, experiment) == expected(long_steps())
    assert parts_stored(sqlite_store) == 0


@pytest.mark.release
def test_told_to_stop_in_the_middle_of_a_step_it_hands_over_what_the_step_has(sqlite_store: Store) -> None:
    experiment = submit_one(sqlite_store, long_steps()).id
    first, stop = Supervisor(sqlite_store, lambda: 1, RayTasks(), checkpoint_s=0.05), Event()
    run(first, sqlite_store, experiment, until=lambda: parts_stored(sqlite_store))
    stop.set()

    first.serve(stop)

    (left,) = reading.list_repetitions(sqlite_store, experiment)
    assert (left.state, left.attempts) == (State.QUEUED, 0)
    run(Supervisor(sqlite_store, lambda: 1, RayTasks()), sqlite_store, experiment)
    assert stored(sqlite_store, experiment) == expected(long_steps())


def checked(store: Store, check: Any, supervisor: Any) -> Any:
    wait_until(lambda: checks.read(store, check).state.ended, meanwhile=supervisor.step)
    return checks.read(store, check)


def test_a_sensitivity_check_runs_beside_repetitions_and_tells_the_same_as_in_one_process(store: Store) -> None:
    experiment = submit_one(store, toy())
    supervisor = Supervisor(store, lambda: 1, RayTasks())

    found = checked(store, experiment.sensitivity, supervisor)
    run(supervisor, store, experiment.id)

    assert found.tunables == check(subject(found.spec), SteadyState(), Effort(17, 100))
    assert reading.read_experiment(store, experiment.id).state is State.COMPLETED
    assert stored(store, experiment.id) == expected(toy())


@pytest.mark.release
def test_a_sensitivity_check_that_raises_fails_alone(sqlite_store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    @ray.remote(num_cpus=0, max_retries=0)
    def raising(spec: Any, expected: Any) -> None:
        msg = "the check is broken"
        raise ZeroDivisionError(msg)

    monkeypatch.setattr(checking, "check", raising)
    experiment = submit_one(sqlite_store, toy())
    supervisor = Supervisor(sqlite_store, lambda: 2, RayTasks())

    found = checked(sqlite_store, experiment.sensitivity, supervisor)
    run(supervisor, sqlite_store, experiment.id)

    assert (found.state, found.reason) == (State.FAILED, "ZeroDivisionError: the check is broken")
    read = reading.read_experiment(sqlite_store, experiment.id)
    assert read.state is State.COMPLETED
    assert read.warnings[0].endswith("ZeroDivisionError: the check is broken")


@pytest.mark.release
def test_a_sensitivity_check_whose_worker_is_killed_runs_again(
    sqlite_store: Store, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    @ray.remote(num_cpus=0, max_retries=0)
    def killed_once(spec: Any, expected: Any) -> Any:
        if not (tmp_path / "killed").exists():
            (tmp_path / "killed").touch()
            os.kill(os.getpid(), signal.SIGKILL)
        return check(subject(spec), SteadyState(), Effort(spec.points, spec.evaluations))

    monkeypatch.setattr(checking, "check", killed_once)
    check_id = submit_one(sqlite_store, toy()).sensitivity

    found = checked(sqlite_store, check_id, Supervisor(sqlite_store, lambda: 2, RayTasks()))

    assert (tmp_path / "killed").exists()
    assert found.state is State.COMPLETED
    assert {each.verdict for each in found.tunables} == {Verdict.SMOOTH}


def test_a_supervisor_that_is_told_to_stop_hands_its_check_to_the_next(sqlite_store: Store) -> None:
    check_id = submit_one(sqlite_store, toy()).sensitivity
    first, stop = Supervisor(sqlite_store, lambda: 2, RayTasks()), Event()
    first.step()
    states = [checks.read(sqlite_store, check_id).state]
    stop.set()

    first.serve(stop)
    states.append(checks.read(sqlite_store, check_id).state)

    assert states == [State.RUNNING, State.QUEUED]
    assert checked(sqlite_store, check_id, Supervisor(sqlite_store, lambda: 2, RayTasks())).state is State.COMPLETED


def test_a_check_that_was_taken_over_is_dropped(sqlite_store: Store) -> None:
    check_id = checks.admit(sqlite_store, SensitivitySpec(robot="toy_function")).answer.id
    first = checking.Checks(sqlite_store, "first")
    first.step()

    sensitivity.requeue_lost(sqlite_store, stale_after_s=-1)
    sensitivity.claim(sqlite_store, "second")
    first.heartbeat()
    first.step()

    assert checks.read(sqlite_store, check_id).state is State.RUNNING


def test_a_check_on_a_node_with_other_versions_is_not_stored(sqlite_store: Store) -> None:
    check_id = checks.admit(sqlite_store, SensitivitySpec(robot="toy_function")).answer.id
    supervisor = Supervisor(sqlite_store, lambda: 2, RayTasks({"gaplab": "0.0.1"}))

    with pytest.raises(ClusterUnusable, match=r"the supervisor has gaplab 0\.0\.1"):
        checked(sqlite_store, check_id, supervisor)

    assert checks.read(sqlite_store, check_id).state is State.RUNNING


def test_a_cluster_whose_nodes_have_other_versions_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    ours = versions()
    nodes.check_nodes()
    monkeypatch.setattr(nodes, "versions", lambda: ours | {"numpy": "1.26.4"})

    with pytest.raises(ClusterUnusable, match=f"has numpy {ours['numpy']} where the supervisor has numpy 1.26.4"):
        nodes.check_nodes()
