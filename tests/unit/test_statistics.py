"""The paper's t-tests and their companions, against formulas written out and scipy's own."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from gaplab.services.findings.statistics import brown_forsythe, compare, compare_paired, effect_size, holm

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
    large, constant = np.array(values), np.zeros(3)
    student, _, mann_whitney = compare(large, constant)

    assert student.p is None or 0 <= student.p <= 1
    assert mann_whitney.p is not None
    assert effect_size(large, constant) is None
    assert all(test.p is None or 0 <= test.p <= 1 for test in compare_paired(large, constant))
    assert (spread := brown_forsythe(large, constant).p) is None or 0 <= spread <= 1


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


def test_one_constant_group_is_tested_without_a_warning_about_lost_precision() -> None:
    student, welch, _ = compare(np.full(5, 1.1), SECOND)

    assert student.statistic == pytest.approx(0.05 / (0.05 / 7 * (1 / 5 + 1 / 4)) ** 0.5)
    assert welch.degrees_of_freedom == pytest.approx(3)


def test_paired_tests_compare_repetitions_of_one_number() -> None:
    first, second = np.array([1.0, 1.4, np.nan, 1.3, 1.2]), np.array([0.9, 1.1, 1.0, 1.1])

    paired_t, wilcoxon = compare_paired(first, second)

    assert paired_t.p == pytest.approx(stats.ttest_rel([1.0, 1.4, 1.3], [0.9, 1.1, 1.1]).pvalue)
    assert paired_t.degrees_of_freedom == 2
    assert wilcoxon.p == stats.wilcoxon([1.0, 1.4, 1.3], [0.9, 1.1, 1.1]).pvalue


def test_a_difference_that_is_always_the_same_has_only_the_rank_test_and_none_has_neither() -> None:
    shifted, same = compare_paired(FIRST, FIRST - 0.1), compare_paired(FIRST, FIRST)

    assert shifted[0].p is None  # though the rounded differences vary
    assert shifted[1].p == pytest.approx(2 / 2**5)
    assert [test.p for test in same] == [None, None]
    assert [test.p for test in compare_paired(FIRST[:1], SECOND[:1])] == [None, None]


def test_brown_forsythe_is_levenes_test_with_the_median() -> None:
    wide = 5 * FIRST

    assert brown_forsythe(np.append(wide, np.nan), SECOND).p == stats.levene(wide, SECOND, center="median").pvalue
    assert brown_forsythe(np.ones(5), np.zeros(5)).p is None
    assert brown_forsythe(FIRST[:2], SECOND[:2]).p is None  # the distances of two values from their median are equal


numbers = st.lists(st.floats(-1e9, 1e9) | st.just(np.nan) | st.just(0.5), max_size=12).map(np.array)


@given(numbers, numbers)
def test_every_test_of_any_values_is_a_probability_or_undefined(first: Any, second: Any) -> None:
    first, second = first.astype(float), second.astype(float)

    for test in (*compare(first, second), *compare_paired(first, second), brown_forsythe(first, second)):
        assert (test.p is None) == (test.statistic is None)
        assert test.p is None or 0 <= test.p <= 1
