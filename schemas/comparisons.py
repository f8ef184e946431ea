"""Two experiments, compared: tests, intervals, and equivalence within a margin; and the columns of a table of pairs."""

from collections.abc import Sequence
from enum import StrEnum
from typing import Literal

from pydantic import Field

from gaplab.schemas.base import Frozen, Id, Name, Read, Statistic, Unit
from gaplab.schemas.curves import Fitness


class Found(StrEnum):
    """What a test says of the first of a pair. `n. s.`: not shown to differ, which does not show that it is equal."""

    HIGHER = "higher"
    LOWER = "lower"
    WIDER = "wider"
    NARROWER = "narrower"
    OPEN = "n. s."
    UNDEFINED = "too few values that vary"
    UNPAIRED = "not paired"


class PValue(Frozen):
    """A p-value, and what it says of a pair."""

    p: Statistic = Field(None, description="two-sided p-value, uncorrected; null if undefined")
    p_holm: Statistic = Field(None, description="p-value with Holm's correction over all pairs")
    found: Found = Field(
        Found.UNDEFINED,
        description="what it says of the first of the pair: its mean is higher or lower, or its spread wider or "
        "narrower, if p_holm is below 0.05",
    )
    text: str = Field("", description="p with Holm's correction, and the uncorrected p", examples=["0.012 (raw 0.004)"])

    @property
    def differs(self) -> bool:
        """Whether it says that the two of the pair differ."""
        return self.found in {Found.HIGHER, Found.LOWER, Found.WIDER, Found.NARROWER}


class Test(PValue):
    """One statistical test between two groups."""

    __test__ = False

    statistic: Statistic = None
    degrees_of_freedom: Statistic = None


class Estimate(Frozen):
    """A number with its 95 % interval: by Student's t for a mean, over bootstrap resamples for all else.

    The ends are null if they were not asked for, if there are fewer than two values, or if all resamples agree.
    """

    value: Statistic = None
    lower: Statistic = None
    upper: Statistic = None
    text: str = Field("", description="the number with its interval", examples=["0.71 [0.62, 0.8]"])


class Summary(Frozen):
    """The values of one experiment, one for each repetition."""

    n: int
    sd: Statistic = Field(None, description="sample standard deviation")
    mean: Estimate
    interquartile_mean: Estimate = Field(description="mean of the middle half of the values, robust to outliers")


class Groups(Frozen):
    """Two groups of values and the unpaired tests between them. Differences are `first` minus `second`."""

    n_first: int
    n_second: int
    sizes: str = Field(
        "",
        description="how many values the difference is of: of the pairs where streams are shared, else of each group",
        examples=["8, 8"],
    )
    difference: Statistic = Field(description="difference of the means")
    effect_size: Statistic = Field(
        description="Cohen's d: the difference divided by the pooled standard deviation; where streams are shared, "
        "over the repetitions that both have"
    )
    difference_text: str = Field("", description="the difference with its interval", examples=["+0.12 [0.05, 0.19]"])
    effect_size_text: str = Field("", examples=["+0.52"])
    student: Test = Field(description="Student's t-test, which the paper uses")
    welch: Test
    mann_whitney: Test


class Pooled(Groups):
    """The paper's test: the values at all numbers of a range as one group."""

    caution: str = Field(
        description="why not to trust these tests",
        examples=["pooled as in the paper: the values of one repetition … are not independent"],
    )


class Trusted(PValue):
    """The test by which a pair is judged: paired if the experiments share random streams, else Welch's t.

    Holm's correction is over the trusted tests of all pairs.
    """

    test: Literal["welch", "paired_t"]


class EquivalenceVerdict(StrEnum):
    """What tests say of a pair and a margin."""

    EQUIVALENT = "equivalent"
    DIFFERENT = "different"
    UNDECIDED = "undecided"


class Equivalence(Frozen):
    """Two one-sided tests of whether a difference lies within ±margin."""

    margin: float = Field(description="margin in the unit of fitness", examples=[0.03])
    test: Literal["welch", "paired_t"]
    p: Statistic = Field(None, description="the larger p of the two tests, uncorrected")
    p_holm: Statistic = Field(None, description="p-value with Holm's correction over all pairs")
    verdict: EquivalenceVerdict = Field(
        description="equivalent: this p_holm is below 0.05, even where the pair differs by less than the margin; "
        "different: the trusted test's p_holm is; undecided: neither"
    )
    words: str = Field(examples=["equivalent within ±0.03 (p = 0.012, raw 0.004)"])


class Pair(Read):
    """Two experiments, and the numbers of real-world evaluations at which they are compared."""

    first: Id
    first_name: Name = ""
    second: Id
    second_name: Name = ""
    from_evaluations: int
    to_evaluations: int


class Comparison(Groups, Pair):
    """Two experiments, compared by one value for each repetition.

    The value is the fitness at a single number of real-world evaluations. Over a range it is the mean over
    the range; a repetition that lacks a number of the range is left out. Differences are `first` minus `second`.
    """

    fitness: Fitness = Fitness.RECORDED
    unit: Unit = Field("", description="of fitness", examples=["m/s"])
    where: str = Field("", description="these numbers", examples=["after 5 real-world evaluations"])
    cost: Statistic = Field(
        None,
        description="rollouts, seconds or cost at which they are compared; null: after numbers of real-world "
        "evaluations. At equal cost, `from_evaluations` and `to_evaluations` are the fewer and the more of the two",
    )
    evaluations_first: int | None = Field(
        None,
        description="at equal cost: real-world evaluations that the first could pay for; null: it ended with less, or "
        "is the direct baseline, which counts at any cost",
    )
    evaluations_second: int | None = Field(None, description="those of the second")
    shared_evaluations: int = Field(
        0, description="last number of real-world evaluations that all compared experiments share"
    )
    difference: Statistic = Field(
        description="difference of the means; where streams are shared, over the repetitions that both have"
    )
    caution: str | None = Field(
        None,
        description="why not to trust the unpaired tests; null if they can be trusted",
        examples=["both draw the random numbers of seed 0 and the strategy simulated_fit …"],
    )
    lower: Statistic = Field(
        None, description="lower end of the 90 % interval of the difference; paired if the streams are shared"
    )
    upper: Statistic = Field(None, description="upper end of that interval")
    warnings: tuple[str, ...] = Field(
        (),
        description="what differs besides the strategy, so that fitness says little of it: robot, task or reality",
        examples=[["different robots (quadruped; toy_function): their fitness does not mean the same"]],
    )
    improvement: Estimate = Field(
        description="probability that a repetition of the first is fitter than one of the second; a tie counts half"
    )
    shared_streams: bool = Field(
        description="whether repetitions of one number draw the same random numbers in both experiments"
    )
    streams: str = Field(description="why they share random streams, or not", examples=["different strategies"])
    trusted: Trusted
    n_paired: int = Field(description="repetition numbers with a value in both; 0 if the streams are not shared")
    paired_t: Test = Field(description="paired t-test by repetition number; only where streams are shared")
    wilcoxon: Test = Field(
        description="Wilcoxon's signed-rank test by repetition number; only where streams are shared"
    )
    brown_forsythe: Test = Field(description="test of equal spread: Levene's with the median")
    summary_first: Summary
    summary_second: Summary
    equivalence: Equivalence | None = Field(None, description="null without a margin")
    pooled: Pooled | None = Field(None, description="the paper's tests over the same range; null at a single number")

    @property
    def differs(self) -> bool:
        """Whether the trusted test says that the two differ."""
        return self.trusted.differs

    @property
    def is_equivalent(self) -> bool:
        """Whether the two are shown to be equivalent within the margin that was asked for."""
        return self.equivalence is not None and self.equivalence.verdict is EquivalenceVerdict.EQUIVALENT


UNPAIRED = ("student", "welch", "mann_whitney")
PAIRED = ("paired_t", "wilcoxon")
TESTS = (*UNPAIRED, *PAIRED, "brown_forsythe")
NAMES = {
    "student": "Student",
    "welch": "Welch",
    "mann_whitney": "Mann-Whitney",
    "paired_t": "Paired t",
    "wilcoxon": "Wilcoxon",
    "brown_forsythe": "Brown-Forsythe",
}
"""What a table calls each test; Brown and Forsythe's is of the spread."""

_OF_A_TEST = ("statistic", "degrees_of_freedom", "p", "p_holm")
_OF_AN_ESTIMATE = ("value", "lower", "upper")

_GROUPS = ("n_first", "n_second", "difference", "effect_size")
_SUMMARIES = tuple(
    path
    for side in ("summary_first", "summary_second")
    for path in (
        f"{side}.sd",
        *(f"{side}.{number}.{part}" for number in ("mean", "interquartile_mean") for part in _OF_AN_ESTIMATE),
    )
)
_PATHS = (
    *("first", "first_name", "second", "second_name", "from_evaluations", "to_evaluations", "fitness"),
    *("cost", "evaluations_first", "evaluations_second"),
    *_GROUPS,
    *(f"{test}.{part}" for test in TESTS for part in _OF_A_TEST),
    *("lower", "upper", *(f"improvement.{part}" for part in _OF_AN_ESTIMATE)),
    *("shared_streams", "n_paired", "trusted.test", "trusted.p", "trusted.p_holm"),
    *_SUMMARIES,
    *(f"equivalence.{part}" for part in ("margin", "test", "p", "p_holm", "verdict")),
    *(f"pooled.{part}" for part in (*_GROUPS, *(f"{test}.{each}" for test in UNPAIRED for each in _OF_A_TEST))),
)

COLUMNS = tuple(path.removesuffix(".value").replace(".", "_") for path in _PATHS)
_NAMES = {"first", "first_name", "second", "second_name", "fitness"}
TEXTS = frozenset({*_NAMES, "trusted_test", "equivalence_test", "equivalence_verdict"})


def shown_tests(pairs: Sequence[Comparison]) -> tuple[str, ...]:
    """Return the tests to show of these pairs: paired ones only if two experiments share their random streams."""
    shared = any(pair.shared_streams for pair in pairs)
    return tuple(test for test in TESTS if shared or test not in PAIRED)


def row(pair: Comparison) -> tuple[object, ...]:
    """Return the values of a pair in the order of `COLUMNS`; a missing part has None in each of its columns."""
    return tuple(_value(pair, path) for path in _PATHS)


def _value(pair: Comparison, path: str) -> object:
    value: object = pair
    for name in path.split("."):
        value = None if value is None else getattr(value, name)
    return value
