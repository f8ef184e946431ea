"""The tuner of the estimation-exploration algorithm."""

from typing import Annotated

import numpy as np
from numpy.random import Generator
from pydantic import Field

from gaplab.schemas.base import Frozen
from gaplab.services.core.answers import nothing
from gaplab.services.core.arrays import FloatArray, Parameters
from gaplab.services.core.search import Question
from gaplab.services.core.tuners.base import Tuner, TuningTask
from gaplab.services.core.types import Simulator


class ClimbersOptions(Frozen):
    """Options of the climbers."""

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
