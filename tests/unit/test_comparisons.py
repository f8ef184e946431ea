"""Pairs of experiments: one value for each repetition, shared random streams, intervals, and equivalence."""

from functools import partial
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.random import default_rng
from scipy import stats

from gaplab.schemas.comparisons import (
    COLUMNS,
    PAIRED,
    TESTS,
    TEXTS,
    EquivalenceVerdict,
    Estimate,
    Found,
    row,
    shown_tests,
)
from gaplab.services.findings.comparisons import (
    Compared,
    compare_all,
    difference_interval,
    equivalence_p,
    found_by,
    shares_streams,
)
from gaplab.services.findings.statistics import holm, improvement, summary
from gaplab.services.specs.assembly import setting
from gaplab.services.specs.resolution import resolve_experiment
from tests.experiments import toy

RECORDED = {
    "fit": np.array([[0.9, 1.2, 1.3, 1.4], [0.8, 1.1, 1.3, 1.5]]),
    "random": np.array([[0.7, 0.8, np.nan, 1.0], [0.9, 0.9, 1.0, 1.1], [0.5, 0.6, 0.8, 1.3]]),
    "direct": np.array([[1.3], [1.4], [1.35]]),
}


def compared(name: str, recorded: Any, seed: int = 0, strategy: str | None = None) -> Compared:
    """An experiment; its strategy is its name unless it is given."""
    return Compared(name, name, np.asarray(recorded, dtype=float), name == "direct", seed, strategy or name)


def drawn(mean: float, n: int = 40, seed: int = 1, sd: float = 0.1) -> Any:
    return default_rng(seed).normal(mean, sd, (n, 1))


def three() -> list[Compared]:
    return [compared(name, recorded) for name, recorded in RECORDED.items()]


def test_each_repetition_is_one_value_its_mean_over_the_range() -> None:
    fit_random, fit_direct, random_direct = compare_all(three(), 2, 3)

    assert (fit_random.n_first, fit_random.n_second) == (2, 2)  # a repetition of random lacks number 2
    assert fit_random.difference == pytest.approx(np.mean([1.35, 1.4]) - np.mean([1.05, 1.05]))
    assert fit_direct.student.p == pytest.approx(stats.ttest_ind([1.35, 1.4], [1.3, 1.4, 1.35]).pvalue)
    pairs = (fit_random, fit_direct, random_direct)
    assert [pair.student.p_holm for pair in pairs] == list(holm([pair.student.p for pair in pairs]))


def test_the_papers_pooled_tests_stand_beside_with_their_flaw() -> None:
    fit_random, fit_direct, _ = compare_all(three(), 2, 3)

    assert fit_random.pooled is not None
    assert fit_direct.pooled is not None
    assert (fit_random.pooled.n_first, fit_random.pooled.n_second) == (4, 5)
    assert (fit_direct.pooled.n_first, fit_direct.pooled.n_second) == (4, 3)
    assert fit_direct.pooled.student.p == stats.ttest_ind([1.3, 1.4, 1.3, 1.5], [1.3, 1.4, 1.35]).pvalue
    assert fit_direct.pooled.student.p_holm is not None
    assert "not independent" in fit_direct.pooled.caution


def test_a_single_number_is_compared_as_it_is_recorded() -> None:
    pair, *_ = compare_all(three(), 3, 3)

    assert pair.pooled is None
    assert pair.caution is None
    assert pair.student.p == stats.ttest_ind([1.4, 1.5], [1.0, 1.1, 1.3]).pvalue


def test_a_range_beyond_an_experiment_leaves_its_repetitions_out() -> None:
    pair, *_ = compare_all(three(), 2, 4)

    assert (pair.n_first, pair.student.p, pair.trusted.p) == (0, None, None)


def test_experiments_of_one_seed_and_strategy_draw_the_same_numbers_and_no_others_do() -> None:
    specs = [
        toy(),
        toy(budget={"controller_evaluations": 40}),
        toy(seed=1),
        toy(strategy="random"),
    ]
    resolved = [resolve_experiment(spec) for spec in specs]
    drawn_ = [setting(spec, 2).stream(1, "tune").random() for spec in resolved]
    experiments = [
        Compared(str(number), "", np.ones((1, 1)), False, spec.seed, spec.strategy.name)
        for number, spec in enumerate(resolved)
    ]

    for one, other in np.ndindex(4, 4):
        assert shares_streams(experiments[one], experiments[other]) == (drawn_[one] == drawn_[other])
    assert shares_streams(experiments[0], experiments[1])


def test_a_pair_that_shares_streams_is_judged_by_the_paired_test() -> None:
    noise, change = drawn(1.0, sd=0.3), drawn(0.05, seed=2, sd=0.02)
    one, other = compared("fit", noise), compared("fit, more", noise + change, strategy="fit")
    elsewhere = compared("fit, seed 1", noise + change, seed=1, strategy="fit")

    shared, independent, _ = compare_all([one, other, elsewhere], 0, 0)

    assert shared.shared_streams
    assert "seed 0 and the strategy fit" in shared.streams
    assert "trust the paired tests" in str(shared.caution)
    assert (shared.trusted.test, shared.trusted.p, shared.n_paired) == ("paired_t", shared.paired_t.p, 40)
    assert shared.paired_t.p == pytest.approx(stats.ttest_rel(noise[:, 0], (noise + change)[:, 0]).pvalue)
    assert shared.wilcoxon.p is not None
    assert shared.student.p is not None
    assert shared.student.p > 0.05 > shared.trusted.p_holm
    assert (independent.trusted.test, independent.trusted.p) == ("welch", independent.welch.p)
    assert "different seeds" in independent.streams
    assert (independent.paired_t.p, independent.n_paired, independent.caution) == (None, 0, None)


def test_a_difference_of_pairs_is_in_the_middle_of_its_interval_whatever_else_was_computed() -> None:
    noise, change = drawn(1.0, sd=0.3), drawn(0.05, seed=2, sd=0.02)
    one, other = compared("fit", noise), compared("fit, more", (noise + change)[:10], strategy="fit")

    (pair,) = compare_all([one, other], 0, 0)

    assert pair.lower is not None
    assert pair.upper is not None
    assert pair.difference == pytest.approx((pair.lower + pair.upper) / 2)
    assert pair.difference == pytest.approx(-change[:10].mean())


def test_the_trusted_tests_of_all_pairs_are_one_family() -> None:
    experiments = [
        compared("a", drawn(1.0)),
        compared("b", drawn(1.1, seed=2), strategy="a"),
        compared("c", drawn(1.2, seed=3)),
    ]

    pairs = compare_all(experiments, 0, 0)

    assert [pair.trusted.test for pair in pairs] == ["paired_t", "welch", "welch"]
    assert [pair.trusted.p_holm for pair in pairs] == list(holm([pair.trusted.p for pair in pairs]))


@pytest.mark.parametrize(
    ("second", "margin", "verdict"),
    [
        (1.0, 0.1, EquivalenceVerdict.EQUIVALENT),
        (1.3, 0.1, EquivalenceVerdict.DIFFERENT),
        (1.0, 0.001, EquivalenceVerdict.UNDECIDED),
    ],
)
def test_equivalence_is_a_claim_of_its_own(second: float, margin: float, verdict: EquivalenceVerdict) -> None:
    experiments = [compared("a", drawn(1.0)), compared("b", drawn(second, seed=2))]

    (pair,) = compare_all(experiments, 0, 0, margin=margin)

    assert pair.equivalence is not None
    assert (pair.equivalence.margin, pair.equivalence.test, pair.equivalence.verdict) == (margin, "welch", verdict)
    assert verdict.value in pair.equivalence.words
    inside = -margin < (pair.lower or 0) and (pair.upper or 0) < margin
    assert inside == (verdict is EquivalenceVerdict.EQUIVALENT)


def test_a_small_difference_may_be_real_and_yet_within_the_margin() -> None:
    (pair,) = compare_all([compared("a", drawn(1.0)), compared("b", drawn(1.1, seed=2))], 0, 0, margin=1.0)

    assert pair.equivalence is not None
    assert pair.equivalence.verdict is EquivalenceVerdict.EQUIVALENT
    assert "though different" in pair.equivalence.words


@pytest.mark.parametrize("values", [[[1.0]], [[1.0], [1.0]], [[np.nan], [np.nan], [1.0]], np.empty((0, 1))])
def test_too_few_values_that_vary_leave_equivalence_undecided_and_intervals_unknown(values: Any) -> None:
    for strategy in ("a", "b"):
        experiments = [compared("a", values, strategy="a"), compared("b", values, strategy=strategy)]

        (pair,) = compare_all(experiments, 0, 0, margin=0.5)

        assert pair.equivalence is not None
        assert (pair.equivalence.p, pair.equivalence.verdict) == (None, EquivalenceVerdict.UNDECIDED)
        assert (pair.lower, pair.improvement.lower, pair.summary_first.mean.lower) == (None, None, None)
        assert pair.trusted.p is None


@given(st.integers(0, 99), st.integers(2, 12), st.integers(2, 12), st.floats(0.001, 3))
@settings(max_examples=30)
def test_equivalence_agrees_with_the_interval_of_the_difference(seed: int, n: int, m: int, margin: float) -> None:
    random = default_rng(seed)
    first, second = random.normal(0, 1, n), random.normal(0.2, 2, m)

    for paired in (False, True):
        p = equivalence_p(first, second, margin, paired=paired)
        lower, upper = difference_interval(first, second, paired=paired)
        assert p is not None
        assert lower is not None
        assert upper is not None
        assert (p < 0.05) == (-margin < lower and upper < margin)


def test_the_interval_of_a_mean_is_students_and_that_of_the_interquartile_mean_is_resampled() -> None:
    values = drawn(1.0)[:, 0]

    found = summary(values, intervals=True)

    student = stats.t.interval(0.95, len(values) - 1, values.mean(), stats.sem(values))
    middle = partial(stats.trim_mean, proportiontocut=0.25)
    again = stats.bootstrap((values,), middle, n_resamples=20_000, method="percentile", rng=default_rng(5))
    assert found.mean.value == pytest.approx(values.mean())
    assert (found.mean.lower, found.mean.upper) == pytest.approx(student)
    assert found.interquartile_mean.value == pytest.approx(np.sort(values)[10:30].mean())
    assert found.interquartile_mean.lower == pytest.approx(again.confidence_interval.low, abs=0.005)
    assert found.interquartile_mean.upper == pytest.approx(again.confidence_interval.high, abs=0.005)
    assert summary(values, intervals=False).mean.lower is None


@pytest.mark.parametrize("paired", [False, True])
def test_the_probability_of_improvement_is_resampled_as_scipy_does(paired: bool) -> None:
    first, second = np.round(drawn(1.05)[:, 0], 1), np.round(drawn(1.0, seed=2)[:, 0], 1)

    def share(one: Any, other: Any, axis: int) -> Any:
        return (np.sign(one[..., :, None] - other[..., None, :]) / 2 + 0.5).mean(axis=(-1, -2))

    found = improvement(first, second, paired=paired, intervals=True)

    data = first, second
    again = stats.bootstrap(
        data, share, n_resamples=5_000, paired=paired, vectorized=True, method="percentile", rng=default_rng(5)
    ).confidence_interval
    assert found.value == pytest.approx(share(*data, axis=-1))
    assert (found.lower, found.upper) == pytest.approx((again.low, again.high), abs=0.01)
    assert improvement(first, second, paired=paired, intervals=True) == found  # numbers that reproduce


def test_resamples_that_all_agree_give_no_interval_rather_than_certainty() -> None:
    apart = improvement(np.arange(5.0), np.arange(5.0) + 10, paired=False, intervals=True)

    assert (apart.value, apart.lower, apart.upper) == (0.0, None, None)
    assert summary(np.ones(5), intervals=True).mean == Estimate(value=1.0, text="1")


values_ = st.lists(st.floats(allow_infinity=False, width=32) | st.just(0.5), max_size=6).map(
    lambda found: np.array(found, dtype=float)[:, None]
)


VARIES = np.array([[0.5], [0.25]])
"""A variation that adding 10¹⁴ rounds away."""


@given(values_, values_, st.booleans(), st.sampled_from([0.1, 1e14]))
@example(VARIES, np.array([[1.125e14], [1.125e14]]), False, 0.1)
@example(VARIES, np.array([[1.125e14], [1.126e14]]), False, 1e14)
@settings(max_examples=30)
def test_any_values_have_a_comparison_of_finite_numbers(first: Any, second: Any, shared: bool, margin: float) -> None:
    experiments = [compared("a", first), compared("b", second, strategy="a" if shared else "b")]

    (pair,) = compare_all(experiments, 0, 0, margin=margin)

    assert len(row(pair)) == len(COLUMNS) == len(set(COLUMNS))
    numbers = dict(zip(COLUMNS, row(pair), strict=True))
    for name in set(COLUMNS) - TEXTS - {"shared_streams"}:
        value = numbers[name]
        assert value is None or (isinstance(value, int | float) and np.isfinite(value))
    assert TEXTS | {"shared_streams"} < set(COLUMNS)


def test_one_experiment_alone_has_nothing_to_be_compared_with() -> None:
    assert compare_all([compared("fit", np.ones((3, 2)))], 0, 1) == ()


def test_paired_tests_are_shown_only_of_pairs_that_share_their_streams() -> None:
    alone = compare_all([compared("a", drawn(1.0)), compared("b", drawn(1.1))], 0, 0, intervals=False)
    sharing = compare_all(
        [compared(name, drawn(1.0), strategy="fit") for name in ("a", "b")] + [compared("c", drawn(1.1))],
        *(0, 0),
        intervals=False,
    )

    assert set(TESTS) - set(shown_tests(alone)) == set(PAIRED)
    assert shown_tests(sharing) == TESTS


@pytest.mark.parametrize(
    ("test", "p_holm", "shared", "found"),
    [
        ("welch", 0.01, False, Found.HIGHER),
        ("welch", 0.05, False, Found.OPEN),
        ("welch", None, False, Found.UNDEFINED),
        ("paired_t", 0.01, False, Found.UNPAIRED),
        ("paired_t", 0.01, True, Found.HIGHER),
        ("brown_forsythe", 0.01, False, Found.NARROWER),
    ],
)
def test_a_pair_differs_below_a_level_and_the_first_is_higher_or_narrower(
    test: str, p_holm: float | None, shared: bool, found: Found
) -> None:
    experiments = [
        compared("a", drawn(1.3)),
        compared("b", drawn(1.0, seed=2, sd=0.2), strategy="a" if shared else "b"),
    ]
    (pair,) = compare_all(experiments, 0, 0, intervals=False)

    assert found_by(pair, pair, test, p_holm) is found
    assert pair.differs
    assert pair.trusted.found is pair.welch.found or shared


def test_tests_and_sizes_are_written_once() -> None:
    (pair,) = compare_all([compared("a", drawn(1.3)), compared("b", drawn(1.0, seed=2))], 0, 0, margin=1.0)

    assert pair.welch.text == pair.trusted.text == "< 0.001 (raw < 0.001)"
    assert pair.difference_text.startswith("+0.")
    assert pair.sizes == "40, 40"
    assert pair.equivalence is not None
    assert (
        pair.equivalence.words
        == "equivalent within ±1 (p < 0.001, raw < 0.001), though different (p < 0.001, raw < 0.001)"
    )
