"""The paper's tuner."""

from numpy.random import Generator

from gaplab.services.core.search import maximise
from gaplab.services.core.tuners.base import Task, Tuner
from gaplab.services.core.types import Simulator


class SearchTuner(Tuner):
    """A search from scratch with the spec's optimizer, which keeps different simulators if an ensemble is wanted.

    The optimizer maximises minus the discrepancy. It ranks simulators as the paper's 1/Σe² does, and is finite at a
    perfect fit.
    """

    name = "search"
    source = "Paper, section 2"

    def tune(self, task: Task, rng: Generator) -> tuple[Simulator, ...]:
        """Return the best simulators of the final population."""
        found = maximise(task.optimizer, task.space, task.misfit, task.evaluations, rng)
        ranked = zip(found.genomes, found.fitness, strict=True)
        return tuple(Simulator(parameters, float(-value)) for parameters, value in ranked)[: task.ensemble]
