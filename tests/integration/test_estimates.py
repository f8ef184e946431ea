"""What a study would cost is what it then costs; and asking stores nothing."""

from dataclasses import replace
from datetime import UTC, datetime, timedelta
from math import copysign

import pytest
from fastapi.testclient import TestClient
from sqlalchemy import update

from gaplab.api.app import create_app
from gaplab.schemas.plugin import PluginRef
from gaplab.schemas.spec import StudySpec
from gaplab.services.core.types import Probed
from gaplab.services.engines import engines
from gaplab.services.experiments import listing, reading, submission
from gaplab.services.experiments.estimates import estimate
from gaplab.services.running.execution import claim
from gaplab.services.settings import Limits, Settings
from gaplab.services.store.models import RepetitionRow, SupervisorRow
from gaplab.services.store.session import Store
from tests.experiments import listed, run, some_log, submit_one, toy

STUDY = {
    "robot": "toy_function",
    "strategies": ["simulated_fit", "informative", "direct"],
    "iterations": 3,
    "repetitions": 4,
    "direct_repetitions": 9,
    "budget": "smoke",
}


def test_the_rollouts_are_those_that_the_submitted_study_has(store: Store) -> None:
    spec = StudySpec.model_validate(STUDY)

    found = estimate(store, spec)

    assert listing.list_studies(store).items == ()
    study = submission.submit(store, spec)
    assert found.rollouts == study.progress.rollouts
    assert [each.rollouts for each in found.experiments] == [each.progress.rollouts for each in study.experiments]
    assert [each.repetitions for each in found.experiments] == [4, 4, 9]
    assert [each.iterations for each in found.experiments] == [3, 3, 0]


def test_the_time_is_that_of_rollouts_measured_here_with_the_same_robot_and_engine(store: Store) -> None:
    spec = StudySpec.model_validate(STUDY)
    before = estimate(store, spec, cores=2)
    made = submit_one(store, toy(repetitions=1))
    (one,) = claim(store, "me", 1)
    run(store, one)
    with store.transaction() as session:
        session.execute(update(RepetitionRow).values(seconds=30.0, rollouts_done=600))

    after = estimate(store, spec, cores=2)

    usual = engines["analytic"].usual_rollout_s
    assert made.progress.repetitions == 1
    assert [(each.seconds_per_rollout, each.measured) for each in before.engines] == [(usual, False)]
    assert [(each.engine, each.seconds_per_rollout, each.measured) for each in after.engines] == [
        ("analytic", 0.05, True)
    ]
    assert after.core_seconds == pytest.approx(after.rollouts * 0.05)
    assert after.seconds == pytest.approx(after.core_seconds / 2)


def test_the_direct_baseline_is_computed_by_the_engine_of_reality(sqlite_store: Store) -> None:
    spec = {
        "strategies": ["random", "direct"],
        "engine": "pybullet",
        "reality": {"engine": "mujoco"},
        "budget": "smoke",
    }

    found = estimate(sqlite_store, StudySpec.model_validate(spec))

    assert [each.engine for each in found.experiments] == ["pybullet", "mujoco"]
    assert {each.engine for each in found.engines} == {"pybullet", "mujoco"}


def test_what_the_direct_baseline_took_is_a_measurement_of_the_engine_of_reality(sqlite_store: Store) -> None:
    spec = StudySpec.model_validate(
        {"strategies": ["direct"], "engine": "mujoco", "reality": {"engine": "pybullet"}, "budget": "smoke"}
    )
    submission.submit(sqlite_store, spec)
    claim(sqlite_store, "me", 1)
    with sqlite_store.transaction() as session:
        session.execute(update(RepetitionRow).values(seconds=30.0, rollouts_done=600))

    direct = estimate(sqlite_store, spec)
    other = estimate(sqlite_store, spec.model_copy(update={"strategies": (PluginRef(name="random"),)}))

    assert [(each.engine, each.seconds_per_rollout, each.measured) for each in direct.engines] == [
        ("pybullet", 0.05, True)
    ]
    assert [(each.engine, each.measured) for each in other.engines] == [("mujoco", False)]


def test_few_at_once_take_as_long_as_few_cores(sqlite_store: Store) -> None:
    spec = StudySpec.model_validate(STUDY | {"max_parallel": 1})

    assert estimate(sqlite_store, spec, cores=16).cores == 3


@pytest.mark.dialects
def test_only_supervisors_that_were_heard_of_lately_work(store: Store) -> None:
    long_ago = datetime.now(UTC) - timedelta(hours=1)
    with store.transaction() as session:
        session.add(SupervisorRow(owner="works"))
        session.add(SupervisorRow(owner="gone", started_at=long_ago, heartbeat_at=long_ago))

    assert estimate(store, StudySpec.model_validate(STUDY)).supervisors == 1


def test_what_is_wrong_is_told_with_its_places_as_on_submission(sqlite_store: Store) -> None:
    api = TestClient(create_app(sqlite_store, limits=Limits(repetitions=10)))
    bad = STUDY | {
        "tunables": [{"name": "static_friction", "lower": 2.0, "upper": 1.0}],
        "strategies": ["simulatd_fit"],
    }

    for body in (bad, STUDY, {"iterations": "many"}):
        told, refused = api.post("/studies/estimate", json=body), api.post("/studies", json=body)

        assert told.status_code == refused.status_code == 422
        assert told.json()["errors"] == refused.json()["errors"]
    pointers = {each["pointer"] for each in api.post("/studies/estimate", json=bad).json()["errors"]}
    assert "/strategies/0" in pointers


def test_cores_are_the_workers_that_the_service_was_given(sqlite_store: Store) -> None:
    api = TestClient(create_app(sqlite_store, Settings(workers=3)), base_url="http://127.0.0.1:8000")

    assert api.post("/studies/estimate", json=STUDY).json()["cores"] == 3


def test_the_best_fitness_of_an_experiment_is_the_mean_of_its_repetitions_best(store: Store) -> None:
    made = submit_one(store, toy(repetitions=2))
    assert reading.read_experiment(store, made.id).best_fitness is None

    for recorded in (1.0, 2.0):
        (one,) = claim(store, "me", 1)
        run(store, one, some_log(recorded=recorded))

    (shown,) = listed(store)
    assert shown.best_fitness == reading.read_experiment(store, made.id).best_fitness
    assert shown.best_fitness == pytest.approx((3.0 + 4.0) / 2)


@pytest.mark.dialects
def test_a_best_fitness_of_nothing_has_no_sign_whichever_zero_a_database_takes_for_the_greater(store: Store) -> None:
    made = submit_one(store, toy(repetitions=1))
    (one,) = claim(store, "me", 1)

    run(store, one, (replace(step, recorded=-0.0) if isinstance(step, Probed) else step for step in some_log()))

    assert copysign(1.0, reading.read_experiment(store, made.id).best_fitness) == 1.0


def test_an_estimate_says_how_often_the_real_robot_runs(sqlite_store: Store) -> None:
    spec = {"robot": "toy_function", "strategies": ["random"], "iterations": 3, "repetitions": 2, "budget": "smoke"}
    runs = {}
    for probes in ("each", "last", "never"):
        reality = {"kind": "physical", "repeats": 5, "probes": probes}
        (cost,) = estimate(sqlite_store, StudySpec.model_validate(spec | {"reality": reality})).experiments
        runs[probes] = cost.runs

    assert runs == {"each": 2 * 5 * (3 + 4), "last": 2 * 5 * (3 + 1), "never": 2 * 5 * 3}
    assert estimate(sqlite_store, StudySpec.model_validate(spec)).experiments[0].runs == 0
