"""The paper's toy, Fig. 3: what its text says of the figure holds for ours."""

from functools import cache
from typing import Any

import numpy as np
import pytest

from gaplab.schemas.spec import ExperimentSpec
from gaplab.services.core.loop import repetition
from gaplab.services.core.types import Probed, Tuned
from gaplab.services.specs.assembly import setting
from gaplab.services.specs.resolution import resolve_experiment

ITERATIONS, REPETITIONS = 6, 8
TRUTH = np.array([1.0, 0.8, 0.0])


@cache
def logs(strategy: Any) -> Any:
    spec = resolve_experiment(
        ExperimentSpec.model_validate(
            {
                "strategy": strategy,
                "robot": "toy_function",
                "iterations": ITERATIONS,
                "repetitions": REPETITIONS,
                "budget": {"controller_evaluations": 150, "selection_evaluations": 150, "simulator_evaluations": 300},
                "seed": 2012,
            }
        )
    )
    return [list(repetition(setting(spec, number))) for number in range(REPETITIONS)]


def recorded(strategy: Any) -> Any:
    """`(repetitions, iterations + 1)`"""
    return np.array([[step.recorded for step in log if isinstance(step, Probed)] for log in logs(strategy)])


def distances(strategy: Any) -> Any:
    """`(repetitions, iterations + 1)`: of the best simulator to reality."""
    return np.array(
        [
            [np.linalg.norm(step.simulators[0].parameters - TRUTH) for step in log if isinstance(step, Tuned)]
            for log in logs(strategy)
        ]
    )


@pytest.mark.release
def test_as_samples_are_added_the_simulations_become_more_accurate() -> None:
    means = distances("simulated_fit").mean(axis=0)

    assert means[-1] < means[0] / 2


@pytest.mark.release
def test_the_fitness_of_the_transferred_controller_rises_until_it_is_near_the_maximum_of_reality() -> None:
    means = recorded("simulated_fit").mean(axis=0)
    best = recorded("direct").mean()

    assert means[0] < 0.75 * best
    assert means[-1] > 0.95 * best


@pytest.mark.parametrize("strategy", ["informative", "simulated_fit_and_informative"])
@pytest.mark.release
def test_strategies_that_weigh_simulators_close_the_gap_too(strategy: Any) -> None:
    assert recorded(strategy)[:, -1].mean() > 0.98 * recorded("direct").mean()


@pytest.mark.release
def test_fit_and_informative_is_ahead_of_random_when_samples_are_few() -> None:
    assert recorded("simulated_fit_and_informative")[:, 1:4].mean() > recorded("random")[:, 1:4].mean()


def test_evolution_in_reality_finds_the_maximum_of_reality() -> None:
    spec = ExperimentSpec.model_validate({"strategy": "direct", "robot": "toy_function", "budget": "smoke"})
    reality = setting(resolve_experiment(spec), 0).reality

    maximum = max(reality(np.array([x])).fitness for x in np.linspace(0, 1, 1001))

    assert recorded("direct").min() == pytest.approx(maximum, rel=1e-3)
