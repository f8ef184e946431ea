"""The parallel climbers."""

from typing import Any

import numpy as np
import pytest

from gaplab.services.core.answers import Answers
from gaplab.services.core.optimizers.steady_state import SteadyState
from gaplab.services.core.space import Space
from gaplab.services.core.tuners.base import TuningTask
from gaplab.services.core.tuners.search import Climbers, ClimbersOptions
from gaplab.services.core.tuning import Misfit
from gaplab.services.core.types import Sample, Simulator
from tests.fakes import TRUTH, Recorder, paraboloid

SPACE = Space.box([0.0, 0.0], [1.0, 1.0])
GENOMES = np.random.default_rng(3).random((6, 2))
SAMPLES = [Sample(genome, float(paraboloid(genome[None], TRUTH[None])[0, 0])) for genome in GENOMES]


def climbed(evaluations: Any, previous: Any = (), ensemble: Any = 5, simulate: Any = paraboloid) -> Any:
    misfit = Misfit(Answers(simulate), SAMPLES)
    task = TuningTask(misfit, SPACE, SteadyState(), ensemble, evaluations, tuple(previous))
    return Climbers().tune(task, np.random.default_rng(1))


def test_all_climbers_approach_the_parameters_of_reality_and_come_best_first() -> None:
    found = climbed(1_500)

    errors = [each.squared_error for each in found]
    assert errors == sorted(errors)
    for simulator in found:
        np.testing.assert_allclose(simulator.parameters, TRUTH, atol=0.05)


def test_climbers_continue_from_the_tuning_before_and_never_get_worse() -> None:
    before = climbed(20)

    after = climbed(100, before)

    pairs = zip(before, sorted(after, key=lambda each: each.squared_error), strict=True)
    assert all(new.squared_error <= old.squared_error for old, new in pairs)
    assert [flat.tolist() for flat in (each.parameters for each in climbed(5, before))] == [
        each.parameters.tolist() for each in before
    ]


@pytest.mark.parametrize("evaluations", [3, 5, 8, 100])
def test_the_evaluations_are_the_most_that_are_spent_and_hopeless_children_are_given_up(evaluations: Any) -> None:
    simulate = Recorder()

    found = climbed(evaluations, [Simulator(np.array([0.2, 0.2]))], simulate=simulate)

    assert len(found) == 5
    assert simulate.rollouts <= evaluations * len(SAMPLES)
    assert evaluations < 100 or simulate.rollouts < 0.8 * evaluations * len(SAMPLES)


def test_a_child_replaces_its_parent_only_if_it_is_strictly_better() -> None:
    def flat(genomes: Any, parameters: Any) -> Any:
        return np.zeros((len(genomes), len(parameters)))

    start = [Simulator(np.array([0.2, 0.2 + 0.1 * number])) for number in range(5)]

    assert [each.parameters.tolist() for each in climbed(50, start, simulate=flat)] == [
        each.parameters.tolist() for each in start
    ]


def test_where_the_physics_fails_a_climber_moves_on() -> None:
    def half_broken(genomes: Any, parameters: Any) -> Any:
        return np.where(parameters[None, :, 0] < 0.5, np.nan, paraboloid(genomes, parameters))

    best = climbed(800, [Simulator(np.array([0.3, 0.3]))], simulate=half_broken)[0]

    assert best.parameters[0] >= 0.5


def test_a_child_has_up_to_so_many_mutations() -> None:
    row = np.zeros(50)

    Climbers(ClimbersOptions(mutations=2))._mutate(row, np.random.default_rng(0))

    assert 1 <= np.count_nonzero(row) <= 2
