"""The paper's formulas against values computed by hand."""

from typing import Any

import numpy as np
import pytest

from gaplab.schemas.plugin import PluginRef
from gaplab.services.contract.strategies import belief
from gaplab.services.core.discrepancies import discrepancies
from gaplab.services.core.scoring import (
    NO_FLOOR,
    scaled_uniqueness_penalty,
    simulator_weights,
    uniqueness_penalty,
    weighted_deviation,
    weighted_mean,
)
from gaplab.services.core.space import Space
from gaplab.services.core.strategies import strategies
from gaplab.services.core.strategies.base import DiverseOptions
from gaplab.services.core.types import Belief, Sample

FITNESSES = np.array([[1.0, 3.0], [2.0, 2.0]])
WEIGHTS = np.array([0.75, 0.25])


def test_the_weighted_mean_counts_accurate_simulators_more() -> None:
    np.testing.assert_allclose(weighted_mean(FITNESSES, WEIGHTS), [1.5, 2.0])


def test_the_weighted_deviation_is_the_disagreement_of_the_simulators() -> None:
    # mean 1.5: 0.75 (1 - 1.5)^2 + 0.25 (3 - 1.5)^2 = 0.75
    np.testing.assert_allclose(weighted_deviation(FITNESSES, WEIGHTS), [0.75**0.5, 0.0])


def test_the_penalty_is_the_mean_inverse_distance_over_a_hundred() -> None:
    samples = [Sample(np.array([0.0, 0.0]), 0.0), Sample(np.array([0.0, 3.0]), 4.0)]

    penalty = uniqueness_penalty(np.array([[0.0, 3.0]]), np.array([4.0]), samples[:1])
    of_two = uniqueness_penalty(np.array([[3.0, 3.0]]), np.array([4.0]), samples)

    assert penalty == pytest.approx(1 / 5 / 100)
    assert of_two == pytest.approx((1 / 34**0.5 + 1 / 3) / 2 / 100)


def test_the_distance_is_over_genome_and_fitness_together() -> None:
    sample = [Sample(np.array([0.5]), 1.0)]

    penalty = uniqueness_penalty(np.array([[0.5]]), np.array([3.0]), sample)

    assert penalty == pytest.approx(1 / 2 / 100)


def test_before_the_first_sample_there_is_no_penalty() -> None:
    np.testing.assert_array_equal(uniqueness_penalty(np.zeros((3, 2)), np.zeros(3), []), np.zeros(3))


def test_a_controller_on_top_of_a_sample_has_a_large_but_finite_penalty() -> None:
    penalty = uniqueness_penalty(np.array([[0.5]]), np.array([1.0]), [Sample(np.array([0.5]), 1.0)])

    assert np.isfinite(penalty).all()
    assert penalty[0] > 1_000


def believed(*samples: Sample, scale: float = 1.0, discrepancy: str = "squared_fitness") -> Belief:
    space = Space.box([0.0, 0.0], [2.0, 10.0], [True, False])
    return Belief(space, np.zeros(2), samples, (), space, ("a", "b"), scale, discrepancies[discrepancy]())


def test_scaled_distances_count_extents_turns_and_shares_of_the_scale() -> None:
    sample = Sample(np.array([0.1, 3.0]), 0.5)

    # the phase is 0.2 of 2 away around the turn, the width 2 of 10, the fitness 0.1 of 0.5
    penalty = scaled_uniqueness_penalty(np.array([[1.9, 5.0]]), np.array([0.6]), believed(sample, scale=0.5))

    assert penalty == pytest.approx(0.5 / (0.1**2 + 0.2**2 + 0.2**2) ** 0.5 / 100)


def test_samples_that_failed_have_no_scaled_distance() -> None:
    failed = believed(Sample(np.zeros(2), float("nan")))

    np.testing.assert_array_equal(scaled_uniqueness_penalty(np.zeros((3, 2)), np.zeros(3), failed), np.zeros(3))


@pytest.mark.parametrize(
    ("options", "discrepancy", "floor"),
    [
        ({}, "squared_fitness", (0.03 * 0.5) ** 2),
        ({"least_share": 0.1}, "squared_fitness", 0.05**2),
        ({"least_error": 0.03}, "squared_fitness", 0.03**2),
        ({"least_error": 0.0}, "squared_fitness", NO_FLOOR),
        ({}, "absolute_fitness", 0.03 * 0.5),
        ({"least_error": 0.2}, "absolute_fitness", 0.2),
        ({}, "readings", 1.0),
        ({"least_error": 0.5}, "readings", 0.25),
        ({"least_error": 0.0}, "readings", NO_FLOOR),
    ],
)
def test_the_floor_is_a_share_of_the_scale_or_the_noise_of_readings(
    options: dict[str, float], discrepancy: str, floor: float
) -> None:
    assert DiverseOptions(**options).floor(believed(scale=0.5, discrepancy=discrepancy)) == pytest.approx(floor)  # type: ignore[arg-type]


def test_without_a_floor_a_perfect_simulator_takes_all_the_weight() -> None:
    np.testing.assert_allclose(simulator_weights(np.array([0.0, 1e-6, np.inf]), NO_FLOOR), [1.0, 0.0, 0.0], atol=1e-9)
    np.testing.assert_allclose(simulator_weights(np.zeros(4), NO_FLOOR), np.full(4, 0.25))


def test_weights_are_the_simulators_fitnesses_normalised() -> None:
    # fitness 1/0.1 = 10 and 1/0.4 = 2.5
    np.testing.assert_allclose(simulator_weights(np.array([0.1, 0.4]), floor=1e-9), [0.8, 0.2])


def test_weights_are_equal_before_any_sample() -> None:
    np.testing.assert_allclose(simulator_weights(np.zeros(4), floor=1e-6), np.full(4, 0.25))


def test_a_perfect_simulator_takes_the_weight_that_the_floor_allows() -> None:
    weights = simulator_weights(np.array([0.0, 0.03]), floor=0.01)

    np.testing.assert_allclose(weights, [0.75, 0.25])


def test_a_failed_simulator_weighs_nothing_and_if_all_fail_they_weigh_alike() -> None:
    np.testing.assert_allclose(simulator_weights(np.array([0.5, np.inf]), floor=0.01), [1.0, 0.0])
    np.testing.assert_allclose(simulator_weights(np.array([np.inf, np.inf]), floor=0.01), [0.5, 0.5])


def test_a_simulator_that_failed_on_a_sample_cannot_rule_controllers_out() -> None:
    weights = simulator_weights(np.array([0.1, 0.1, np.inf]), floor=1e-9)
    fitnesses = np.array([[1.0, 3.0, np.nan], [2.0, 2.0, 5.0]])

    np.testing.assert_allclose(weighted_mean(fitnesses, weights), [2.0, 2.0])
    np.testing.assert_allclose(weighted_deviation(fitnesses, weights), [1.0, 0.0])


def test_a_failed_rollout_makes_the_score_nan() -> None:
    failed = np.array([[1.0, np.nan]])

    assert np.isnan(weighted_mean(failed, WEIGHTS)).all()
    assert np.isnan(weighted_deviation(failed, WEIGHTS)).all()


def test_farthest_without_a_sample_keeps_away_from_what_its_search_began_with() -> None:
    asked: list[Any] = []

    def search(score: Any, **_: Any) -> Any:
        for readings in ([[0.0, 0.0], [0.0, 2.0]], [[3.0, 1.0]]):
            asked.append(score(np.zeros((len(readings), 2)), np.insert(readings, 0, 0.5, axis=1)[:, None, :]))
        return np.zeros(2)

    farthest: Any = strategies.create(PluginRef(name="farthest"))
    farthest.select(belief(farthest), search, np.random.default_rng(0))

    np.testing.assert_allclose(np.concatenate(asked), np.sqrt([0.5, 0.5, 4.5]))
