"""Sequential surrogate optimization: try the best prediction, or what is least certain if the best is known already.

A prediction is that of a Gaussian process alone, of the tuned simulator, or of both together.

Source: Hemker, Sakamoto, Stelzer and von Stryk 2006, 2009; the distance and the first design are gaplab's.
"""

from functools import partial
from typing import Annotated, ClassVar

import numpy as np
from numpy.random import Generator
from pydantic import Field

from gaplab.schemas.base import Frozen
from gaplab.services.core.arrays import Fitnesses, FloatArray, Genome, Genomes
from gaplab.services.core.gaussian_process import GaussianProcess, Posterior
from gaplab.services.core.scoring import weighted_deviation, weights_of
from gaplab.services.core.space import Space
from gaplab.services.core.strategies.base import Diverse, DiverseOptions, Search, Strategy
from gaplab.services.core.types import Belief

LENGTHS = (0.1, 1.0)
"""Bounds of the one length scale, in units of the extents, for one gene; for more, times the root of their number."""

DRAWN, STARTS = 1_000, 5
"""Random controllers, and the best of them and the samples from which sequential quadratic programming starts."""

STEP = 1e-5
"""Step of its slopes, in units of the extents."""

Near = Annotated[float, Field(strict=True, ge=0, le=1)]
NEAR = Field(
    default=0.05,
    description="distance in units of the extents, divided by the root of the number of genes, below which a sample is "
    "near; gaplab's default",
)


class SurrogateOptions(Frozen):
    """Options of the strategy `surrogate`."""

    near: Near = NEAR
    first: Annotated[int, Field(strict=True, ge=1, le=1_000)] = Field(
        default=3, description="variations of the hand-designed controller to begin with; gaplab's default"
    )
    spread: Annotated[float, Field(strict=True, gt=0, le=1)] = Field(
        default=0.25, description="largest change of each of their genes, as a share of its extent; gaplab's default"
    )


class Surrogate(Strategy):
    """The controller with the best prediction of Kriging on the samples; the least certain one if a sample is near it.

    No simulator is asked or tuned. Do not use it for many genes and few samples: ten samples say nothing of 24 genes.
    """

    name = "surrogate"
    source = "Hemker, Sakamoto, Stelzer and von Stryk 2006, 2009; the distance and the first design are gaplab's"
    searches = False
    tunes = False
    Options = SurrogateOptions
    options: SurrogateOptions

    def transfer_simulators(self, tunables: int) -> int:  # noqa: ARG002 - the port's signature
        """Return none."""
        return 0

    def select(self, belief: Belief, search: Search, rng: Generator) -> Genome:  # noqa: ARG002 - the port's signature
        """Return a variation of the known controller at first, then the best or the least certain controller."""
        space = belief.space
        if len(belief.samples) < self.options.first or not belief.learnable:
            return space.contain(belief.known + self.options.spread * space.extent * rng.uniform(-1, 1, space.size))
        known = self._known(belief)
        best = _summit(known, 0, belief, rng)
        return _summit(known, 1, belief, rng) if _near(best, belief, self.options.near) else best

    def transfer(self, belief: Belief, search: Search, rng: Generator) -> Genome:  # noqa: ARG002 - the port's signature
        """Return the controller with the best prediction; before any sample the known one."""
        return _summit(self._known(belief), 0, belief, rng) if belief.learnable else belief.known

    def _known(self, belief: Belief) -> Posterior:
        genomes = np.array([each.genome for each in belief.learnable])
        return _kriging(belief.space, genomes, np.array([each.fitness for each in belief.learnable]))


class FitUnlessNearOptions(DiverseOptions):
    """Options of the strategy `fit_unless_near`."""

    near: Near = NEAR


class FitUnlessNear(Diverse):
    """The fittest controller in the tuned simulator, or, if a sample is near it, the most disputed one.

    It is the rule with simulators in place of Kriging. The transferred controller is the fittest; the selection
    searches for it anew, as *simulated fit* does. Do not use it where reality is noisy: near samples average the noise.
    """

    name = "fit_unless_near"
    source = "Hemker et al. 2006, 2009, as Klaus, Glette and Tørresen 2012 read it; the distance is gaplab's"
    continues: ClassVar[bool] = True
    Options = FitUnlessNearOptions
    options: FitUnlessNearOptions

    def select(self, belief: Belief, search: Search, rng: Generator) -> Genome:  # noqa: ARG002 - the port's signature
        """Return the fittest found that is not near a sample, or the one with the highest weighted deviation."""
        transferred = belief.members[:1]
        if len(transferred) and _near(transferred[0], belief, self.options.near):
            disputed = self.options.weighed(belief)
            weights = weights_of(disputed.simulators, self.options.floor(belief))
            return search(lambda _, fitnesses: weighted_deviation(fitnesses, weights), parameters=disputed.parameters)
        found = search(lambda _, fitnesses: fitnesses[:, 0], parameters=belief.parameters[:1])
        return transferred[0] if len(transferred) and _near(found, belief, self.options.near) else found


class ResidualOptions(Frozen):
    """Options of the strategy `residual`."""

    near: Near = NEAR


class Residual(Strategy):
    """The controller with the best corrected fitness, or the one whose correction is least certain if that is near.

    The correction is Kriging on what tuning leaves: real less simulated fitness of the samples. Do not use it where
    tuning reproduces the samples: the rest is roughness, which Kriging takes for a trend.
    """

    name = "residual"
    source = "Hemker et al. 2006, 2009, with the simulator as the mean of their Kriging; that is gaplab's"
    Options = ResidualOptions
    options: ResidualOptions

    def select(self, belief: Belief, search: Search, rng: Generator) -> Genome:
        """Return the controller with the highest corrected fitness found, or the least certain one."""
        best, correction = self._fittest(belief, search)
        if correction is not None and _near(best, belief, self.options.near):
            return _summit(correction, 1, belief, rng)
        return best

    def transfer(self, belief: Belief, search: Search, rng: Generator) -> Genome:  # noqa: ARG002 - the port's signature
        """Return the controller with the highest corrected fitness found."""
        return self._fittest(belief, search)[0]

    def _fittest(self, belief: Belief, search: Search) -> tuple[Genome, Posterior | None]:
        """Return the controller with the highest corrected fitness found, and the correction; None if none is known."""
        correction: Posterior | None = None
        samples = np.array([each.genome for each in belief.learnable])
        real = np.array([each.fitness for each in belief.learnable])

        begun = False

        def score(genomes: Genomes, fitnesses: Fitnesses) -> FloatArray:
            nonlocal correction, begun
            simulated = fitnesses[:, 0]
            first = np.flatnonzero(np.isfinite(simulated[: len(real)]))
            if not begun and len(first):  # the search evaluates the samples first
                correction = _kriging(belief.space, genomes[first], real[first] - simulated[first])
            begun = True
            return simulated + correction.predict(genomes)[0] if correction else simulated

        best = search(score, parameters=belief.parameters[:1], start=samples if len(samples) else None)
        return best, correction


def _kriging(space: Space, points: Genomes, values: FloatArray) -> Posterior:
    """Return the posterior with a constant mean, Gaussian correlation and the likeliest length scale within bounds."""
    shortest, longest = (each * space.size**0.5 for each in LENGTHS)
    return GaussianProcess("squared_exponential", (shortest, longest)).given(space, points, values)


def _near(genome: Genome, belief: Belief, share: float) -> bool:
    """Return whether a sample is nearer than this share of the root of the number of genes, in units of the extents."""
    away = [np.linalg.norm(belief.space.apart(genome, sample.genome)) for sample in belief.samples]
    return bool(away) and min(away) < share * belief.space.size**0.5


def _summit(posterior: Posterior, which: int, belief: Belief, rng: Generator) -> Genome:
    """Return the controller with the best prediction (0) or the largest deviation (1), by quadratic programming."""
    import scipy  # a process that never tunes starts without it

    space, unit = belief.space, posterior.variance**0.5

    def height(shares: FloatArray) -> FloatArray:
        points = space.contain(space.lower + space.extent * np.atleast_2d(shares))
        return np.asarray(posterior.predict(points)[which] / unit)

    def slope(shares: FloatArray) -> FloatArray:
        return (height(shares + STEP * np.eye(space.size)) - height(shares)) / STEP

    samples = np.array([(each.genome - space.lower) / space.extent for each in belief.samples])
    places = np.vstack([samples, rng.random((DRAWN, space.size))])
    starts = places[np.argsort(-height(places), kind="stable")[:STARTS]]
    bounds = [(None, None) if wraps else (0.0, 1.0) for wraps in space.periodic]
    climb = partial(scipy.optimize.minimize, lambda at: -height(at)[0], jac=lambda at: -slope(at), method="SLSQP")
    ends = np.array([climb(start, bounds=bounds).x for start in starts])
    reached = np.vstack([starts, ends])
    best: Genome = reached[np.nanargmax(height(reached))]
    return space.contain(space.lower + space.extent * best)
