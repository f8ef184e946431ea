"""Who leaves the population, against independent oracles."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymoo.algorithms.soo.nonconvex.ga import FitnessSurvival
from pymoo.core.population import Population as PymooPopulation
from pymoo.core.problem import Problem

from gaplab.services.core.optimizers.base import Population
from gaplab.services.core.optimizers.steady_state import least_fit, less_fit_of_most_similar
from gaplab.services.core.space import Space

SPACE = Space.box([0.0, 0.0], [1.0, 10.0])
PHASE = Space.box([-1.0, 0.0], [3.0, 10.0], [True, False])


def population(seed: Any, size: Any = 9, space: Any = SPACE) -> Any:
    rng = np.random.default_rng(seed)
    return Population(space, space.draw(size, rng), rng.normal(size=size))


@pytest.mark.parametrize("seed", range(20))
def test_the_least_fit_leaves_as_in_pymoo(seed: Any) -> None:
    members = population(seed)
    theirs = PymooPopulation.new("X", members.genomes, "F", -members.fitness[:, None])

    survivors = FitnessSurvival().do(Problem(n_var=2, n_obj=1), theirs, n_survive=members.size - 1)

    kept = np.delete(members.genomes, least_fit(members), axis=0)
    assert {tuple(each) for each in survivors.get("X")} == {tuple(each) for each in kept}


def brute_force(members: Any) -> Any:
    """Every pair, one by one, in units of the space's extent; a phase also with a turn more and a turn less."""
    pairs = [(i, j) for i in range(members.size) for j in range(i)]
    scaled = members.genomes / members.space.extent
    turns = [turn * members.space.periodic for turn in (-1, 0, 1)]

    def distance(pair: Any) -> Any:
        return min(float(np.linalg.norm(scaled[pair[0]] - scaled[pair[1]] + turn)) for turn in turns)

    nearest = min(pairs, key=distance)
    return min(nearest, key=lambda index: (members.fitness[index], index))


@settings(max_examples=200)
@given(st.integers(0, 10**6), st.integers(2, 12), st.sampled_from([SPACE, PHASE]))
def test_the_less_fit_of_the_most_similar_pair_leaves_as_in_a_brute_force(seed: Any, size: Any, space: Any) -> None:
    members = population(seed, size, space)

    assert less_fit_of_most_similar(members) == brute_force(members)


def test_phases_on_both_sides_of_a_turn_are_near() -> None:
    members = Population(PHASE, np.array([[-0.99, 5], [1.0, 5], [1.5, 5], [2.99, 5]]), np.array([1.0, 2, 0, 3]))

    assert less_fit_of_most_similar(members) == 0


def test_the_fittest_never_leaves_a_diverse_population_even_if_all_are_near_it() -> None:
    genomes = np.vstack([[[0.5, 5.0]], np.full((5, 2), [0.5, 5.001])])
    members = Population(SPACE, genomes, np.array([9.0, 1, 2, 3, 4, 5]))

    assert less_fit_of_most_similar(members) != 0


def test_of_equals_the_oldest_leaves_so_newcomers_drift_in() -> None:
    members = Population(SPACE, np.array([[0.1, 1], [0.2, 2], [0.3, 3]]), np.array([1.0, 1.0, 1.0]))

    assert least_fit(members) == 0


def test_of_two_equal_copies_the_older_leaves() -> None:
    members = Population(SPACE, np.array([[0.9, 9], [0.2, 2], [0.2, 2]]), np.array([0.0, 1.0, 1.0]))

    assert less_fit_of_most_similar(members) == 1
