"""Fitness of `lean` and of `paper` over the direct baseline of each: what the paper's claims are ratios of."""

import math
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from benchmarks.differences import Difference, Z
from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.equivalence import difference_interval
from gaplab.services.core.statistics import both, finite
from gaplab.services.results.curves import recorded_of
from gaplab.services.store.session import Store

COLUMNS = "strategy", "after", "lean", "paper", "difference", "p", "shown if 0", "verdict"


def ratio_rows(
    store: Store, lean: Mapping[str, str], paper: Mapping[str, str], counts: Sequence[int], margin: float
) -> Iterator[tuple[str, ...]]:
    """Yield the difference of the ratios to direct, for each strategy and count, and two one-sided tests of it.

    The intervals include the standard errors of both baselines. Repetitions are paired: they share random streams.

    Args:
        store: database with the experiments.
        lean: their ids by strategy, `direct` among them.
        paper: the same.
        counts: numbers of real-world evaluations.
        margin: share of direct within which both are equivalent.
    """
    ids = [side[name] for side in (lean, paper) for name in lean if name in paper]
    with store.reading() as session:
        _, recorded = recorded_of(session, ids)
    baselines = [finite(recorded[side["direct"]][:, 0]) for side in (lean, paper)]
    for name in (each for each in lean if each in paper and each != "direct"):
        for count in counts:
            values = [recorded[side[name]] for side in (lean, paper)]
            if all(count < each.shape[1] for each in values):
                first, second = (each[:, count] / own.mean() for each, own in zip(values, baselines, strict=True))
                found = ratio_difference(first, second, baselines)
                if found is not None:
                    means = (f"{np.nanmean(each):.3f}" for each in (first, second))
                    yield name, str(count), *means, *found.cells(margin)


def ratio_difference(first: FloatArray, second: FloatArray, baselines: Sequence[FloatArray]) -> Difference | None:
    """Return the mean difference of paired ratios to direct, with the errors of both baselines; None if undefined.

    Args:
        first: ratios `(r,)` by repetition; nan is missing.
        second: the same.
        baselines: fitness of direct behind each, by repetition.
    """
    lower, upper = difference_interval(first, second, paired=True)
    one, other = both(first, second)
    found = Difference.of(float((one - other).mean()) if len(one) else None, lower, upper)
    if found is None:
        return None
    errors = [
        Z * float(np.nanmean(ratios)) * float(own.std(ddof=1)) / math.sqrt(len(own)) / float(own.mean())
        for ratios, own in zip((first, second), baselines, strict=True)
    ]
    return found._replace(half=math.hypot(found.half, *errors))
