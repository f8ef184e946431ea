"""The paper's tuner."""

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
from numpy.random import Generator
from pydantic import Field

from gaplab.schemas.base import Frozen
from gaplab.services.core.search import maximise
from gaplab.services.core.tuners.base import Tuner, TuningTask
from gaplab.services.core.types import Simulator


class SearchOptions(Frozen):
    """Options of the paper's tuner."""

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
    lean: ClassVar[Mapping[str, Any]] = {"equal_rollouts": True}
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
