"""Equivalence: two one-sided tests of whether the means of two groups differ by less than a margin.

Source: Schuirmann 1987, A comparison of the two one-sided tests procedure and the power approach.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import scipy

from gaplab.schemas.comparisons import Comparison, Equivalence, EquivalenceVerdict, Trusted
from gaplab.services.core.arrays import FloatArray, known
from gaplab.services.core.statistics import both, constant_difference, finite, holm, moved, varies

CONFIDENCE = 0.9
"""Level of the interval that lies within ±margin exactly if both tests have p below 0.05."""

SIGNIFICANT = 0.05


@np.errstate(over="ignore", invalid="ignore")
def difference_interval(first: FloatArray, second: FloatArray, *, paired: bool) -> tuple[float | None, float | None]:
    """Return the 90 % interval of the difference of the means, by Welch's or the paired t; None if undefined.

    Args:
        first: `(r,)` by repetition; nan is missing.
        second: `(s,)` by repetition; nan is missing.
        paired: whether the values of one repetition belong together.
    """
    result = _one_test(first, second, 0.0, "two-sided", paired=paired)
    if result is None:
        return None, None
    ends = result.confidence_interval(CONFIDENCE)
    lower, upper = known(ends.low), known(ends.high)
    return (None, None) if lower is None or upper is None else (lower, upper)


@np.errstate(over="ignore", invalid="ignore")
def equivalence_p(first: FloatArray, second: FloatArray, margin: float, *, paired: bool) -> float | None:
    """Return p of the hypothesis that the means differ by `margin` or more, either way; None if undefined.

    The margin is above 0, in the unit of the values; the other arguments are as of `difference_interval`.
    """
    above = _one_test(first, second, margin, "greater", paired=paired)
    below = _one_test(first, second, -margin, "less", paired=paired)
    if above is None or below is None:
        return None
    return known(np.maximum(above.pvalue, below.pvalue))


def equivalent(pairs: Sequence[Comparison], values: Mapping[str, FloatArray], margin: float) -> tuple[Comparison, ...]:
    """Return pairs with the verdict on their equivalence; Holm's correction is over all pairs.

    Args:
        pairs: pairs with their trusted tests.
        values: values `(r,)` by repetition, by experiment; nan is missing.
        margin: above 0, in the unit of the values.
    """
    p_values = [
        equivalence_p(values[pair.first], values[pair.second], margin, paired=pair.shared_streams) for pair in pairs
    ]
    return tuple(
        pair.model_copy(update={"equivalence": _equivalence(pair, margin, p, p_holm)})
        for pair, p, p_holm in zip(pairs, p_values, holm(p_values), strict=True)
    )


def _equivalence(pair: Comparison, margin: float, p: float | None, p_holm: float | None) -> Equivalence:
    verdict, words = _verdict(pair.trusted, margin, p, p_holm)
    test = "paired_t" if pair.shared_streams else "welch"
    return Equivalence(margin=margin, test=test, p=p, p_holm=p_holm, verdict=verdict, words=words)


def _verdict(trusted: Trusted, margin: float, p: float | None, p_holm: float | None) -> tuple[EquivalenceVerdict, str]:
    within = f"within ±{margin:.3g}"
    differs = trusted.p_holm is not None and trusted.p_holm < SIGNIFICANT
    if p_holm is not None and p_holm < SIGNIFICANT:
        also = f", though different ({_both(trusted.p, trusted.p_holm)})" if differs else ""
        return EquivalenceVerdict.EQUIVALENT, f"equivalent {within} ({_both(p, p_holm)}){also}"
    if differs:
        return EquivalenceVerdict.DIFFERENT, f"different ({_both(trusted.p, trusted.p_holm)})"
    why = "too few values that vary" if p_holm is None else _both(p, p_holm)
    return EquivalenceVerdict.UNDECIDED, f"undecided: not shown to differ, nor to be equivalent {within} ({why})"


def _both(p: float | None, p_holm: float | None) -> str:
    return f"p = {p:.2g}, after Holm {p_holm:.2g}"


def _one_test(first: FloatArray, second: FloatArray, shift: float, alternative: str, *, paired: bool) -> Any | None:  # noqa: ANN401 - scipy has no stubs
    """Return the test of a difference of the means plus `shift`; None if nothing varies."""
    first, second = both(first, second) if paired else (finite(first), finite(second))
    if min(len(first), len(second)) < 2:
        return None
    if paired:
        fixed = constant_difference(first, second)
        return None if fixed else scipy.stats.ttest_1samp(first - second, -shift, alternative=alternative)
    if not varies(first, second, shift):
        return None
    return scipy.stats.ttest_ind(*moved(first, second, shift), equal_var=False, alternative=alternative)
