"""Huber's loss of fitness."""

import numpy as np
import pytest

from gaplab.services.core.arrays import NO_READINGS
from gaplab.services.core.discrepancies.base import Discrepancy
from gaplab.services.core.discrepancies.fitness import Huber, HuberOptions, SquaredFitness

FITNESSES = np.linspace(0.0, 40.0, 4001)
"""One of each simulator, the same for every sample."""


@pytest.mark.parametrize(("discrepancy", "found"), [(SquaredFitness(), 10.53), (Huber(), 0.325)])
def test_a_mistyped_fitness_moves_squares_and_hardly_this_loss(discrepancy: Discrepancy, found: float) -> None:
    measured = np.array([[0.31], [31.0], [0.29]])
    simulated = np.broadcast_to(FITNESSES[None, :, None], (3, len(FITNESSES), 1))

    total = discrepancy.terms(simulated, measured, NO_READINGS).sum(axis=0)

    assert FITNESSES[np.argmin(total)] == pytest.approx(found, abs=0.006)


@pytest.mark.parametrize("error", [0.0, 0.05, 0.1, 0.5, 30.0])
def test_an_error_is_that_of_one_sample_alone(error: float) -> None:
    huber = Huber(HuberOptions(beyond=0.1))

    assert huber.error(huber.floor(error)) == pytest.approx(error)
