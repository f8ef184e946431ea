"""The paper's t-tests and their companions, against formulas written out and scipy's own."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from gaplab.services.core.statistics import compare, compare_all, effect_size, holm

FIRST = np.array([1.2, 1.4, 1.1, 1.3, 1.5])
SECOND = np.array([1.0, 0.9, 1.2, 1.1])


def test_students_t_is_the_pooled_variance_formula() -> None:
    student, _, _ = compare(FIRST, SECOND)

    # by hand: means 1.3 and 1.05, sums of squares 0.1 and 0.05, pooled variance 0.15 / 7
    t = 0.25 / (0.15 / 7 * (1 / 5 + 1 / 4)) ** 0.5
    assert student.statistic == pytest.approx(t)
    assert student.degrees_of_freedom == 7
    assert student.p == pytest.approx(2 * stats.t.sf(t, 7))


def test_welchs_t_does_not_pool_the_variances() -> None:
    _, welch, _ = compare(FIRST, SECOND)

    a, b = 0.1 / 4 / 5, 0.05 / 3 / 4
    freedom = (a + b) ** 2 / (a**2 / 4 + b**2 / 3)
    assert welch.statistic == pytest.approx(0.25 / (a + b) ** 0.5)
    assert welch.degrees_of_freedom == pytest.approx(freedom)
    assert welch.p == pytest.approx(2 * stats.t.sf(welch.statistic, freedom))


def test_mann_whitney_counts_the_pairs_in_which_the_first_is_larger() -> None:
    *_, mann_whitney = compare(FIRST, SECOND)

    u = sum(float(x > y) + 0.5 * float(x == y) for x in FIRST for y in SECOND)
    assert mann_whitney.statistic == u


def test_cohens_d_is_the_difference_over_the_pooled_deviation() -> None:
    assert effect_size(FIRST, SECOND) == pytest.approx(0.25 / (0.15 / 7) ** 0.5)


def test_equal_values_have_no_effect_size_though_their_variance_is_rounded() -> None:
    constant = np.full(3, 0.1)
    assert constant.var(ddof=1) > 0

    assert effect_size(constant, np.full(3, 0.3)) is None


@pytest.mark.parametrize("values", [[1e200, -1e200, 1e200], [1e308, 1e308, -1e308], [0.0, 1e-200, 0.0]])
def test_what_cannot_be_squared_has_no_test_and_is_no_error(values: Any) -> None:
    (found,) = compare_all({"large": np.array(values)[:, None], "constant": np.zeros((3, 1))}, frozenset(), 0, 0)

    assert found.student.p is None or 0 <= found.student.p <= 1
    assert found.mann_whitney.p is not None
    assert found.effect_size is None


@pytest.mark.parametrize(
    ("first", "second"),
    [
        (np.array([1.0]), SECOND),
        (np.array([]), SECOND),
        (np.array([np.nan, 1.0]), SECOND),
        (np.ones(4), np.ones(5)),
    ],
)
def test_what_has_no_test_has_none_rather_than_nan(first: Any, second: Any) -> None:
    assert [test.p for test in compare(first, second)] == [None, None, None]


def test_two_constant_groups_that_differ_have_only_the_rank_test() -> None:
    student, welch, mann_whitney = compare(np.ones(5), np.zeros(5))

    assert student.p is None
    assert welch.p is None
    assert mann_whitney.p < 0.05


def test_nan_counts_for_nothing() -> None:
    with_nan = np.append(FIRST, np.nan)

    assert compare(with_nan, SECOND) == compare(FIRST, SECOND)


def test_holm_multiplies_the_smallest_p_by_all_and_never_lets_a_larger_one_overtake() -> None:
    # Holm 1979 by hand: 0.01·4 = 0.04, 0.02·3 = 0.06, 0.03·2 = 0.06, 0.9·1
    assert holm([0.9, 0.01, 0.03, 0.02]) == pytest.approx((0.9, 0.04, 0.06, 0.06))


def test_an_undefined_test_is_not_of_the_family() -> None:
    assert holm([0.01, None, 0.02]) == pytest.approx((0.02, None, 0.02))


@given(st.lists(st.floats(0, 1), min_size=1, max_size=20))
def test_a_corrected_p_is_never_smaller_and_keeps_the_order(p_values: Any) -> None:
    corrected = holm(p_values)

    assert all(after >= before for after, before in zip(corrected, p_values, strict=True))
    assert all(0 <= each <= 1 for each in corrected)
    order = np.argsort(p_values, kind="stable")
    assert list(np.array(corrected)[order]) == sorted(corrected)


def test_counts_are_pooled_over_the_range_and_the_baseline_has_but_one() -> None:
    recorded = {
        "fit": np.array([[0.9, 1.2, 1.3, 1.4], [0.8, 1.1, 1.3, 1.5]]),
        "random": np.array([[0.7, 0.8, np.nan, 1.0], [0.9, 0.9, 1.0, 1.1]]),
        "direct": np.array([[1.3], [1.4], [1.35]]),
    }

    fit_random, fit_direct, random_direct = compare_all(recorded, frozenset({"direct"}), 2, 3)

    assert (fit_random.n_first, fit_random.n_second) == (4, 3)
    assert (fit_direct.n_second, random_direct.n_second) == (3, 3)
    assert fit_random.difference == pytest.approx(np.mean([1.3, 1.4, 1.3, 1.5]) - np.mean([1.0, 1.0, 1.1]))
    p_values = [each.student.p for each in (fit_random, fit_direct, random_direct)]
    assert [each.student.p_holm for each in (fit_random, fit_direct, random_direct)] == list(holm(p_values))


def test_one_experiment_alone_has_nothing_to_be_compared_with() -> None:
    assert compare_all({"fit": np.ones((3, 2))}, frozenset(), 0, 1) == ()
