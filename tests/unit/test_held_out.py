"""Samples that no tuning sees."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from gaplab.schemas.spec import ExperimentSpec
from gaplab.services.core.loop import repetition
from gaplab.services.core.strategies import strategies
from gaplab.services.core.tuners.search import SearchTuner
from gaplab.services.core.tuning import is_held_out, split
from gaplab.services.core.types import Measured, Sample, Tuned
from gaplab.services.specs.resolution import expected_rollouts, resolve_experiment
from tests.fakes import CountedReality, Recorder, flat, paraboloid, small_setting


class Listener(SearchTuner):
    """A tuner that remembers how many samples it was given."""

    def __init__(self) -> None:
        super().__init__()
        self.given: list[int] = []

    def tune(self, task: Any, rng: Any) -> Any:
        self.given.append(task.misfit.samples)
        return super().tune(task, rng)


@pytest.mark.parametrize(
    ("share", "expected"), [(0.0, []), (0.1, [10]), (0.2, [5, 10]), (0.4, [3, 5, 8, 10]), (0.5, [2, 4, 6, 8, 10])]
)
def test_the_share_holds_for_the_first_samples_whatever_their_number(share: float, expected: list[int]) -> None:
    assert [number for number in range(1, 11) if is_held_out(number, share)] == expected


def test_samples_are_split_by_their_place() -> None:
    samples = [Sample(np.array([float(number)]), 0.0) for number in range(1, 6)]

    seen, unseen = split(samples, 0.5)

    assert [each.genome[0] for each in seen] == [1, 3, 5]
    assert [each.genome[0] for each in unseen] == [2, 4]


def test_what_teaches_does_not_depend_on_what_is_held_out() -> None:
    tuner = Listener()

    list(repetition(small_setting("back_to_reality", {"trials": 1}, tuner=tuner, held_out=0.5, iterations=5)))

    assert tuner.given == [1, 2, 3]  # samples 1, 3 and 5


def test_no_tuning_sees_a_held_out_sample_and_the_best_simulator_is_tested_on_it() -> None:
    tuner = Listener()

    steps = list(repetition(small_setting("random", tuner=tuner, held_out=0.5)))

    assert tuner.given == [1, 1, 2]
    held_out = [step.sample for step in steps if isinstance(step, Measured)][1]
    last = [step for step in steps if isinstance(step, Tuned)][-1]
    best = last.simulators[0]
    simulated = paraboloid(held_out.genome[None], best.parameters[None])[0, 0]
    assert best.held_out_error == pytest.approx((simulated - held_out.fitness) ** 2)
    assert [step.simulators[0].held_out_error is None for step in steps if isinstance(step, Tuned)] == [
        *[True] * 2,
        *[False] * 2,
    ]


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=() if name == "simulated_fit" else pytest.mark.release) for name in sorted(strategies)],
)
def test_a_resumed_repetition_holds_out_the_same_samples(name: str) -> None:
    whole = [flat(step) for step in repetition(small_setting(name, held_out=0.5))]

    for stopped_after in range(len(whole) + 1):
        log = list(repetition(small_setting(name, held_out=0.5)))[:stopped_after]
        assert [flat(step) for step in (*log, *repetition(small_setting(name, held_out=0.5), log))] == whole


def test_the_budget_of_tuning_is_that_of_the_samples_that_it_sees() -> None:
    simulate = Recorder()

    steps = list(repetition(small_setting("random", simulate=simulate, held_out=0.5)))

    costs = [step.cost for step in steps if hasattr(step, "cost")]
    assert sum(cost.rollouts + cost.saved for cost in costs) == 160 + 50 * (1 + 1 + 2) + 2
    assert sum(cost.rollouts for cost in costs) == simulate.rollouts


def test_a_failed_measurement_is_no_test() -> None:
    reality = CountedReality(lambda genome: float("nan"))

    steps = list(repetition(small_setting("random", reality=reality, held_out=0.5)))

    assert all(step.simulators[0].held_out_error is None for step in steps if isinstance(step, Tuned))


def test_physics_that_fails_on_a_held_out_sample_leaves_its_error_unknown() -> None:
    def failing(genomes: Any, parameters: Any) -> Any:
        fitnesses = paraboloid(genomes, parameters)
        return np.where((genomes == unseen.genome).all(axis=1)[:, None], np.nan, fitnesses)

    setting = small_setting("random", held_out=0.5)
    measured = [step.sample for step in repetition(setting) if isinstance(step, Measured)]
    unseen = measured[1]

    steps = list(repetition(replace(setting, simulate=failing)))

    assert [step.simulators[0].held_out_error for step in steps if isinstance(step, Tuned)] == [None] * 4


def test_the_estimate_counts_what_is_held_out() -> None:
    def rollouts(**changes: Any) -> int:
        spec = {"strategy": "random", "robot": "toy_function", "iterations": 5, "budget": "smoke"} | changes
        return expected_rollouts(resolve_experiment(ExperimentSpec.model_validate(spec)))

    # the samples 2 and 4 are tuned on in the last 4 and 2 iterations, or tested on once in each of these
    assert rollouts() - rollouts(held_out=0.5) == (4 + 2) * (60 - 1)
