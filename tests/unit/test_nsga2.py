"""What NSGA-II promises beyond the contract of every optimizer."""

import numpy as np
import pytest
from pymoo.operators.survival.rank_and_crowding.metrics import calc_crowding_distance
from pymoo.util.nds.non_dominated_sorting import NonDominatedSorting

from gaplab.services.core.optimizers.nsga2 import Nsga2, Nsga2Options, crowding, fronts
from gaplab.services.core.search import maximise
from gaplab.services.core.space import Space


@pytest.mark.parametrize("objectives", [1, 2, 3])
def test_fronts_and_crowding_are_those_of_pymoo(objectives: int) -> None:
    fitness = np.random.default_rng(objectives).random((40, objectives))

    ranks = fronts(fitness)

    for rank, front in enumerate(NonDominatedSorting().do(-fitness)):
        assert sorted(front) == np.flatnonzero(ranks == rank).tolist()
        expected = calc_crowding_distance(-fitness[front]) * objectives
        if len(front) > 1:
            np.testing.assert_allclose(crowding(fitness, ranks)[front], expected)


def test_the_front_between_two_summits_is_found_and_covered() -> None:
    space = Space.box([-5.0, 0.0], [5.0, 1.0], [False, True])

    found = maximise(
        Nsga2(),
        space,
        lambda asked: -np.column_stack([asked.genomes[:, 0] ** 2, (asked.genomes[:, 0] - 2) ** 2]),
        2_000,
        np.random.default_rng(1),
    )

    first = found.genomes[:, 0]
    assert ((first > -0.1) & (first < 2.1)).all()
    assert np.diff(np.sort(first)).max() < 0.3
    assert np.array_equal(found.fitness[:, 0], np.sort(found.fitness[:, 0])[::-1])


def test_a_member_that_fails_in_one_objective_is_on_the_last_front() -> None:
    optimizer = Nsga2(Nsga2Options(population=4))
    fail = lambda asked: np.where(asked.genomes < 0.5, np.nan, asked.genomes) * [1.0, -1.0]  # noqa: E731

    found = maximise(optimizer, Space.box([0.0], [1.0]), fail, 80, np.random.default_rng(0))

    assert (found.genomes >= 0.5).all()
