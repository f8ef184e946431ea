"""Tunables that act alike: the sensitivity check's controllers do not tell them apart.

The *slope* of a tunable for a controller is that of the line through its profile, over the tunable's bounds. Two
tunables whose slopes are proportional over all controllers can stand in for each other: what one adds to every fitness,
the other takes away. The cosine between their slopes says how far they are from that: 1 if they are proportional, and
near 0 for unrelated ones. Source: gaplab; in least squares, it is the collinearity of two columns of the Jacobian.
"""

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from gaplab.schemas.sensitivity import Sensitivity, Verdict
from gaplab.services.core.arrays import FloatArray

ALIKE = 0.97
"""Least cosine of slopes that counts as alike; 1 in 60 000 pairs of independent slopes of eight controllers has it."""

STRAIGHT = 0.5
"""Least share of the variance along a profile that its lines explain; else slopes say too little."""

FEWEST = 4
"""Fewest controllers that are compared."""


def alike(findings: Sequence[Sensitivity]) -> tuple[str, ...]:
    """Return a warning for each pair of smooth tunables that act alike, with what to do about it."""
    smooth = [(each.name, _slopes(each)) for each in findings if each.verdict is Verdict.SMOOTH]
    straight = [(name, slopes) for name, slopes in smooth if slopes is not None]
    return tuple(
        f"{first} and {second} act alike on the fitness of all controllers of the check (cosine {cosine:.2f}), so that "
        "fitness hardly tells them apart, however many samples there are. Tune one of the two, or tune on readings"
        for (first, one), (second, other) in combinations(straight, 2)
        if (cosine := _cosine(one, other)) >= ALIKE
    )


def _slopes(found: Sensitivity) -> FloatArray | None:
    """Return the slopes of a profile, `(c,)`, nan where physics failed; None if lines explain too little of it."""
    fitness = np.array(found.fitness, dtype=float)
    across = np.linspace(-0.5, 0.5, fitness.shape[1])
    centred = fitness - fitness.mean(axis=1, keepdims=True)
    slopes = (centred * across).sum(axis=1) / (across * across).sum()
    known = np.isfinite(slopes)
    whole = float((centred[known] ** 2).sum())
    lines = float((slopes[known] ** 2).sum() * (across * across).sum())
    return slopes if known.sum() >= FEWEST and lines >= STRAIGHT * whole > 0 else None


def _cosine(one: FloatArray, other: FloatArray) -> float:
    known = np.isfinite(one) & np.isfinite(other)
    lengths = float(np.linalg.norm(one[known]) * np.linalg.norm(other[known]))
    return abs(float(one[known] @ other[known])) / lengths if known.sum() >= FEWEST and lengths > 0 else 0.0
