"""The demo's study of physics fits the machine."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from gaplab.api.commands.demo import SECONDS, SIZES, sized, trial
from gaplab.schemas.estimates import EngineCost, EstimateRead
from gaplab.schemas.spec import ExperimentSpec, StudySpec
from gaplab.services.experiments import estimates
from gaplab.services.specs.resolution import resolve_experiment
from gaplab.services.store.session import Store

QUADRUPED: dict[str, Any] = json.loads((Path(__file__).parents[2] / "examples" / "quadruped.json").read_text())


class Service:
    """A service that estimates as the real one does, on a machine of a given speed."""

    def __init__(self, store: Store, rollout_s: float) -> None:
        self._store, self._rollout_s = store, rollout_s

    def estimate(self, spec: Mapping[str, Any]) -> EstimateRead:
        found = estimates.estimate(self._store, StudySpec.model_validate(spec), cores=2)
        cost = EngineCost(engine="pybullet", seconds_per_rollout=self._rollout_s, measured=True)
        return found.model_copy(update={"engines": (cost,), "seconds": found.rollouts * self._rollout_s / 2})


@pytest.mark.parametrize("rollout_ms", [2, 6, 13, 26])
def test_the_study_fits_into_the_time(sqlite_store: Store, rollout_ms: int) -> None:
    found, reason = sized(QUADRUPED, Service(sqlite_store, rollout_ms / 1000).estimate)

    again = Service(sqlite_store, rollout_ms / 1000).estimate(found)
    assert again.seconds <= SECONDS
    assert found["name"] == f"quadruped, sized for {rollout_ms} ms a rollout"
    assert reason.startswith(f"{rollout_ms} ms a rollout on 2 cores: about ")


def test_a_fast_machine_computes_the_whole_study_and_a_slow_one_the_smallest(sqlite_store: Store) -> None:
    whole, _ = sized(QUADRUPED, Service(sqlite_store, 0.002).estimate)
    small, _ = sized(QUADRUPED, Service(sqlite_store, 1.0).estimate)

    assert whole | {"name": QUADRUPED["name"]} == QUADRUPED
    assert (small["repetitions"], small["iterations"]) == SIZES[-1][:2]
    assert small["budget"]["selection_evaluations"] == 20


def test_what_times_the_rollouts_is_of_the_same_physics() -> None:
    timed, study = (StudySpec.model_validate(QUADRUPED), trial(QUADRUPED))

    resolved = resolve_experiment(ExperimentSpec.model_validate(study))

    assert resolved.robot.name == timed.robot.name
    assert resolved.strategy.name == "direct"
