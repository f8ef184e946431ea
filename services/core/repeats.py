"""Repeats of a measurement: how noisy reality is, and how much a sample weighs."""

from collections.abc import Iterable, Sequence

import numpy as np

from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.types import Sample


def mean(values: FloatArray) -> float:
    """Return the mean of repeats `(r,)`; of equal values, exactly that value."""
    return float(values[0] + np.mean(values - values[0]))


def count(sample: Sample) -> int:
    """Return the number of values whose mean is the sample's fitness."""
    return max(1, len(sample.repeats))


def standard_error(values: FloatArray) -> float | None:
    """Return the standard error of the mean of repeats `(r,)`; None for fewer than two."""
    return (pooled_variance([values]) / len(values)) ** 0.5 if len(values) > 1 else None


def pooled_variance(repeated: Iterable[FloatArray]) -> float:
    """Return the variance of one value, pooled over measurements; 0 if none has repeats, or all repeats are equal.

    It is pooled because two or three values `(r,)` say little about their own variance: a sample that happens to agree
    with itself would silence all others.
    """
    shifted = [values - values[0] for values in repeated if len(values) > 1]
    freedom = sum(len(values) - 1 for values in shifted)
    return sum(float(((values - values.mean()) ** 2).sum()) for values in shifted) / freedom if freedom else 0.0


def variance_of_mean(samples: Sequence[Sample]) -> float:
    """Return the variance of a sample's fitness, weighted as by `weights`; 0 if none has repeats.

    A fitness is the mean of c values, and its squared error weighs c over the mean of all c. So every weighted error of
    the right simulator has the same variance: that of one value over the mean of all c.
    """
    variance = pooled_variance(sample.repeats for sample in samples)
    return variance / float(np.mean([count(sample) for sample in samples])) if samples else 0.0


def weights(samples: Sequence[Sample]) -> FloatArray | None:
    """Return weights `(k,)` of squared errors, inverse to the variance of each mean, 1 on average; None if all are 1.

    The unit of a squared error stays that of fitness squared.
    """
    counts = np.array([count(sample) for sample in samples], dtype=np.float64)
    return None if np.all(counts == counts[0]) else counts / counts.mean()
