"""The tuner SimOpt: its steps are bounded, and the log alone carries its distribution."""

from typing import Any

import numpy as np
import pytest

from gaplab.services.contract.tuners import EVALUATIONS, SPACE, TRUTH, Physics, samples
from gaplab.services.core.answers import Answers
from gaplab.services.core.discrepancies.readings import Readings, ReadingsOptions
from gaplab.services.core.optimizers.steady_state import SteadyState
from gaplab.services.core.tuners.base import TuningTask
from gaplab.services.core.tuners.simopt import SimOpt, reps_weights
from gaplab.services.core.tuning import Misfit


def tuned(previous: Any = (), evaluations: int = EVALUATIONS, ensemble: int = 1) -> Any:
    physics = Physics()
    misfit = Misfit(Answers(physics.fitness, sense=physics.sense), samples(), Readings(), np.array([0.25, 0.5, 0.75]))
    task = TuningTask(misfit, SPACE, SteadyState(), ensemble, evaluations, tuple(previous))
    return SimOpt().tune(task, np.random.default_rng(2))


def width(simulator: Any) -> Any:
    return simulator.interval[:, 1] - simulator.interval[:, 0]


@pytest.mark.parametrize("costs", [np.arange(200.0), np.arange(200.0) ** 4, np.r_[0.0, np.full(199, 1e9)]])
def test_weights_diverge_from_equal_ones_by_the_bound_and_no_more(costs: Any) -> None:
    weights = reps_weights(costs, 1.0, 0.001)

    there = weights[weights > 0]
    assert weights.argmax() == costs.argmin()
    assert float((there * np.log(there * 200)).sum()) == pytest.approx(1.0, abs=1e-6)


def test_equal_costs_say_nothing_and_a_least_temperature_stops_before_the_bound() -> None:
    assert reps_weights(np.ones(5), 1.0, 0.001).tolist() == pytest.approx([0.2] * 5)

    ratio = reps_weights(np.array([0.0, 0.5, 1.0]), 50.0, 1.0)
    assert (ratio / ratio[0]).tolist() == pytest.approx(np.exp([0.0, -0.5, -1.0]).tolist())


def test_a_tuning_goes_on_from_the_first_simulator_of_the_one_before_and_nothing_else() -> None:
    first = tuned(ensemble=7)

    second, alone = tuned(first), tuned(first[:1])

    assert np.array_equal(second[0].parameters, alone[0].parameters)
    assert np.all(width(second[0]) < width(first[0]))
    assert np.allclose((second[0].parameters - TRUTH) / SPACE.extent, 0.0, atol=0.05)


def test_a_budget_without_an_update_keeps_the_distribution() -> None:
    first = tuned()

    kept = tuned(first, evaluations=5)

    assert np.allclose(kept[0].parameters, first[0].parameters)
    assert np.allclose(width(kept[0]), width(first[0]))


@pytest.mark.parametrize("error", [0.0, 0.3, 4.0])
def test_absolute_differences_of_readings_add_to_squared_ones(error: float) -> None:
    both = Readings(ReadingsOptions(absolute_weight=0.5))
    simulated, measured = np.array([[[1.0, error, -error]]]), np.array([[1.0, 0.0, 0.0]])

    term = both.terms(simulated, measured, np.array([0.0, 0.5]))

    assert term[0, 0] == pytest.approx(0.5 * error + error**2) == both.floor(error)
    assert both.error(term[0, 0]) == pytest.approx(error)
