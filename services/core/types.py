"""The values of the algorithm: immutable, self-checking, compared by content."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from gaplab.services.core.arrays import (
    NO_READINGS,
    FloatArray,
    Genome,
    Genomes,
    Parameters,
    Readings,
    frozen,
    no_readings,
)
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

    def draw(self, count: int, rng: Generator) -> Genomes:
        """Return vectors `(count, g)`, drawn uniformly from the box."""
        return self.lower + self.extent * rng.random((count, self.size))

    def check(self, vector: object, source: str) -> FloatArray:
        """Return the vector `(g,)`, which a plug-in returned.

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
            raise PluginBroken(f"{source} returned {_brief(vector)}; permitted: one vector of {self.size} numbers")
        inside = (self.lower <= found) & (found <= self.upper)  # false for nan
        if not inside.all():
            where = int(np.argmin(inside))
            raise PluginBroken(
                f"{source} returned {found[where]} as number {where} of a vector; "
                f"permitted: {self.lower[where]} to {self.upper[where]}"
            )
        return found

    def contain(self, vectors: FloatArray) -> FloatArray:
        """Return the vectors moved into the box: periodic coordinates wrap, the others clip."""
        wrapped = self.lower + np.mod(vectors - self.lower, self.extent)
        clipped = np.minimum(np.maximum(vectors, self.lower), self.upper)
        return np.where(self.periodic, wrapped, clipped)


class Outcome(NamedTuple):
    """What reality answers about one genome.

    Attributes:
        fitness: its fitness; nan if the measurement failed.
        readings: `(q,)`: what the sensors said, each divided by its noise; empty if the robot has none.
    """

    fitness: float
    readings: Readings = NO_READINGS


@dataclass(frozen=True, eq=False)
class Sample:
    """A genome with its outcome in reality.

    Attributes:
        genome: `(g,)`.
        fitness: nan if the measurement failed, which counts but is not learned from.
        readings: `(q,)`: what the sensors said, each divided by its noise; empty if there are none.
    """

    genome: Genome
    fitness: float
    readings: Readings = field(default_factory=no_readings)

    @property
    def outcome(self) -> FloatArray:
        """Return `(1 + q,)`: fitness, then readings."""
        return np.append(self.fitness, self.readings)


@dataclass(frozen=True, eq=False)
class Simulator:
    """One setting of the tunables, with its discrepancy from the samples that it was tuned on.

    Attributes:
        parameters: `(p,)`, in the order of the spec's tunables.
        squared_error: the discrepancy, by default Σ(f_sim − f_real)²; at least 0; 0 before any sample, inf where the
            physics failed on one.
        interval: `(p, 2)`: ends of the 95 % interval of each tunable; None if the tuner gives none.
        weight: share of the posterior probability; None if the tuner gives none.
    """

    parameters: FloatArray
    squared_error: float = 0.0
    interval: FloatArray | None = None
    weight: float | None = None


@dataclass(frozen=True, eq=False)
class Belief:
    """Everything that a strategy may know: the samples so far, and simulators tuned on them, best first.

    Attributes:
        space: space of genomes.
        known: `(g,)`: the robot's hand-designed genome.
        samples: samples in the order of measurement.
        simulators: one simulator or a diverse ensemble; random before the first sample.
    """

    space: Space
    known: Genome
    samples: tuple[Sample, ...]
    simulators: tuple[Simulator, ...]

    @property
    def parameters(self) -> Parameters:
        """Return the parameters `(m, p)` of all simulators."""
        return np.array([each.parameters for each in self.simulators])

    @property
    def squared_errors(self) -> FloatArray:
        """Return the squared errors `(m,)` of all simulators."""
        return np.array([each.squared_error for each in self.simulators])

    @property
    def learnable(self) -> tuple[Sample, ...]:
        """Return the samples whose measurement succeeded."""
        return tuple(each for each in self.samples if np.isfinite(each.fitness))


@dataclass(frozen=True)
class Budget:
    """Fitness evaluations of each search; the paper's numbers are the defaults. Source: sections 2 and 3.

    Attributes:
        reuse_transfer: true if a strategy whose search has the transfer's goal tries the transferred controller. It
            then selects from a search of `controller_evaluations`, other strategies from `selection_evaluations`.
    """

    controller_evaluations: int = 10_000
    selection_evaluations: int = 10_000
    simulator_evaluations: int = 2_000
    reuse_transfer: bool = True


@dataclass(frozen=True)
class Cost:
    """Cost of a step.

    Attributes:
        rollouts: number of simulated rollouts.
        failures: number of those that failed (nan).
        saved: budgeted rollouts that could not change the result, and were not simulated.
    """

    rollouts: int = 0
    failures: int = 0
    saved: int = 0


@dataclass(frozen=True, eq=False)
class Selected:
    """The strategy chose the genome to try in reality next."""

    iteration: int
    genome: Genome
    cost: Cost = field(default_factory=Cost)


@dataclass(frozen=True, eq=False)
class Measured:
    """Reality answered: one more sample."""

    iteration: int
    sample: Sample


@dataclass(frozen=True, eq=False)
class Tuned:
    """New simulators, best first, fitted to all samples so far; drawn at random in iteration 0."""

    iteration: int
    simulators: tuple[Simulator, ...]
    cost: Cost = field(default_factory=Cost)


@dataclass(frozen=True, eq=False)
class Transferred:
    """A controller was evolved in the best simulator, for a probe in reality.

    Attributes:
        fitness: fitness in that simulator; nan if the physics failed for every controller tried.
    """

    iteration: int
    genome: Genome
    fitness: float
    cost: Cost = field(default_factory=Cost)


@dataclass(frozen=True)
class Probed:
    """The fitness of the transferred controller in reality was recorded; it is never learned from or counted.

    Attributes:
        fitness: fitness in reality; nan if the measurement failed.
        recorded: the larger of this and the best sample's fitness, which the curve shows. Source: section 3.
        readings: `(q,)`: what the sensors said, each divided by its noise; empty if there are none.
    """

    iteration: int
    fitness: float
    recorded: float
    readings: Readings = field(default_factory=no_readings, compare=False)


Step: TypeAlias = Selected | Measured | Tuned | Transferred | Probed


def _brief(value: object) -> str:
    """Return the shape of an array, else a short representation."""
    return f"an array of shape {value.shape}" if isinstance(value, np.ndarray) else f"{value!r:.100}"
