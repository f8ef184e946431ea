"""The Gaussian process against the textbook's formulas."""

from typing import Any

import numpy as np
import pytest

from gaplab.services.core.gaussian_process import GaussianProcess, Kernel
from gaplab.services.core.space import Space

SQUARE = Space.box([0.0, 0.0], [2.0, 1.0])
RNG = np.random.default_rng(3)
POINTS, ASKED = SQUARE.draw(6, RNG), SQUARE.draw(5, RNG)
VALUES = np.sin(3 * POINTS[:, 0]) + POINTS[:, 1]


def correlations(kernel: str, first: Any, second: Any, length: float) -> Any:
    away = np.sqrt((((first[:, None] - second[None]) / SQUARE.extent) ** 2).sum(axis=2)) / length
    if kernel == "matern52":
        return (1 + np.sqrt(5) * away + 5 * away**2 / 3) * np.exp(-np.sqrt(5) * away)
    return np.exp(-(away**2) / 2)


@pytest.mark.parametrize("kernel", ["squared_exponential", "matern52"])
def test_the_posterior_is_that_of_the_formula(kernel: Kernel) -> None:
    process = GaussianProcess(kernel, length_scale=0.4, noise=0.01, mean=0.5, variance=2.0)

    mean, deviation = process.given(SQUARE, POINTS, VALUES).predict(ASKED)

    inverse = np.linalg.inv(correlations(kernel, POINTS, POINTS, 0.4) + 0.01 * np.eye(6))
    across = correlations(kernel, ASKED, POINTS, 0.4)
    np.testing.assert_allclose(mean, 0.5 + across @ inverse @ (VALUES - 0.5), rtol=1e-6)
    np.testing.assert_allclose(deviation**2, 2.0 * (1 - np.diag(across @ inverse @ across.T)), rtol=1e-6)


def test_an_estimated_mean_is_that_of_least_squares_and_its_error_counts() -> None:
    mean, deviation = GaussianProcess(length_scale=0.4, variance=2.0).given(SQUARE, POINTS, VALUES).predict(ASKED)

    # Kriging as a linear system with a multiplier for weights that add up to 1
    system = np.block([[correlations("", POINTS, POINTS, 0.4), np.ones((6, 1))], [np.ones((1, 6)), np.zeros((1, 1))]])
    across = np.column_stack([correlations("", ASKED, POINTS, 0.4), np.ones(5)])
    weights = np.linalg.solve(system, across.T)
    np.testing.assert_allclose(mean, weights[:6].T @ VALUES, rtol=1e-5)
    np.testing.assert_allclose(deviation**2, 2.0 * (1 - (weights.T * across).sum(axis=1)), rtol=1e-4)


def test_without_noise_it_returns_the_values_at_their_points_for_certain() -> None:
    mean, deviation = GaussianProcess().given(SQUARE, POINTS, VALUES).predict(POINTS)

    np.testing.assert_allclose(mean, VALUES, atol=1e-5)
    assert deviation.max() < 1e-3 * GaussianProcess().given(SQUARE, POINTS, VALUES).predict(ASKED)[1].max()


def test_a_phase_is_near_itself_across_its_bounds() -> None:
    ring = Space.box([0.0, 0.0], [2.0, 1.0], [True, False])

    known = GaussianProcess(length_scale=0.2).given(ring, np.array([[0.0, 0.5], [1.0, 0.5]]), np.array([1.0, -1.0]))
    mean, _ = known.predict(np.array([[2.0, 0.5], [1.9, 0.5], [0.1, 0.5]]))

    np.testing.assert_allclose(mean[0], 1.0)
    assert mean[1] == pytest.approx(mean[2])
    assert mean[1] > 0.5


def test_the_length_scale_is_the_likeliest_within_its_bounds() -> None:
    line, points = Space.box([0.0], [1.0]), np.linspace(0, 1, 12)[:, None]
    drawn = [np.linalg.cholesky(np.exp(-0.5 * ((points - points.T) / 0.2) ** 2) + 1e-8 * np.eye(12))]
    values = [drawn[0] @ np.random.default_rng(seed).normal(size=12) for seed in range(9)]

    found = [GaussianProcess(length_scale=(0.01, 10.0)).given(line, points, each).length_scale for each in values]
    bounded = [GaussianProcess(length_scale=(0.5, 1.0)).given(line, points, each).length_scale for each in values]

    assert 0.14 < np.median(found) < 0.28
    assert min(bounded) == 0.5


def test_one_value_and_equal_values_leave_the_rest_uncertain() -> None:
    for count in (1, 3):
        known = GaussianProcess().given(SQUARE, POINTS[:count], np.full(count, 0.3))
        mean, deviation = known.predict(ASKED)

        np.testing.assert_allclose(mean, 0.3)
        assert deviation.min() > 0.01
