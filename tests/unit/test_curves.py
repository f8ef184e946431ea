"""Curves: the numbers that the figure shows."""

from itertools import combinations
from typing import Any

import numpy as np
import pytest

from gaplab.services.core.curves import best_of_searches, curve_point, curve_points

RECORDED = np.array([[0.9, 1.2], [0.8, 1.4], [1.0, np.nan]])


def test_a_point_has_mean_deviation_and_students_interval() -> None:
    point = curve_point(1, np.array([1.0, 2.0, 3.0, 4.0]))

    sd = (5 / 3) ** 0.5
    half = 3.182446305 * sd / 2  # t of 97.5 % with 3 degrees of freedom, from a table
    assert (point.evaluations, point.n, point.mean) == (1, 4, 2.5)
    assert point.sd == pytest.approx(sd)
    assert (point.lower, point.upper) == pytest.approx((2.5 - half, 2.5 + half))


def test_there_is_a_point_for_every_number_of_evaluations_from_none_on() -> None:
    assert [each.evaluations for each in curve_points(RECORDED)] == [0, 1]


def test_what_is_missing_counts_in_no_statistic_and_stays_visible_by_repetition() -> None:
    _, second = curve_points(RECORDED)

    assert second.n == 2
    assert second.mean == pytest.approx(1.3)
    assert second.values == (1.2, 1.4, None)


def test_one_value_has_a_mean_and_no_spread_and_none_has_nothing() -> None:
    one, none = curve_points(np.array([[1.0, np.nan]]))

    assert (one.mean, one.sd, one.lower) == (1.0, None, None)
    assert (none.n, none.mean, none.values) == (0, None, (None,))


def test_a_curve_may_fall() -> None:
    means = [each.mean for each in curve_points(np.array([[1.0, 0.5], [1.0, 0.7]]))]

    assert means[1] < means[0]


def test_equal_values_do_not_spread_though_their_mean_is_rounded() -> None:
    (point,) = curve_points(np.full((3, 1), 0.1))

    assert point.sd == 0
    assert point.lower == point.upper == point.mean


@pytest.mark.parametrize("large", [1e200, 1.7e308])
def test_values_too_large_to_be_squared_have_no_spread_and_are_no_error(large: Any) -> None:
    (point,) = curve_points(np.array([[large], [-large / 2], [large]]))

    assert (point.sd, point.lower, point.upper) == (None, None, None)
    assert point.values == (large, -large / 2, large)


@pytest.mark.parametrize("size", [1, 2, 3, 4])
def test_the_best_of_searches_is_the_mean_of_the_largest_over_all_choices_of_them(size: int) -> None:
    values = np.round(np.random.default_rng(1).normal(size=21), 1)

    best = best_of_searches(np.array([*values, np.nan]))

    assert best[size - 1] == pytest.approx(np.mean([max(choice) for choice in combinations(values, size)]))
    assert len(best) == 10


def test_the_best_of_searches_is_known_for_half_of_them_if_there_are_twenty() -> None:
    evenly = np.linspace(0.0, 1.9, 20)

    assert best_of_searches(evenly) == pytest.approx([0.1 * (21 * size / (size + 1) - 1) for size in range(1, 11)])
    assert best_of_searches(np.array([*evenly[1:], np.nan])) == ()
    assert len(best_of_searches(np.arange(3000.0))) == 1001


def test_the_best_of_searches_that_overflow_is_none_and_no_warning() -> None:
    best = best_of_searches(np.full(20, np.finfo(float).max))

    assert len(best) == 10
    assert all(each is None or each == pytest.approx(np.finfo(float).max) for each in best)
