"""What a study shows, in sentences: which strategies differ, and after how many real-world evaluations."""

from collections.abc import Iterator, Sequence

from gaplab.api.clients.client import Client
from gaplab.schemas.curves import Comparison, Curve

SIGNIFICANT = 0.05
MOST = 4  # pairs that are named; the others are counted


def findings(client: Client, curves: Sequence[Curve]) -> Iterator[str]:
    """A sentence for each of the paper's ranges of counts: at one evaluation, beyond two, beyond five.

    Pairs of strategies by Student's t, as in the paper, after Holm's correction over all pairs.
    """
    names = {each.experiment: each.name.replace("_", " ") for each in curves if not each.direct}
    last = max((point.evaluations for each in curves for point in each.points), default=0)
    for first, final in _ranges(last):
        if len(names) > 1:
            yield _sentence(client.compare(list(names), first, final), names, first, final)
    reached = [line for each in curves if not each.direct for line in _against_direct(each, curves)]
    if reached:
        yield f"After {last} real-world evaluations, over the direct baseline: " + ", ".join(reached)


def _ranges(last: int) -> list[tuple[int, int]]:
    """Source: the caption of the paper's Fig. 4."""
    return [each for each in ((1, 1), (3, last), (6, last)) if each[0] <= each[1] <= last]


def _sentence(pairs: Sequence[Comparison], names: dict[str, str], first: int, final: int) -> str:
    found = sorted((each for each in pairs if _p(each) < SIGNIFICANT), key=_p)
    counts, plural = (f"{first}", "" if first == 1 else "s") if first == final else (f"{first}-{final}", "s")
    where = f"At {counts} real-world evaluation{plural}"
    start = f"{where}, {len(found)} of {len(pairs)} pairs differ (p < {SIGNIFICANT}, Student's t, Holm)"
    shown = [_words(each, names) for each in found[:MOST]]
    more = [f"and {len(found) - MOST} more"] if len(found) > MOST else []
    return f"{start}: {', '.join(shown + more)}" if found else start


def _words(pair: Comparison, names: dict[str, str]) -> str:
    better, worse = names[pair.first], names[pair.second]
    if (pair.difference or 0) < 0:
        better, worse = worse, better
    return f"{better} > {worse} (p = {_p(pair):.1g})"


def _p(pair: Comparison) -> float:
    p = pair.student.p_holm if pair.student.p_holm is not None else pair.student.p
    return 1.0 if p is None else p


def _against_direct(curve: Curve, curves: Sequence[Curve]) -> list[str]:
    """The last mean of a curve over that of the direct baseline, where both are there."""
    level = next((point.mean for each in curves if each.direct for point in each.points), None)
    mean = curve.points[-1].mean if curve.points else None
    return [f"{curve.name.replace('_', ' ')} {mean / level:.2f}"] if mean is not None and level else []
