"""Try what is fittest in a simulator from which controllers transfer well, and learn which simulators those are."""

from functools import lru_cache
from typing import Annotated, ClassVar

import numpy as np
import scipy
from numpy.random import Generator
from pydantic import Field

from gaplab.schemas.base import Frozen
from gaplab.services.core.arrays import FloatArray, Genome
from gaplab.services.core.gaussian_process import GaussianProcess
from gaplab.services.core.registry import Presets
from gaplab.services.core.space import Space
from gaplab.services.core.strategies.base import Search, Strategy
from gaplab.services.core.types import Belief

LENGTH_SCALES = (0.1, 2.0)
"""Bounds of the length scale, in units of the bounds of the tunables."""

POINTS = 10
"""Base-2 logarithm of the number of simulators of which the most promising is taken, evenly spread."""

FINER = (1.0, 0.1)
"""Widths of the boxes that they are spread over, one after another, each around the most promising so far."""


class BayRnOptions(Frozen):
    """Options of the strategy `bayrn`."""

    first: Annotated[int, Field(strict=True, ge=1, le=100)] = Field(
        default=3,
        description="random simulators whose fittest controllers are tried first; the authors': 5, each with 5 "
        "rollouts; gaplab's default suits ten measurements",
    )
    beta: Annotated[float, Field(strict=True, ge=0, le=100)] = Field(
        default=0.25,
        description="the most promising simulator has the highest expected fitness plus √beta standard deviations; "
        "the authors' scripts: 0.1 to 0.25",
    )
    noise: Annotated[float, Field(strict=True, gt=0, le=1)] = Field(
        default=0.05,
        description="variance of the luck of searches and measurements, as a share of that of real fitness over "
        "simulators; gaplab's default; the release fits it",
    )


class BayRn(Strategy):
    """Bayesian domain randomization: the fittest controller in the simulator with the most promising real fitness.

    A Gaussian process models the real fitness of the controller that evolves in a simulator, over the tunables. The
    simulator with the highest upper confidence bound is next. The fittest controller in it is tried, and transferred.
    No simulator is tuned to reproduce samples, so it needs no model of what reality does, only of what transfers.

    Here a simulator is a point; the authors' are distributions. Sample k counts as that of simulator k, so do not use
    it with samples from before, or told by a person. Where tuning finds reality among the simulators,
    `simulated_fit` learns more from each sample. With more than about ten tunables, few samples say little.
    """

    name = "bayrn"
    source = "Muratore et al. 2021, released with SimuRLacra: Matern-5/2 over the unit cube, upper confidence bound"
    tunes = False
    selects_transferred = True
    presets: ClassVar[Presets] = {"muratore_2021": {"first": 5}}
    Options = BayRnOptions
    options: BayRnOptions

    @property
    def ensemble(self) -> int:
        """Return the number of random simulators that come first."""
        return self.options.first

    def selection_simulators(self, tunables: int, *, learned: bool) -> int:  # noqa: ARG002 - the port's signature
        """Return one: a controller evolves in one simulator."""
        return 1

    def select(self, belief: Belief, search: Search, rng: Generator) -> Genome:  # noqa: ARG002 - the port's signature
        """Return the fittest controller found in the most promising simulator."""
        return search(lambda _, fitnesses: fitnesses[:, 0], parameters=self.promising(belief)[None, :])

    def transfer(self, belief: Belief, search: Search, rng: Generator) -> Genome:
        """Return the fittest controller found in the most promising simulator."""
        return self.select(belief, search, rng)

    def promising(self, belief: Belief) -> FloatArray:
        """Return the next simulator `(p,)`, which follows from the first ones and the samples alone.

        The simulators of all samples are found again, one by one, since nothing but samples is kept.
        """
        simulators = [tuple(each.parameters.tolist()) for each in belief.simulators]
        values = tuple(each.fitness for each in belief.samples)
        while len(simulators) <= len(values):
            simulators.append(_after(tuple(simulators), values[: len(simulators)], belief.tunables, self.options))
        return np.array(simulators[len(values)])


@lru_cache(maxsize=256)  # a sample costs one fit, not one for each sample so far
def _after(
    simulators: tuple[tuple[float, ...], ...], values: tuple[float, ...], tunables: Space, options: BayRnOptions
) -> tuple[float, ...]:
    """Return the simulator after these, whose controllers have the real fitnesses `values`; nan: it failed."""
    sound = np.isfinite(values)
    if not sound.any():
        return simulators[-1]
    known = GaussianProcess("matern52", LENGTH_SCALES, options.noise)
    posterior = known.given(tunables, np.array(simulators)[sound], np.array(values)[sound])
    spread = scipy.stats.qmc.Sobol(tunables.size, scramble=False).random_base2(POINTS)
    best = np.full(tunables.size, 0.5)
    for width in FINER:
        shares = np.clip(best + width * (spread - 0.5), 0.0, 1.0)
        mean, deviation = posterior.predict(tunables.at(shares))
        best = shares[np.argmax(mean + options.beta**0.5 * deviation)]
    return tuple(tunables.at(best).tolist())
