"""Controllers that are expected to exceed the limits of a robot: offered with a warning, or refused."""

from typing import Any

import numpy as np
import pytest

from gaplab.schemas.corrections import VoidSpec
from gaplab.schemas.lifecycle import Verb
from gaplab.schemas.measurements import AnswerState, MeasurementSpec
from gaplab.schemas.records import MeasurementKind
from gaplab.services.archives import export
from gaplab.services.core.arrays import frozen
from gaplab.services.core.types import Cost, Probed, Selected, Simulator, Step, Transferred, Tuned
from gaplab.services.experiments import lifecycle
from gaplab.services.experiments.limits import FREELY
from gaplab.services.measuring import answering, corrections, taking
from gaplab.services.measuring.taking import RequestFilter
from gaplab.services.running import execution
from gaplab.services.store.lease import Claim, Requested, TimedStep
from gaplab.services.store.queries.logs import logs
from gaplab.services.store.session import Store
from tests.archiving import exported, imported
from tests.experiments import submit_one, toy

GENOME = frozen(np.full(24, 0.5))
BEYOND = "the tilt of the base reaches 1.2 rad in 2 of 2 simulators; permitted: at most 0.5 rad"


def safety(*beyond: str) -> dict[str, Any]:
    return {"simulators": 2, "failed": 0, "tilt": 1.2, "beyond": list(beyond)}


def submit(store: Store, beyond: str) -> str:
    reality = {"kind": "physical", "limits": {"tilt": 0.5}, "beyond": beyond, "probes": "each"}
    return submit_one(store, toy(robot="quadruped", engine="mujoco", repetitions=1, reality=reality)).id


def ask(store: Store, **told: Any) -> Claim:
    """Let a supervisor tune, transfer and request the probe of iteration 0."""
    (claim,) = execution.claim(store, "here", 1)
    steps: list[Step] = [Tuned(0, (Simulator(frozen([1.0, 0.8])),)), Transferred(0, GENOME, 0.4, Cost())]
    requested = Requested(2, 0, MeasurementKind.PROBE, GENOME, **told)
    execution.record_all(store, [(claim, [*(TimedStep(step, 0.0) for step in steps), requested])])
    return claim


def ask_again(store: Store) -> None:
    """Let a supervisor select the same controller as the sample of iteration 1."""
    (claim,) = execution.claim(store, "here", 1)
    requested = Requested(4, 1, MeasurementKind.SAMPLE, GENOME, safety(BEYOND))
    execution.record_all(store, [(claim, [TimedStep(Selected(1, GENOME), 0.0), requested])])


def requests_of(store: Store, experiment: str) -> Any:
    return taking.list_requests(store, RequestFilter(experiment=experiment, pending=False)).items


def test_a_refused_controller_counts_as_tried_and_the_history_says_why(store: Store) -> None:
    experiment = submit(store, "refuse")
    claim = ask(store, safety=safety(BEYOND))

    (request,) = requests_of(store, experiment)
    (answer,) = request.answers
    assert (request.state, request.safety.beyond) == ("failed", (BEYOND,))
    assert (answer.operator, answer.state, answer.values) == ("gaplab", AnswerState.COUNTED, None)
    assert BEYOND in (answer.failed or "")
    assert taking.list_requests(store, RequestFilter()).items == ()
    with store.reading() as session:
        log = logs(session, [claim.id])[claim.id]
    assert len(log) == 3
    assert isinstance(log[-1], Probed)
    assert np.isnan(log[-1].fitness)

    ask_again(store)
    both = requests_of(store, experiment)
    assert [each.state for each in both] == ["failed", "failed"]
    assert both[1].same_as == request.id


def test_a_person_may_overrule_a_refusal(store: Store) -> None:
    experiment = submit(store, "refuse")
    ask(store, safety=safety(BEYOND))
    (request,) = requests_of(store, experiment)

    corrections.void(store, request.answers[0].id, VoidSpec(reason="the robot hangs on a rope"), FREELY)
    (offered,) = taking.list_requests(store, RequestFilter()).items
    assert (offered.id, offered.state) == (request.id, "open")
    answering.answer(store, request.id, MeasurementSpec(values=(0.3,), operator="Ada"), FREELY)
    ask_again(store)
    assert [each.state for each in requests_of(store, experiment)] == ["measured", "measured"]


@pytest.mark.parametrize(
    ("beyond", "told"),
    [("warn", safety(BEYOND)), ("refuse", safety()), ("refuse", None)],
    ids=["only warned", "within the limits", "nothing forecast"],
)
def test_a_controller_is_offered_with_its_forecast(store: Store, beyond: str, told: Any) -> None:
    submit(store, beyond)
    ask(store, safety=told)

    (request,) = taking.list_requests(store, RequestFilter()).items
    assert request.state == "open"
    assert (request.safety and request.safety.model_dump(exclude_defaults=True)) == (
        told
        and {name: tuple(value) if isinstance(value, list) else value for name, value in told.items() if value}
        | {"failed": 0}
    )


def test_a_forecast_is_made_here_and_never_imported(store: Store, other: Store) -> None:
    experiment = submit(store, "warn")
    ask(store, safety=safety())
    archives = [exported(export(store, experiment))]
    (request,) = requests_of(store, experiment)
    answering.answer(store, request.id, MeasurementSpec(values=(0.4,), operator="Ada"), FREELY)
    archives.append(exported(export(store, experiment)))

    open_, answered = (imported(other, each).experiments[0] for each in archives)
    (withdrawn,), (measured,) = requests_of(other, open_), requests_of(other, answered)
    corrections.void(other, measured.answers[0].id, VoidSpec(reason="the floor was wet"), FREELY)
    (again,) = requests_of(other, answered)

    assert (withdrawn.state, measured.state, again.state) == ("withdrawn", "measured", "withdrawn")
    assert withdrawn.safety is measured.safety is again.safety is None
    assert request.safety is not None
    for each in (open_, answered):
        lifecycle.ask(other, each, Verb.RESUME)
    assert {claim.experiment_id for claim in execution.claim(other, "here", 9)} == {open_, answered}
