"""All pairs of experiments, compared at one number of real-world evaluations or over a range of them.

Each repetition is one value: its mean over the range. The paper pools the recorded fitnesses of several numbers into
one sample instead ("combining the data for more than two real-world evaluations"). Values of one repetition at several
numbers are not independent, so a pooled p is too small. The pooled tests are given too, since the paper reports them.

Random streams have the address (seed, strategy's name, repetition, …). Two experiments of one seed and one strategy
therefore draw the same numbers in repetitions of one number, and their values may be correlated. Their pair is judged
by the paired t-test, which is valid whatever the correlation is. All other pairs are judged by Welch's t: strategies
vary unequally and baselines have more repetitions, and then Student's p, which the paper has, is wrong.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any, TypeVar

import numpy as np
import scipy

from gaplab.schemas.comparisons import (
    PAIRED,
    TESTS,
    UNPAIRED,
    Comparison,
    Equivalence,
    EquivalenceVerdict,
    Found,
    Groups,
    Pooled,
    Summary,
    Test,
    Trusted,
)
from gaplab.services.core.arrays import FloatArray, known
from gaplab.services.findings import sentences
from gaplab.services.findings.statistics import (
    SIGNIFICANT,
    UNDEFINED,
    both,
    brown_forsythe,
    compare,
    compare_paired,
    constant_difference,
    corrected,
    effect_size,
    finite,
    holm,
    improvement,
    moved,
    summary,
    varies,
)
from gaplab.services.findings.wording import bracketed, probabilities, signed

CONFIDENCE = 0.9
"""Level of the interval that lies within ±margin exactly if both tests of equivalence have p below 0.05."""

G = TypeVar("G", bound=Groups)


@dataclass(frozen=True, eq=False)
class Compared:
    """One experiment, as it is compared.

    Attributes:
        recorded: recorded fitness `(r, k)` by repetition and number of real-world evaluations; nan is missing.
        level: whether its only column, at 0, counts at every number of real-world evaluations.
        seed: seed of its random streams.
        strategy: name of its strategy, which is in the address of its random streams.
    """

    id: str
    name: str
    recorded: FloatArray
    level: bool
    seed: int
    strategy: str

    def after(self, count: int | None) -> "Compared":
        """Return its values after one number of real-world evaluations, as a level; all are nan for None."""
        missing = np.full((len(self.recorded), 1), np.nan)
        return replace(self, recorded=missing if count is None else self.recorded[:, [count]], level=True)


@dataclass(frozen=True)
class Range:
    """Numbers of real-world evaluations, from `first` to `last`."""

    first: int
    last: int

    @np.errstate(over="ignore", invalid="ignore")
    def values(self, one: Compared) -> FloatArray:
        """Return the mean of each repetition over the range, `(r,)`; nan if its fitness is missing anywhere in it."""
        complete = one.level or self.last < one.recorded.shape[1]
        return self._columns(one).mean(axis=1) if complete else np.full(len(one.recorded), np.nan)

    def pooled(self, one: Compared) -> FloatArray:
        """Return the values at all numbers of the range as one group."""
        return finite(self._columns(one))

    def _columns(self, one: Compared) -> FloatArray:
        return one.recorded[:, :1] if one.level else one.recorded[:, self.first : self.last + 1]


def shares_streams(one: Compared, other: Compared) -> bool:
    """Return whether repetitions of one number draw the same random numbers in both experiments."""
    return (one.seed, one.strategy) == (other.seed, other.strategy)


def compare_all(
    experiments: Sequence[Compared],
    first: int,
    last: int,
    *,
    margin: float | None = None,
    intervals: bool = True,
) -> tuple[Comparison, ...]:
    """Compare every pair of experiments from a first to a last number of real-world evaluations, in their order.

    Holm's correction is over all pairs, test by test. `margin` is the difference in the unit of fitness within which
    two experiments are equivalent; None: not tested.
    """
    over = Range(first, last)
    values = {one.id: over.values(one) for one in experiments}
    summaries = {id_: summary(each, intervals=intervals) for id_, each in values.items()}
    pairs = [
        _compared(one, other, over, (summaries[one.id], summaries[other.id]), intervals=intervals)
        for one, other in combinations(experiments, 2)
    ]
    pooled = _corrected([pair.pooled for pair in pairs if pair.pooled], UNPAIRED)
    if pooled:
        pairs = [pair.model_copy(update={"pooled": each}) for pair, each in zip(pairs, pooled, strict=True)]
    pairs = _judged(_corrected(pairs, TESTS))
    return tuple(pairs) if margin is None else _equivalent(pairs, values, margin)


@np.errstate(over="ignore", invalid="ignore")
def difference_interval(first: FloatArray, second: FloatArray, *, paired: bool) -> tuple[float | None, float | None]:
    """Return the 90 % interval of the difference of the means, by Welch's or the paired t; None if undefined.

    Values `(r,)` and `(s,)` are by repetition; nan is missing. If paired, the values of one repetition belong together.
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

    Two one-sided tests. The margin is above 0, in the unit of the values; the other arguments are as of
    `difference_interval`.

    Source: Schuirmann 1987, A comparison of the two one-sided tests procedure and the power approach.
    """
    above = _one_test(first, second, margin, "greater", paired=paired)
    below = _one_test(first, second, -margin, "less", paired=paired)
    if above is None or below is None:
        return None
    return known(np.maximum(above.pvalue, below.pvalue))


def _compared(
    one: Compared, other: Compared, over: Range, summaries: tuple[Summary, Summary], *, intervals: bool
) -> Comparison:
    """Return the uncorrected tests of a pair."""
    first, second = over.values(one), over.values(other)
    shared = shares_streams(one, other)
    paired_t, wilcoxon = compare_paired(first, second) if shared else (UNDEFINED, UNDEFINED)
    groups = _groups(finite(first), finite(second))
    if shared:
        groups |= _sizes(*both(first, second)) | {"sizes": f"{len(both(first, second)[0])}"}
    lower, upper = difference_interval(first, second, paired=shared)
    groups["difference_text"] += bracketed(lower, upper)
    pooled = None
    if over.first < over.last:
        pooled = Pooled(caution=sentences.POOLED, **_groups(over.pooled(one), over.pooled(other)))
    streams = sentences.streams((one.seed, one.strategy), (other.seed, other.strategy))
    return Comparison(
        first=one.id,
        first_name=one.name,
        second=other.id,
        second_name=other.name,
        from_evaluations=over.first,
        to_evaluations=over.last,
        **groups,
        caution=f"{streams}; trust the paired tests" if shared else None,
        lower=lower,
        upper=upper,
        improvement=improvement(first, second, paired=shared, intervals=intervals),
        shared_streams=shared,
        streams=streams,
        trusted=Trusted(test="paired_t" if shared else "welch"),
        n_paired=len(both(first, second)[0]) if shared else 0,
        paired_t=paired_t,
        wilcoxon=wilcoxon,
        brown_forsythe=brown_forsythe(first, second),
        summary_first=summaries[0],
        summary_second=summaries[1],
        pooled=pooled,
    )


def _groups(first: FloatArray, second: FloatArray) -> dict[str, Any]:
    student, welch, mann_whitney = compare(first, second)
    return {
        "n_first": len(first),
        "n_second": len(second),
        "sizes": f"{len(first)}, {len(second)}",
        **_sizes(first, second),
        "student": student,
        "welch": welch,
        "mann_whitney": mann_whitney,
    }


def _sizes(first: FloatArray, second: FloatArray) -> dict[str, Any]:
    difference, effect = _difference(first, second), effect_size(first, second)
    texts = {"difference_text": signed(difference), "effect_size_text": signed(effect)}
    return {"difference": difference, "effect_size": effect, **texts}


def _corrected(pairs: Sequence[G], names: Sequence[str]) -> list[G]:
    columns = zip(*(corrected([getattr(pair, name) for pair in pairs]) for name in names), strict=True)
    return [
        pair.model_copy(update=dict(zip(names, tests, strict=True))) for pair, tests in zip(pairs, columns, strict=True)
    ]


def _judged(pairs: Sequence[Comparison]) -> list[Comparison]:
    """Return pairs whose tests say what they have found; trusted ones are corrected over those of all pairs."""
    p_values: list[float | None] = [getattr(pair, pair.trusted.test).p for pair in pairs]
    return [_with_verdicts(pair, p, p_holm) for pair, p, p_holm in zip(pairs, p_values, holm(p_values), strict=True)]


def _with_verdicts(pair: Comparison, p: float | None, p_holm: float | None) -> Comparison:
    found = {"found": found_by(pair, pair, pair.trusted.test, p_holm)}
    trusted = pair.trusted.model_copy(update={"p": p, "p_holm": p_holm, "text": probabilities(p, p_holm)} | found)
    pooled = pair.pooled and pair.pooled.model_copy(update=_verdicts(pair, pair.pooled, UNPAIRED))
    return pair.model_copy(update={"trusted": trusted, "pooled": pooled} | _verdicts(pair, pair, TESTS))


def _verdicts(pair: Comparison, groups: Groups, names: Sequence[str]) -> dict[str, Test]:
    tests: dict[str, Test] = {name: getattr(groups, name) for name in names}
    found = {name: found_by(pair, groups, name, test.p_holm) for name, test in tests.items()}
    return {name: test.model_copy(update={"found": found[name]}) for name, test in tests.items()}


def found_by(pair: Comparison, groups: Groups, test: str, p_holm: float | None) -> Found:
    """Return what a test found of the first group: higher, lower, wider, narrower, or not shown to differ."""
    if test in PAIRED and not pair.shared_streams:
        return Found.UNPAIRED
    if p_holm is None:
        return Found.UNDEFINED
    if p_holm >= SIGNIFICANT:
        return Found.OPEN
    if test == "brown_forsythe":
        return Found.WIDER if (pair.summary_first.sd or 0.0) > (pair.summary_second.sd or 0.0) else Found.NARROWER
    return Found.HIGHER if (groups.difference or 0.0) > 0 else Found.LOWER


def _equivalent(pairs: Sequence[Comparison], values: Mapping[str, FloatArray], margin: float) -> tuple[Comparison, ...]:
    """Return pairs with the verdict on their equivalence; Holm's correction is over all pairs."""
    p_values = [
        equivalence_p(values[pair.first], values[pair.second], margin, paired=pair.shared_streams) for pair in pairs
    ]
    return tuple(
        pair.model_copy(update={"equivalence": _equivalence(pair, margin, p, p_holm)})
        for pair, p, p_holm in zip(pairs, p_values, holm(p_values), strict=True)
    )


def _equivalence(pair: Comparison, margin: float, p: float | None, p_holm: float | None) -> Equivalence:
    if p_holm is not None and p_holm < SIGNIFICANT:
        verdict = EquivalenceVerdict.EQUIVALENT
    else:
        verdict = EquivalenceVerdict.DIFFERENT if pair.differs else EquivalenceVerdict.UNDECIDED
    words = sentences.equivalence(pair, verdict, margin, (p, p_holm))
    return Equivalence(margin=margin, test=pair.trusted.test, p=p, p_holm=p_holm, verdict=verdict, words=words)


@np.errstate(over="ignore", invalid="ignore")
def _difference(first: FloatArray, second: FloatArray) -> float | None:
    return known(first.mean() - second.mean()) if len(first) and len(second) else None


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
