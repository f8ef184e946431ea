"""A database that fails before it does what it is asked, or does it and then times out: nothing is lost, nothing twice.

What is asked is read from the supervisor's own source, so that nothing new is forgotten.
"""

import ast
from functools import partial
from pathlib import Path
from typing import ClassVar

import pytest
from ray.exceptions import RayTaskError, WorkerCrashedError

from gaplab.schemas.lifecycle import State
from gaplab.schemas.spec import ExperimentSpec
from gaplab.services.core.errors import StoreUnavailable
from gaplab.services.core.optimizers.steady_state import SteadyState
from gaplab.services.core.sensitivity import Effort, check
from gaplab.services.experiments import submission
from gaplab.services.running import execution, sensitivity
from gaplab.services.specs.assembly import setting, subject
from gaplab.services.store.models import CheckpointRow, RepetitionRow, SensitivityRow
from gaplab.services.store.queries.logs import logs
from gaplab.workers import repetitions, supervisor
from gaplab.workers import sensitivity as checking
from gaplab.workers.checkpoints import recorded
from gaplab.workers.repetitions import batches
from tests.fakes import flat
from tests.without_ray import OPEN, SPEC, Here, HereRepetitions, HereRun, Stop

MODULES = {"execution": execution, "sensitivity": sensitivity}


def asked_by_the_supervisor():
    """Every `execution.…(…)` and `sensitivity.…(…)` in the workers' source."""
    found = set()
    for path in (Path(__file__).parents[2] / "workers").glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            match node:
                case ast.Call(func=ast.Attribute(value=ast.Name(id=module), attr=name)) if module in MODULES:
                    found.add((module, name))
    return sorted(found)


class Troubled(HereRun):
    """A run whose worker is lost, or whose code raises."""

    def __init__(self, claim, stream, trouble):
        super().__init__(claim, stream)
        self.trouble = trouble

    def receive(self):
        self.begun = True
        self.lost, self.failed = ("the worker was lost", None) if self.trouble == "lost" else (None, "it is broken")


class TryingRepetitions(HereRepetitions):
    """Everything that may happen to a repetition: the second of the first experiment loses its first worker."""

    def launch(self, claim):
        stream = batches(recorded(setting(claim.spec, claim.number), claim.log, claim.checkpoints, 0.0))
        if claim.spec.name == "broken":
            return Troubled(claim, stream, "failed")
        if claim.number == 1 and not Trying.lost:
            Trying.lost = True
            return Troubled(claim, stream, "lost")
        return HereRun(claim, stream)


class Trying(Here):
    """A supervisor of such repetitions, and of sensitivity checks."""

    repetitions = TryingRepetitions
    lost = False
    late: ClassVar = set()
    """The modules whose leases have run out: much time passes before each supervisor, and none while it works."""

    def __init__(self, store):
        super().__init__(store)
        self._checks = checking.Checks(store, self._owner)
        Trying.late = set(MODULES.values())


class Ray:
    """In the place of Ray for sensitivity checks: the first loses its worker, others take two looks."""

    def __init__(self):
        self.looks = 0
        self.lost = False

    def remote(self, spec, expected):
        self.looks = 2
        return spec

    def wait(self, refs, timeout):
        self.looks -= 1
        return (refs, []) if self.looks < 0 else ([], refs)

    def cancel(self, ref, force):
        """It is no longer ours."""

    def get(self, spec):
        if not self.lost:
            self.lost = True
            raise WorkerCrashedError
        if len(spec.tunables) == 1:
            raise RayTaskError("check", "", ZeroDivisionError("it is broken"))
        return check(subject(spec), SteadyState(), Effort(spec.points, spec.evaluations))


def unfinished(store):
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


def outcome(store):
    """What came of everything, after supervisors that are stopped and started until all has ended."""
    names = {submission.submit_experiment(store, each).id: each.name for each in (SPEC, BROKEN)}
    rounds = 0
    while unfinished(store):
        assert rounds < 100
        Trying(store).serve(Stop(12 if rounds else 2))  # the first is stopped while a check is under way
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


def requeue_late(module, requeue_lost, store, **_):
    found = requeue_lost(store, stale_after_s=-1.0) if module in Trying.late else 0
    Trying.late.discard(module)
    return found


@pytest.fixture(autouse=True)
def quick(monkeypatch):
    """Nothing waits for the clock, and no lease depends on it."""
    for name, value in {"HEARTBEATS": 1e9, "RETRY_S": 0.0}.items():
        monkeypatch.setattr(supervisor, name, value)
    monkeypatch.setattr(repetitions, "WAIT_S", 0.0)
    monkeypatch.setattr(checking, "LOOK_S", 0.0)
    for module in MODULES.values():
        monkeypatch.setattr(module, "requeue_lost", partial(requeue_late, module, module.requeue_lost))
    ray = Ray()
    monkeypatch.setattr(checking, "ray", ray)
    monkeypatch.setattr(checking, "check", ray)
    monkeypatch.setattr(Trying, "lost", False)


@pytest.fixture(scope="module")
def undisturbed():
    """What comes of it without faults; computed by the first test that wants it."""
    return []


def expected(undisturbed, store):
    if not undisturbed:
        undisturbed.append(outcome(store))
    return undisturbed[0]


def test_without_faults_all_that_may_happen_happens(sqlite_store, undisturbed):
    repetitions, checks = expected(undisturbed, sqlite_store)

    assert [state for state, *_ in repetitions.values()] == [State.COMPLETED, State.COMPLETED, State.FAILED]
    assert [state for state, _ in checks] == [State.COMPLETED, State.FAILED]


def times_out_at_first(claims, answer):
    claims.append(answer)
    if len(claims) == 1:
        msg = "it did it, and timed out"
        raise StoreUnavailable(msg)
    return answer


@pytest.mark.parametrize("when", ["before", "after"])
@pytest.mark.parametrize(("module", "name"), asked_by_the_supervisor())
def test_a_fault_of_the_store_loses_nothing_and_does_nothing_twice(store, undisturbed, monkeypatch, module, name, when):
    ask, calls = getattr(MODULES[module], name), []

    def faulty(*arguments, **named):
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
        claim, claims = execution.claim, []
        monkeypatch.setattr(execution, "claim", lambda *arguments: times_out_at_first(claims, claim(*arguments)))

    assert outcome(store) == undisturbed[0]
    assert calls
