"""The contract of a tuner: from samples to simulators that reproduce them."""

from abc import abstractmethod
from dataclasses import dataclass
from typing import ClassVar

from numpy.random import Generator

from gaplab.services.core.arrays import FloatArray, Parameters
from gaplab.services.core.optimizers.base import Optimizer
from gaplab.services.core.registry import Plugin
from gaplab.services.core.space import Space
from gaplab.services.core.tuning import Misfit
from gaplab.services.core.types import Simulator


@dataclass(frozen=True, eq=False)
class TuningTask:
    """What a tuner has to do, and with what.

    Attributes:
        misfit: says how much simulators differ from reality on all samples.
        space: bounds of the tunables.
        optimizer: the spec's optimizer; it keeps an ensemble of different simulators if one is wanted.
        ensemble: number of simulators wanted.
        evaluations: most simulators to evaluate, each on all samples.
        previous: simulators of the tuning before, best first; random ones at first.
    """

    misfit: Misfit
    space: Space
    optimizer: Optimizer
    ensemble: int
    evaluations: int
    previous: tuple[Simulator, ...]


class Tuner(Plugin):
    """Finds simulators that reproduce the samples.

    Attributes:
        needs_squares: true if it needs a discrepancy that is a sum of squares.
        intervals: true if it gives 95 % intervals of the tunables.
    """

    needs_squares: ClassVar[bool] = False
    intervals: ClassVar[bool] = False
    catalogued = ("needs_squares", "intervals")

    @abstractmethod
    def tune(self, task: TuningTask, rng: Generator) -> tuple[Simulator, ...]:
        """Return `task.ensemble` simulators, the best estimate first."""

    def least_evaluations(self, optimizer: Optimizer, ensemble: int) -> int:
        """Return the fewest evaluations of a tuning; by default the population that the optimizer starts with."""
        return (optimizer.diverse(ensemble) if ensemble > 1 else optimizer).least_evaluations

    def divisor(self, samples: int) -> int:  # noqa: ARG002 - for those that need it
        """Return by what `simulator_evaluations` is divided for a tuning on so many samples; by default 1."""
        return 1


def equally_probable(parameters: Parameters, errors: FloatArray, interval: FloatArray) -> tuple[Simulator, ...]:
    """Return simulators `(m, p)` with their discrepancies `(m,)`; the first is the estimate, and has the interval."""
    weight = 1.0 / len(parameters)
    first, *others = zip(parameters, errors.tolist(), strict=True)
    return (Simulator(*first, interval, weight), *(Simulator(*each, None, weight) for each in others))
