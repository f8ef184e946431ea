"""A database that fails before it does what it is asked, or does it and then times out: nothing is lost, nothing twice.

What is asked is read from the supervisor's own source, so that nothing new is forgotten.
"""

import ast
import shutil
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

import pytest
from ray.exceptions import RayTaskError, WorkerCrashedError

from gaplab.schemas.lifecycle import State
from gaplab.schemas.spec import ExperimentSpec
from gaplab.services.core.optimizers.steady_state import SteadyState
from gaplab.services.findings.sensitivity import Effort, check
from gaplab.services.running import execution, sensitivity
from gaplab.services.specs.assembly import setting, subject
from gaplab.services.store.database_errors import StoreUnavailable
from gaplab.services.store.lease import Failure, Pulse
from gaplab.services.store.models import CheckpointRow, RepetitionRow, SensitivityRow
from gaplab.services.store.queries.logs import logs
from gaplab.services.store.session import Store
from gaplab.workers import sensitivity as checking
from gaplab.workers import supervisor
from gaplab.workers.errors import TaskLost
from gaplab.workers.task import delivered
from tests.experiments import submit_one
from tests.fakes import flat
from tests.without_ray import OPEN, SPEC, Here, HereTask, HereTasks, Stop

MODULES = {"execution": execution, "sensitivity": sensitivity}


def asked_by_the_supervisor() -> Any:
    """Every `execution.…(…)` and `sensitivity.…(…)` in the workers' source."""
    found = set()
    for path in (Path(__file__).parents[2] / "workers").glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            match node:
                case ast.Call(func=ast.Attribute(value=ast.Name(id=module), attr=name)) if module in MODULES:
                    found.add((module, name))
    return sorted(found - {("execution", "free_hardware")})  # what it leaves undone, the end of the lease does


def measuring(claim: Any) -> Iterator[Any]:
    """What a worker delivers that waits for reality at first."""
    yield (Pulse(len(claim.log), measuring=True, idle_s=0.0, step_s=0.0),)
    yield from delivered(lambda: setting(claim.spec, claim.number), claim, 0.0)


def lost() -> Iterator[Any]:
    """What is taken from a worker that is gone."""
    raise TaskLost("the worker was lost")
    yield ()


class TryingTasks(HereTasks):
    """Everything that may happen to a repetition: the second of the first experiment loses its first worker."""

    def start(self, claim: Any, expected: Any, checkpoint_s: float) -> HereTask:
        if claim.spec.name == "broken":
            return HereTask(each for each in [(Failure("it is broken"),)])
        if claim.number == 1 and not Trying.lost:
            Trying.lost = True
            return HereTask(lost())
        return HereTask(measuring(claim))


class Trying(Here):
    """A supervisor of such repetitions, and of sensitivity checks."""

    tasks = TryingTasks
    lost = False
    late: ClassVar = set()  # type: ignore[var-annotated]
    """The modules whose leases have run out: much time passes before each supervisor, and none while it works."""

    def __init__(self, store: Store) -> None:
        super().__init__(store)
        self._checks = checking.Checks(store, self._owner)
        Trying.late = set(MODULES.values())


class Ray:
    """In the place of Ray for sensitivity checks: the first loses its worker, others take two looks."""

    def __init__(self) -> None:
        self.looks = 0
        self.lost = False

    def options(self) -> Any:
        return self

    def remote(self, spec: Any, expected: Any) -> Any:
        self.looks = 2
        return spec

    def wait(self, refs: Any, timeout: Any) -> Any:
        self.looks -= 1
        return (refs, []) if self.looks < 0 else ([], refs)

    def cancel(self, ref: Any, force: Any) -> None:
        """It is no longer ours."""

    def get(self, spec: Any) -> Any:
        if not self.lost:
            self.lost = True
            raise WorkerCrashedError
        if len(spec.tunables) == 1:
            raise RayTaskError("check", "", ZeroDivisionError("it is broken"))
        return check(subject(spec), SteadyState(), Effort(spec.points, spec.evaluations))


def unfinished(store: Store) -> Any:
    with store.reading() as session:
        return [
            row
            for table in (RepetitionRow, SensitivityRow)
            for row in session.query(table).filter(table.state.in_(OPEN)).all()
        ]


BROKEN = ExperimentSpec.model_validate(
    SPEC.model_dump(mode="json", exclude_none=True)
    | {"name": "broken", "repetitions": 1, "tunables": ["static_friction"]}
)


def outcome(store: Store) -> Any:
    """What came of everything, after supervisors that are stopped and started until all has ended."""
    names = {submit_one(store, each).id: each.name for each in (SPEC, BROKEN)}
    rounds = 0
    while unfinished(store):
        assert rounds < 100
        # the first is stopped while a check is under way
        Trying(store).serve(Stop(12 if rounds else 2))  # type: ignore[arg-type]
        rounds += 1
    with store.reading() as session:
        rows = session.query(RepetitionRow).all()
        found = logs(session, [row.id for row in rows])
        repetitions = {
            (names[row.experiment_id], row.number): (row.state, row.error, row.steps, flat(found[row.id]))
            for row in rows
        }
        checks = sorted((row.state, str(row.found)) for row in session.query(SensitivityRow))
        assert session.query(CheckpointRow).count() == 0
    return repetitions, checks


def requeue_late(module: Any, requeue_lost: Any, store: Store, **_: Any) -> Any:
    found = requeue_lost(store, stale_after_s=-1.0) if module in Trying.late else 0
    Trying.late.discard(module)
    return found


def hurry(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let nothing wait for the clock, and no lease depend on it."""
    monkeypatch.setattr(supervisor, "RETRY_S", 0.0)
    monkeypatch.setattr(checking, "LOOK_S", 0.0)
    for module in MODULES.values():
        monkeypatch.setattr(module, "requeue_lost", partial(requeue_late, module, module.requeue_lost))
    ray = Ray()
    monkeypatch.setattr(checking, "ray", ray)
    monkeypatch.setattr(checking, "check", ray)
    Trying.lost = False


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    hurry(monkeypatch)


@pytest.fixture(scope="module")
def undisturbed(sqlite_template: Path, tmp_path_factory: pytest.TempPathFactory) -> Any:
    """The outcome without faults."""
    store = Store(f"sqlite:///{shutil.copy(sqlite_template, tmp_path_factory.mktemp('undisturbed'))}")
    with pytest.MonkeyPatch.context() as patch:
        hurry(patch)
        found = outcome(store)
    store.dispose()
    return found


def test_without_faults_all_that_may_happen_happens(undisturbed: Any) -> None:
    repetitions, checks = undisturbed

    assert [state for state, *_ in repetitions.values()] == [State.COMPLETED, State.COMPLETED, State.FAILED]
    assert [state for state, _ in checks] == [State.COMPLETED, State.FAILED]


def times_out_at_first(claims: Any, answer: Any) -> Any:
    claims.append(answer)
    if len(claims) == 1:
        msg = "it did it, and timed out"
        raise StoreUnavailable(msg)
    return answer


@pytest.mark.parametrize("when", [pytest.param("before", marks=pytest.mark.release), "after"])
@pytest.mark.parametrize(("module", "name"), asked_by_the_supervisor())
def test_a_fault_of_the_store_loses_nothing_and_does_nothing_twice(
    store: Store, undisturbed: Any, monkeypatch: pytest.MonkeyPatch, module: Any, name: Any, when: Any
) -> None:
    ask, calls = getattr(MODULES[module], name), []

    def faulty(*arguments: Any, **named: Any) -> Any:
        calls.append(name)
        fault = len(calls) % 4 in {1, 2}
        if fault and when == "before":
            msg = "it failed before it did anything"
            raise StoreUnavailable(msg)
        answer = ask(*arguments, **named)
        if fault:
            msg = "it did it, and timed out"
            raise StoreUnavailable(msg)
        return answer

    monkeypatch.setattr(MODULES[module], name, faulty)
    if name == "hand_back_unheard":  # is asked only when a claim could not be heard of
        claim, claims = execution.claim, []  # type: ignore[var-annotated]
        monkeypatch.setattr(execution, "claim", lambda *arguments: times_out_at_first(claims, claim(*arguments)))

    assert outcome(store) == undisturbed
    assert calls
