"""Simulator tuning."""

from typing import Any

import numpy as np
import pytest

from gaplab.services.core.answers import Answers
from gaplab.services.core.optimizers.steady_state import SteadyState, SteadyStateOptions
from gaplab.services.core.space import Space
from gaplab.services.core.tuners.base import TuningTask
from gaplab.services.core.tuners.search import SearchTuner
from gaplab.services.core.tuning import Misfit, summed
from gaplab.services.core.types import Sample
from tests.fakes import TRUTH, Recorder, paraboloid

SPACE = Space.box([0.0, 0.0], [1.0, 1.0])
GENOMES = np.array([[0.1, 0.9], [0.8, 0.3], [0.4, 0.4]])
SAMPLES = [Sample(genome, float(paraboloid(genome[None], TRUTH[None])[0, 0])) for genome in GENOMES]


def tune(misfit: Any, space: Any, optimizer: Any, evaluations: Any, rng: Any) -> Any:
    """All of the final population, best first."""
    return SearchTuner().tune(TuningTask(misfit, space, optimizer, 1_000, evaluations, ()), rng)


def test_squared_errors_are_summed_over_samples() -> None:
    np.testing.assert_allclose(summed(np.array([[0.25, 0.25], [0.0, 4.0]])), [0.25, 4.25])


def test_a_simulator_that_fails_on_a_sample_has_an_infinite_error() -> None:
    assert summed(np.array([[0.0, np.nan], [0.0, 0.0]])).tolist() == [0.0, np.inf]


def test_tuning_finds_the_parameters_of_reality() -> None:
    best, *_ = tune(Misfit(Answers(paraboloid), SAMPLES), SPACE, SteadyState(), 1000, np.random.default_rng(1))

    np.testing.assert_allclose(best.parameters, TRUTH, atol=0.01)


def many_samples(count: Any) -> Any:
    genomes = np.random.default_rng(9).random((count, 2))
    return [Sample(genome, float(paraboloid(genome[None], TRUTH[None])[0, 0])) for genome in genomes]


class Thorough(SteadyState):
    """The same evolution, but it knows no threshold: every simulator is asked for every sample."""

    def rejection_thresholds(self, state: Any, genomes: Any) -> Any:
        return np.full(len(genomes), -np.inf)

    def diverse(self, size: Any) -> Any:
        return Thorough(super().diverse(size).options)


@pytest.mark.parametrize("batch", [1, 4])
@pytest.mark.parametrize("count", [1, 3, 10])
@pytest.mark.parametrize("diverse", [False, True])
def test_giving_up_simulators_below_their_threshold_saves_rollouts_and_changes_no_bit(
    count: Any, diverse: Any, batch: Any
) -> None:
    def tuned(optimizer: Any) -> Any:
        simulate = Recorder()
        optimizer = optimizer.diverse(8) if diverse else optimizer
        misfit = Misfit(Answers(simulate, lambda: batch), many_samples(count))
        found = tune(misfit, SPACE, optimizer, 300, np.random.default_rng(1))
        return [(each.parameters.tobytes(), each.squared_error) for each in found], simulate.rollouts

    thorough, all_rollouts = tuned(Thorough())
    saving, rollouts = tuned(SteadyState())

    assert saving == thorough
    assert max(rollouts, all_rollouts) <= 300 * count
    assert count <= batch or rollouts < 0.9 * all_rollouts


def test_a_simulator_whose_physics_fails_is_given_up_too() -> None:
    def half_broken(genomes: Any, parameters: Any) -> Any:
        return np.where(parameters[None, :, 0] < 0.5, np.nan, paraboloid(genomes, parameters))

    def tuned(optimizer: Any) -> Any:
        found = tune(Misfit(Answers(half_broken), many_samples(5)), SPACE, optimizer, 200, np.random.default_rng(1))
        return [(each.parameters.tobytes(), each.squared_error) for each in found]

    assert tuned(SteadyState()) == tuned(Thorough())


def test_a_simulators_error_does_not_depend_on_how_many_are_asked_for_at_once() -> None:
    terms = np.random.default_rng(0).normal(size=(50, 20)) ** 2

    one_by_one = [summed(terms[:, [index]])[0] for index in range(20)]

    assert summed(terms).tolist() == one_by_one


def test_simulators_come_best_first_with_their_own_error() -> None:
    simulators = tune(Misfit(Answers(paraboloid), SAMPLES), SPACE, SteadyState(), 100, np.random.default_rng(1))

    errors = [each.squared_error for each in simulators]
    measured = np.array([each.fitness for each in SAMPLES])
    found = paraboloid(GENOMES, np.array([each.parameters for each in simulators]))
    again = summed((found - measured[:, None]) ** 2)
    assert errors == sorted(errors)
    np.testing.assert_array_equal(again, errors)


def test_a_diverse_ensemble_stays_farther_apart_than_a_converged_population() -> None:
    def spread(optimizer: Any) -> Any:
        found = tune(Misfit(Answers(paraboloid), SAMPLES), SPACE, optimizer, 500, np.random.default_rng(1))
        return np.array([each.parameters for each in found]).std(axis=0).mean()

    population = SteadyState(SteadyStateOptions(population=10))

    assert spread(population.diverse(10)) > 10 * spread(population)


def test_failing_physics_never_wins() -> None:
    def half_broken(genomes: Any, parameters: Any) -> Any:
        return np.where(parameters[None, :, 0] < 0.5, np.nan, paraboloid(genomes, parameters))

    best, *_ = tune(Misfit(Answers(half_broken), SAMPLES), SPACE, SteadyState(), 300, np.random.default_rng(1))

    assert best.parameters[0] >= 0.5
