"""Fitness of `lean` and of `paper` over the direct baseline of each: what the paper's claims are ratios of."""

from collections.abc import Iterator, Mapping, Sequence

from benchmarks.differences import Difference
from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.statistics import both, finite
from gaplab.services.results.curves import recorded_of
from gaplab.services.store.session import Store

COLUMNS = "strategy", "after", "lean", "paper", "difference", "p", "shown if 0", "verdict"


def ratio_rows(
    store: Store, lean: Mapping[str, str], paper: Mapping[str, str], counts: Sequence[int], margin: float
) -> Iterator[tuple[str, ...]]:
    """Yield the difference of the ratios to direct, for each strategy and count, and two one-sided tests of it.

    Means are over the repetitions that both sides have.

    Args:
        store: database with the experiments, all of one seed.
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
                shared = both(*(each[:, count] for each in values))
                found = ratio_difference(*shared, *baselines)
                if found is not None:
                    means = (f"{each.mean() / own.mean():.3f}" for each, own in zip(shared, baselines, strict=True))
                    yield name, str(count), *means, *found.cells(margin)


def ratio_difference(
    first: FloatArray, second: FloatArray, baseline: FloatArray, other: FloatArray
) -> Difference | None:
    """Return the difference of two means, each over the mean of its own baseline; None for fewer than two values.

    The repetitions are paired: both experiments share random streams. Its error includes those of both baselines.

    Args:
        first: fitness `(r,)` by repetition; nan is missing.
        second: the same, of the other experiment.
        baseline: fitness of direct that belongs to the first, by repetition.
        other: the same, for the second.
    """
    one, two = both(first, second)
    bases = Difference.mean(baseline), Difference.mean(other)
    if bases[0] is None or bases[1] is None:
        return None
    pairs = Difference.paired(one / bases[0].value, two / bases[1].value)
    if pairs is None:
        return None
    shares = [float(values.mean()) / base.value**2 for values, base in ((one, bases[0]), (two, bases[1]))]
    errors = Difference.sum([(1.0, pairs), (shares[0], bases[0]), (-shares[1], bases[1])])
    return errors._replace(value=pairs.value)
