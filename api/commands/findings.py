"""The result of a study in sentences: which strategies differ, and after how many real-world evaluations."""

from collections.abc import Iterator, Mapping, Sequence

from gaplab.api.clients.client import Client
from gaplab.schemas.comparisons import Comparison
from gaplab.schemas.curves import Curve

SIGNIFICANT = 0.05
MOST = 4
"""Pairs that are named; the others are counted."""


def findings(client: Client, curves: Sequence[Curve]) -> Iterator[str]:
    """Yield a sentence for the last number of evaluations that the strategies share, the first, and the paper's ranges.

    Pairs of strategies are compared by their trusted tests, with Holm's correction over all pairs. Over a range, each
    repetition is one value, its mean.
    """
    learned = [curve for curve in curves if not curve.direct]
    names = {curve.experiment: curve.name.replace("_", " ") for curve in learned}
    last = max((point.evaluations for curve in curves for point in curve.points), default=0)
    shared = min((max(_reached(curve), default=0) for curve in learned if not curve.level), default=0)
    ranges = [(shared, shared), (1, 1), (3, shared), (6, shared)]  # Source: the caption of the paper's Fig. 4
    for first, final in dict.fromkeys(ranges):
        if len(names) > 1 and first <= final <= shared:
            yield _sentence(client.compare(list(names), first, final, intervals=False), names, first, final)
    level = next((point.mean for curve in curves if curve.direct for point in curve.points), None)
    ratios = [
        f"{names[curve.experiment]} {mean / level:.2f}"
        for curve in learned
        for mean in [point.mean for point in curve.points[-1:]]
        if level and mean is not None
    ]
    if ratios:
        yield f"After {last} real-world evaluations, relative to the direct baseline: {', '.join(ratios)}"


def _reached(curve: Curve) -> list[int]:
    return [point.evaluations for point in curve.points if point.mean is not None]


def _sentence(pairs: Sequence[Comparison], names: Mapping[str, str], first: int, final: int) -> str:
    differing = sorted((pair for pair in pairs if _p(pair) < SIGNIFICANT), key=_p)
    where = f"At {first if first == final else f'{first}-{final}'} real-world evaluation{'' if final == 1 else 's'}"
    mean = "" if first == final else "; the mean of each repetition"
    tests = "paired and Welch's t" if any(pair.shared_streams for pair in pairs) else "Welch's t"
    start = f"{where}, {len(differing)} of {len(pairs)} pairs differ (p < {SIGNIFICANT}, {tests}, Holm{mean})"
    shown = [_words(pair, names) for pair in differing[:MOST]]
    more = [f"and {len(differing) - MOST} more"] if len(differing) > MOST else []
    return f"{start}: {', '.join(shown + more)}" if differing else start


def _words(pair: Comparison, names: Mapping[str, str]) -> str:
    better, worse = names[pair.first], names[pair.second]
    if (pair.difference or 0) < 0:
        better, worse = worse, better
    return f"{better} > {worse} (p = {_p(pair):.1g})"


def _p(pair: Comparison) -> float:
    return 1.0 if pair.trusted.p_holm is None else pair.trusted.p_holm
