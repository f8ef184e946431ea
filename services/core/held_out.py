"""Held-out samples: measurements that no tuning sees, so that the error of simulators on them is an honest one.

Source: gaplab; cross-validation.
"""

from collections.abc import Sequence
from dataclasses import replace

from gaplab.services.core.arrays import known
from gaplab.services.core.tuning import Misfit
from gaplab.services.core.types import Sample, Simulator

ROUNDING = 1e-9


def is_held_out(number: int, share: float) -> bool:
    """Return whether sample `number`, from 1, is held out: each fifth with a share of 0.2.

    Samples from before the experiment are the first. It depends on nothing else, so an experiment that is extended
    holds out the same samples.
    """
    return int(number * share + ROUNDING) > int((number - 1) * share + ROUNDING)


def seen_of(samples: int, share: float) -> int:
    """Return how many of the first samples tuning sees."""
    return sum(not is_held_out(number, share) for number in range(1, samples + 1))


def split(samples: Sequence[Sample], share: float) -> tuple[tuple[Sample, ...], tuple[Sample, ...]]:
    """Return the samples that tuning sees, and those that it does not see.

    Args:
        samples: all samples of the repetition, in the order of measurement.
        share: share of them to hold out.
    """
    seen = tuple(each for number, each in enumerate(samples, 1) if not is_held_out(number, share))
    return seen, tuple(each for number, each in enumerate(samples, 1) if is_held_out(number, share))


def tested(simulators: Sequence[Simulator], misfit: Misfit) -> tuple[Simulator, ...]:
    """Return the simulators, of which the best knows its discrepancy from held-out samples.

    Args:
        simulators: tuned on other samples, best first.
        misfit: discrepancy from the held-out samples.
    """
    best, *others = simulators
    error = float(misfit.of(best.parameters[None, :])[0])
    return (replace(best, held_out_error=known(error)), *others)
