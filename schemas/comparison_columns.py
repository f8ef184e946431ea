"""The columns of a comparison as a table: one row for each pair, for CSV and frames."""

from collections.abc import Sequence

from gaplab.schemas.comparisons import Comparison

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
