"""What a robot says of a trajectory, and what is made of it."""

from typing import Any

import numpy as np
import pytest

from gaplab.services.core.answers import Answers
from gaplab.services.core.robots.toy_function import ToyFunction
from gaplab.services.engines.analytic import Analytic
from gaplab.services.specs.assembly import MeasuredReality
from gaplab.services.specs.simulation import Simulation


class Endless(ToyFunction):
    """A robot whose fitness is no number on the right of its space."""

    name = "endless"

    def __init__(self, worth: Any) -> None:
        super().__init__()
        self.worth = worth

    def fitness(self, trajectory: Any) -> Any:
        travelled = super().fitness(trajectory)
        return np.where(travelled > 0.3, self.worth, travelled)


@pytest.mark.parametrize("worth", [np.inf, -np.inf, np.nan])
def test_a_fitness_that_is_not_finite_is_physics_that_failed_in_simulation_and_in_reality(worth: Any) -> None:
    whole, broken = (Simulation(robot, Analytic(), ()) for robot in (ToyFunction(), Endless(worth)))
    genomes, parameters = np.linspace(0.0, 1.0, 50)[:, None], np.empty((1, 0))
    answers = Answers(broken)

    fitnesses, expected = answers(genomes, parameters), whole(genomes, parameters)

    failed = expected > 0.3
    assert failed.any()
    assert not failed.all()
    np.testing.assert_array_equal(fitnesses, np.where(failed, np.nan, expected))
    assert answers.cost_of(50).failures == failed.sum()
    assert np.isnan(MeasuredReality(broken, np.empty(0))(genomes[failed[:, 0]][0]).fitness)
