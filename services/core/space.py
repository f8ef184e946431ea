"""The spaces that searches move in."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from gaplab.services.core.arrays import FloatArray, Genomes, frozen
from gaplab.services.core.errors import PluginBroken


@dataclass(frozen=True, eq=False)
class Space:
    """A box of real vectors; coordinates may be periodic.

    Attributes:
        lower: `(g,)`: smallest value of each coordinate.
        upper: `(g,)`: largest value of each coordinate, above `lower`.
        periodic: `(g,)` of bool: true if the coordinate wraps (a phase), false if it clips (a width).
    """

    lower: FloatArray
    upper: FloatArray
    periodic: NDArray[np.bool_]

    def __post_init__(self) -> None:
        if not (self.lower.shape == self.upper.shape == self.periodic.shape) or self.lower.ndim != 1:
            raise ValueError(
                f"lower, upper and periodic are vectors of one length, not {self.lower.shape}, {self.upper.shape}"
            )
        if not np.all(self.lower < self.upper):
            where = int(np.argmin(self.lower < self.upper))
            raise ValueError(
                f"lower must be below upper: coordinate {where} has {self.lower[where]} and {self.upper[where]}"
            )

    @classmethod
    def box(cls, lower: Sequence[float], upper: Sequence[float], periodic: Sequence[bool] | None = None) -> "Space":
        """Create a space from sequences; by default no coordinate is periodic."""
        wraps = np.array(periodic if periodic is not None else [False] * len(lower), dtype=bool)
        wraps.flags.writeable = False
        return cls(frozen(lower), frozen(upper), wraps)

    @property
    def size(self) -> int:
        """Return the number of coordinates, g."""
        return len(self.lower)

    @property
    def extent(self) -> FloatArray:
        """Return `(g,)`: upper minus lower."""
        return self.upper - self.lower

    def apart(self, first: FloatArray, second: FloatArray) -> FloatArray:
        """Return first minus second in units of the extents, `(..., g)`; phases the shorter way around."""
        shares = (first - second) / self.extent
        return np.where(self.periodic, shares - np.round(shares), shares)

    def draw(self, count: int, rng: Generator) -> Genomes:
        """Return vectors `(count, g)`, drawn uniformly from the box."""
        return self.at(rng.random((count, self.size)))

    def at(self, shares: FloatArray) -> FloatArray:
        """Return the vectors at shares of the extents `(..., g)`, from 0 to 1; none is above a bound by rounding."""
        return np.minimum(self.lower + self.extent * shares, self.upper)

    def check(self, vector: object, source: str) -> FloatArray:
        """Return a read-only copy of the vector `(g,)`, which a plug-in returned.

        Args:
            vector: anything.
            source: subject of the error's sentence, like `strategy 'random'`.

        Raises:
            PluginBroken: it is not one vector of g finite numbers within the bounds.
        """
        try:
            found = np.asarray(vector, dtype=float)
        except (TypeError, ValueError):
            found = np.empty((0, 0))
        if found.shape != self.lower.shape:
            brief = f"an array of shape {vector.shape}" if isinstance(vector, np.ndarray) else f"{vector!r:.100}"
            raise PluginBroken(f"{source} returned {brief}; permitted: one vector of {self.size} numbers")
        inside = (self.lower <= found) & (found <= self.upper)  # false for nan
        if not inside.all():
            where = int(np.argmin(inside))
            raise PluginBroken(
                f"{source} returned {found[where]} as number {where} of a vector; "
                f"permitted: {self.lower[where]} to {self.upper[where]}"
            )
        return frozen(found)

    def contain(self, vectors: FloatArray) -> FloatArray:
        """Return the vectors `(..., g)` moved into the box: periodic coordinates wrap, the others clip."""
        wrapped = self.lower + np.mod(vectors - self.lower, self.extent)
        return np.minimum(np.maximum(np.where(self.periodic, wrapped, vectors), self.lower), self.upper)
