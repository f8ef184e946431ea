"""Evolve for fitness and for what reality would repeat, and learn from each test where that is."""

from typing import Annotated, ClassVar

import numpy as np
from numpy.random import Generator
from pydantic import Field

from gaplab.schemas.base import Frozen
from gaplab.services.core.arrays import FloatArray, Genome, Genomes, Outcomes, nearest
from gaplab.services.core.optimizers.nsga2 import fronts
from gaplab.services.core.registry import Presets
from gaplab.services.core.strategies.base import Search, Strategy
from gaplab.services.core.types import Belief

CLOSEST = 0.01
"""Smaller distances count as this one."""

FARTHEST = 1e6
"""Novelty before any test."""


class TransferabilityOptions(Frozen):
    """Options of the strategy `transferability`."""

    exponent: Annotated[float, Field(strict=True, ge=0, le=10)] = Field(
        default=2.0,
        description="how fast a test counts less with distance: as its power; gaplab's default, since the only "
        "transcription of the formula, in a review, has 1",
    )
    normalise: bool = Field(
        default=True,
        description="divide the estimate by the sum of what tests count; false: by their number, as in that "
        "transcription, so that it has another unit than the limit of a transfer; gaplab's default",
    )


class Transferability(Strategy):
    """The controllers that are fit in simulation, and that reality would probably repeat.

    One simulator stays as it was drawn. In it, a population evolves for fitness, for a small estimated disparity, and
    for novelty, the distance from the nearest test. It goes on from each selection to the transfer, and to the next
    selection. The disparity of a test is the root mean square difference of its readings between simulation and
    reality, in units of their noise. The estimate for another controller is the mean over tests, weighted by distance.
    Distances are of behaviour in simulation: mean and last value of each sensor, over their standard deviations.

    Tested is a member, drawn uniformly, whose novelty is more than is usual between members. Transferred is the fittest
    on the front whose estimate is at most the median of the tests.

    Do not use it where tuning can explain the gap: it never repairs the simulator.
    """

    name = "transferability"
    source = "Koos, Mouret and Doncieux 2010, 2013; the constants of estimate and tests are gaplab's"
    presets: ClassVar[Presets] = {"as_published": {"exponent": 1.0, "normalise": False}}
    tunes = False
    continues = True
    senses = True
    controller_optimizer = "nsga2"
    Options = TransferabilityOptions
    options: TransferabilityOptions

    def select(self, belief: Belief, search: Search, rng: Generator) -> Genome:
        """Return a member that is new enough, drawn uniformly; the newest one if none is."""
        found, scores = self._evolved(belief, search)
        new = np.flatnonzero(scores[:, 2] > found.usual)
        chosen: Genome = search.members[rng.choice(new) if len(new) else int(np.argmax(scores[:, 2]))]
        return chosen

    def transfer(self, belief: Belief, search: Search, rng: Generator) -> Genome:  # noqa: ARG002 - the port's signature
        """Return the fittest of the front that is estimated to transfer; the one with the best estimate if none is."""
        found, scores = self._evolved(belief, search)
        front, estimates = fronts(scores) == 0, -scores[:, 1]
        fair = np.flatnonzero(front & (estimates <= found.fair))
        best = fair[0] if len(fair) else int(np.argmin(np.where(front, estimates, np.inf)))
        chosen: Genome = search.members[best]
        return chosen

    def _evolved(self, belief: Belief, search: Search) -> tuple["Objectives", FloatArray]:
        """Return the objectives of one more search, and the scores `(n, 3)` of its members, the fittest first."""
        found = Objectives(belief, self.options)
        search(found, parameters=belief.parameters[:1], senses=True, start=found.start)
        scores = np.array([found.scores[member.tobytes()] for member in search.members])
        return found, np.where(np.isfinite(scores).all(axis=1, keepdims=True), scores, -np.inf)


class Objectives:
    """The score of a search: fitness, minus the estimated disparity, and novelty, `(n, 3)`.

    Its first call has the tested genomes, then the members, which together say what distances are usual.

    Attributes:
        start: `(n, g)`: genomes to evaluate first.
        scores: scores `(3,)` of each genome so far.
        usual: median distance of a tested genome or member from its nearest neighbour, as the search begins.
        fair: median disparity of the tests; inf without any.
    """

    def __init__(self, belief: Belief, options: TransferabilityOptions) -> None:
        self.scores: dict[bytes, FloatArray] = {}
        self.usual, self.fair, self._belief, self._options = 0.0, np.inf, belief, options
        self._samples = belief.learnable if len(belief.members) else ()  # alone, they are not a population
        self.start: Genomes = np.array([*(each.genome for each in self._samples), *belief.members])
        self._tests: FloatArray | None = None
        self._disparities: list[float] = []
        self._scale: FloatArray | float = 1.0

    def __call__(self, genomes: Genomes, outcomes: Outcomes) -> FloatArray:
        """Return the scores of genomes with outcomes `(n, 1, 1 + q)`; nan where the physics failed."""
        readings = outcomes[:, 0, 1:]
        if self._tests is None:
            self._tests = self._begun(readings)
        distances = self._distances(readings, self._tests)
        novelty = distances.min(axis=1, initial=FARTHEST)
        scores = np.column_stack([outcomes[:, 0, 0], -self._estimates(distances), novelty])
        self.scores.update(zip((genome.tobytes() for genome in genomes), scores, strict=True))
        return scores

    def _begun(self, readings: FloatArray) -> FloatArray:
        """Return the readings in simulation `(k, q)` of the tests with a disparity; learn what is usual."""
        behaviour = self._behaviour(readings)
        behaviour = behaviour[np.isfinite(behaviour).all(axis=1)]
        if len(behaviour) > 1:
            self._scale = np.where(behaviour.std(axis=0) > 0, behaviour.std(axis=0), 1.0)
            apart = np.linalg.norm((behaviour[:, None] - behaviour) / self._scale, axis=2)
            np.fill_diagonal(apart, np.inf)
            self.usual = float(np.median(apart.min(axis=1)))
        tests = []
        for simulated, sample in zip(readings, self._samples, strict=False):
            found = self.disparity(simulated, sample.readings)
            if np.isfinite(simulated).all() and np.isfinite(found):
                tests.append(simulated)
                self._disparities.append(found)
        if tests:
            self.fair = float(np.median(self._disparities)) * (1.0 + 1e-9)  # for rounding
        return np.array(tests).reshape(len(tests), readings.shape[1])

    def disparity(self, simulated: FloatArray, real: FloatArray) -> float:
        """Return the root mean square difference of readings `(q,)` that both have; nan if there are none."""
        same = simulated.shape == real.shape
        away = nearest(simulated, real, self._belief.reading_periods) - real if same else simulated[:0]
        there = away[np.isfinite(away)]
        return float(np.sqrt(np.mean(there**2))) if there.size else np.nan

    def _distances(self, readings: FloatArray, tests: FloatArray) -> FloatArray:
        """Return the distances in behaviour `(n, k)` of readings `(n, q)` from those of tests `(k, q)`."""
        each = np.broadcast_to(readings[:, None], (len(readings), *tests.shape))
        beside = nearest(each, tests, self._belief.reading_periods)
        away = (self._behaviour(beside) - self._behaviour(tests)) / self._scale
        return np.asarray(np.sqrt((away**2).sum(axis=-1)))

    def _behaviour(self, readings: FloatArray) -> FloatArray:
        """Return mean over time and last value of each of s sensors, `(..., 2 s)`, from readings `(..., q)`."""
        times, count = self._belief.reading_times_s, readings.shape[-1]
        sensors = int((times == times.max(initial=0.0)).sum()) or count
        by_time = readings.reshape(*readings.shape[:-1], count // sensors if sensors else 1, sensors)
        return np.concatenate([by_time.mean(axis=-2), by_time[..., -1, :]], axis=-1)

    def _estimates(self, distances: FloatArray) -> FloatArray:
        """Return the estimated disparity `(n,)`, Σ D d⁻ᵖ / Σ d⁻ᵖ of the distances `(n, k)` to tests; 0 without any."""
        if not self._disparities:
            return np.zeros(len(distances))
        weights = np.maximum(distances, CLOSEST) ** -self._options.exponent
        total = weights @ np.array(self._disparities)
        return np.asarray(total / (weights.sum(axis=1) if self._options.normalise else len(self._disparities)))
