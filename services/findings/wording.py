"""How numbers are written in sentences and in cells: p-values, intervals, ± and signs. An undefined one is a dash."""

from collections.abc import Callable, Sequence

MISSING = "\N{EN DASH}"

SMALLEST_P = 0.001
"""Smallest p-value that is written as a number."""


def number(value: float | None, digits: int = 3) -> str:
    """Return a number with so many significant digits, and all digits before the point."""
    if value is None:
        return MISSING
    rounded = float(f"{value:.{digits}g}") + 0.0 if abs(value) < 10**digits else round(value)  # -0.0 is 0
    return f"{rounded:.15g}".replace("-", "\N{MINUS SIGN}")


def signed(value: float | None) -> str:
    """Return a number with its sign; 0 has none."""
    return f"+{number(value)}" if value is not None and value > 0 else number(value)


def estimate(value: float | None, lower: float | None, upper: float | None) -> str:
    """Return a number with its interval: `0.71 [0.62, 0.8]`."""
    return number(value) + bracketed(lower, upper)


def bracketed(lower: float | None, upper: float | None) -> str:
    """Return an interval to stand after its number; "" if it is not known."""
    return "" if lower is None or upper is None else f" [{number(lower)}, {number(upper)}]"


def interval(
    lower: float | None, upper: float | None, written: Callable[[float | None], str] = number, level: int = 95
) -> str:
    """Return an interval in words: `95 % interval 0.62 to 0.8`."""
    return f"{level} % interval {written(lower)} to {written(upper)}"


def spread(mean: float | None, sd: float | None, digits: int = 3) -> str:
    """Return a mean with its standard deviation: `0.71 ± 0.02`."""
    return number(mean, digits) if sd is None else f"{number(mean, digits)} \N{PLUS-MINUS SIGN} {number(sd, digits)}"


def probability(p: float | None) -> str:
    """Return a p-value as papers write it."""
    if p is None:
        return MISSING
    return f"< {SMALLEST_P}" if p < SMALLEST_P else f"{p:.3f}"


def probabilities(p: float | None, p_holm: float | None) -> str:
    """Return p after Holm's correction, by which a pair is judged, and the uncorrected p: `0.012 (raw 0.004)`."""
    return MISSING if p is None else f"{probability(p_holm)} (raw {probability(p)})"


def p_in_words(p: float | None, p_holm: float | None) -> str:
    """Return the same two in a sentence: `p = 0.012, raw 0.004`."""
    equals = "" if p_holm is not None and p_holm < SMALLEST_P else "= "
    return f"p {equals}{probability(p_holm)}, raw {probability(p)}"


def share(value: float | None) -> str:
    """Return a share in whole per cent."""
    return MISSING if value is None else f"{100 * value:.0f} %"


def many(count: int, noun: str) -> str:
    """Return `1 repetition` or `3 repetitions`."""
    return f"{count:,} {noun}{'' if count == 1 else 's'}"


def listed(names: Sequence[str], last: str = "and") -> str:
    """Return names, at least one, as a sentence has them: `a, b and c`."""
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} {last} {names[-1]}"
