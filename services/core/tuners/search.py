"""Tuners that search: the paper's, and that of the estimation-exploration algorithm."""

from typing import Annotated, ClassVar

import numpy as np
from numpy.random import Generator
from pydantic import Field

from gaplab.schemas.base import Frozen
from gaplab.services.core.answers import nothing
from gaplab.services.core.arrays import FloatArray, Parameters
from gaplab.services.core.registry import Presets
from gaplab.services.core.search import Question, maximise
from gaplab.services.core.tuners.base import Tuner, TuningTask
from gaplab.services.core.types import Simulator


class SearchOptions(Frozen):
    """Options of the tuner `search`, the paper's."""

    warm_start: bool = Field(
        default=False,
        strict=True,
        description="begin with the simulators of the tuning before, evaluated again on all samples, in place of as "
        "many random ones; the optimizer must accept genomes that it did not ask for; off: as in the paper",
    )
    equal_rollouts: bool = Field(
        default=False,
        strict=True,
        description="divide the evaluations by the number of samples, so that each tuning takes as many rollouts as "
        "that on a single sample; off: as in the paper",
    )


class SearchTuner(Tuner):
    """A search from scratch with the spec's optimizer, which keeps different simulators if an ensemble is wanted.

    The optimizer maximises minus the discrepancy. It ranks simulators as the paper's 1/Σe² does, and is finite at a
    perfect fit. A warm start replaces the random simulators that a search begins with by those of the tuning before.
    With equal rollouts, a tuning on ten samples costs no more than one on a single sample.
    """

    name = "search"
    source = "Paper, section 2; warm starts and equal rollouts are gaplab's"
    presets: ClassVar[Presets] = {"lean": {"equal_rollouts": True}}
    Options = SearchOptions
    options: SearchOptions

    def divisor(self, samples: int) -> int:
        """Return the number of samples if tunings take equal rollouts, else 1."""
        return max(samples, 1) if self.options.equal_rollouts else 1

    def tune(self, task: TuningTask, rng: Generator) -> tuple[Simulator, ...]:
        """Return the best simulators of the final population."""
        before = [each.parameters for each in task.previous[: task.ensemble]]
        start = np.array(before) if self.options.warm_start and before else None
        found = maximise(task.optimizer, task.space, task.misfit, task.evaluations, rng, start)
        ranked = zip(found.genomes, found.fitness, strict=True)
        return tuple(Simulator(parameters, float(-value)) for parameters, value in ranked)[: task.ensemble]


class ClimbersOptions(Frozen):
    """Options of the tuner `climbers`."""

    mutations: Annotated[int, Field(strict=True, ge=1, le=100)] = Field(
        default=4, description="most mutations of a child, each of a tunable drawn at random; the authors': 1 to 4"
    )
    scale: Annotated[float, Field(strict=True, gt=0, le=1)] = Field(
        default=0.1, description="standard deviation of a mutation, as a share of the bounds; gaplab's default"
    )


class Climbers(Tuner):
    """Parallel climbers, one for each simulator of the ensemble, which continue from the tuning before.

    A child replaces its parent only if its discrepancy is strictly less. It is given up as soon as its sum reaches that
    of its parent. The climbers never meet, so their simulators stay different.
    """

    name = "climbers"
    source = "Bongard and Lipson 2005, as released: a child of 1 to 4 mutations for each of 15 models"
    Options = ClimbersOptions
    options: ClimbersOptions

    def tune(self, task: TuningTask, rng: Generator) -> tuple[Simulator, ...]:
        """Return where the climbers have arrived, best first."""
        parents = self._starts(task, rng)
        errors = np.full(len(parents), np.inf)
        errors[: task.evaluations] = task.misfit.of(parents[: task.evaluations])
        left = task.evaluations - len(parents)
        while left > 0:
            children = self._children(task, parents, rng)[:left]
            found = -task.misfit(Question(children, -errors[: len(children)], nothing))
            better = np.flatnonzero(found < errors[: len(children)])
            parents[better], errors[better] = children[better], found[better]
            left -= len(children)
        return tuple(Simulator(parents[index], float(errors[index])) for index in np.argsort(errors, kind="stable"))

    def _starts(self, task: TuningTask, rng: Generator) -> Parameters:
        """Return the simulators of the tuning before, and random ones for those that are missing."""
        before = np.array([each.parameters for each in task.previous]).reshape(-1, task.space.size)[: task.ensemble]
        return np.vstack([before, task.space.draw(task.ensemble - len(before), rng)])

    def _children(self, task: TuningTask, parents: Parameters, rng: Generator) -> Parameters:
        """Return a child of each parent, `(m, p)`."""
        steps = np.zeros_like(parents)
        for row in steps:
            self._mutate(row, rng)
        return task.space.contain(parents + self.options.scale * task.space.extent * steps)

    def _mutate(self, row: FloatArray, rng: Generator) -> None:
        count = int(rng.integers(1, self.options.mutations, endpoint=True))
        np.add.at(row, rng.integers(len(row), size=count), rng.standard_normal(count))
