"""The end of a curve: rising, flat, falling, or unclear."""

import numpy as np
import pytest

from gaplab.schemas.reports import Trend
from gaplab.services.core.arrays import FloatArray
from gaplab.services.findings.judged import FEWEST_REPETITIONS, curve_end


def curve(means: list[float], noise: float = 0.01, repetitions: int = 20, seed: int = 0) -> FloatArray:
    rng = np.random.default_rng(seed)
    own = rng.normal(0, 0.2, (repetitions, 1))  # repetitions differ more than a curve rises
    return np.array(means) + own + rng.normal(0, noise, (repetitions, len(means)))


def test_a_curve_that_stops_rising_is_flat_since_then() -> None:
    end = curve_end(curve([0.1, 0.4, 0.7, 1.0, 1.0, 1.0, 1.0, 1.0]), 7)

    assert end.trend is Trend.FLAT
    assert end.since == 3
    assert end.last == 7
    assert end.lower is not None
    assert end.upper is not None
    assert end.lower <= 0 <= end.upper < 0.1


def test_a_curve_that_rises_to_the_end_rises_although_repetitions_differ_more() -> None:
    end = curve_end(curve([0.1, 0.2, 0.3, 0.4, 0.5, 0.6]), 5)

    assert end.trend is Trend.RISING
    assert end.gain == pytest.approx(0.3, abs=0.02)
    assert end.since == 2


def test_a_curve_that_falls_is_not_flat() -> None:
    assert curve_end(curve([0.9, 0.9, 0.8, 0.6, 0.4, 0.2]), 5).trend is Trend.FALLING


def test_noise_that_hides_a_gain_worth_having_is_not_flat_but_unclear() -> None:
    end = curve_end(curve([0.5] * 6, noise=0.5, repetitions=6, seed=1), 5)

    assert end.trend is Trend.UNCLEAR
    assert end.upper is not None
    assert end.upper > 0.05


@pytest.mark.parametrize(("repetitions", "last"), [(FEWEST_REPETITIONS - 1, 7), (20, 2)])
def test_of_few_repetitions_or_evaluations_nothing_is_said(repetitions: int, last: int) -> None:
    end = curve_end(curve([0.5] * 8, repetitions=repetitions), last)

    assert end.trend is Trend.TOO_FEW
    assert end.gain is None


def test_only_repetitions_with_both_values_count() -> None:
    values = curve([0.1, 0.4, 0.7, 1.0, 1.0, 1.0, 1.0, 1.0])
    values[:5, 7] = np.nan
    values[5:8, 3] = np.nan

    end = curve_end(values, 7)

    assert end.n == 12
    assert end.trend is Trend.FLAT


def test_equal_values_are_flat_from_the_start() -> None:
    end = curve_end(np.full((8, 6), 0.5), 5)

    assert (end.trend, end.since, end.gain) == (Trend.FLAT, 0, 0.0)
