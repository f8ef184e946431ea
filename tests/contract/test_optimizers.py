"""How optimizers spend their budget, and what the paper's does; test_contract.py asks what every optimizer does."""

from typing import Any

import numpy as np
import pytest

from gaplab.services.contract.optimizers import SPACE, Hill
from gaplab.services.core.optimizers import optimizers
from gaplab.services.core.optimizers.steady_state import SteadyState, SteadyStateOptions
from gaplab.services.core.search import maximise
from gaplab.services.core.space import Space


class Watched:
    """An optimizer that remembers what it was told."""

    def __init__(self, optimizer: Any) -> None:
        self.optimizer = optimizer
        self.told = []  # type: ignore[var-annotated]

    def __getattr__(self, name: Any) -> Any:
        return getattr(self.optimizer, name)

    def tell(self, state: Any, genomes: Any, fitness: Any) -> Any:
        self.told.append(genomes)
        return self.optimizer.tell(state, genomes, fitness)


class GivingUp(Hill):
    """The hill, but -inf for every fitness below its threshold."""

    def __call__(self, question: Any) -> Any:
        fitness = super().__call__(question)
        return np.where(fitness < question.thresholds, -np.inf, fitness)


def search(name: Any, evaluate: Any, evaluations: Any = 300, seed: Any = 3) -> Any:
    return maximise(optimizers[name](), SPACE, evaluate, evaluations, np.random.default_rng(seed))


@pytest.mark.parametrize("name", sorted(optimizers))
class TestEveryOptimizer:
    @pytest.mark.parametrize("evaluations", [1, 19, 20, 21, 57, 300])
    def test_spends_exactly_its_budget_less_what_it_would_evaluate_again(self, name: Any, evaluations: Any) -> None:
        hill, optimizer = Hill(), Watched(optimizers[name]())

        maximise(optimizer, SPACE, hill, evaluations, np.random.default_rng(3))  # type: ignore[arg-type]

        told = np.vstack(optimizer.told)
        assert len(told) == evaluations
        assert sum(map(len, hill.asked)) == len(np.unique(told, axis=0))

    @pytest.mark.parametrize("diverse", [False, True])
    def test_fitness_below_a_threshold_changes_nothing(self, name: Any, diverse: Any) -> None:
        def search_on(hill: Any) -> Any:
            optimizer = optimizers[name]().diverse(9) if diverse else optimizers[name]()
            return maximise(optimizer, SPACE, hill, 400, np.random.default_rng(3))

        exact, given = search_on(Hill()), search_on(GivingUp())

        np.testing.assert_array_equal(exact.genomes, given.genomes)
        np.testing.assert_array_equal(exact.fitness, given.fitness)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("name", sorted(optimizers))
@pytest.mark.parametrize("size", [1, 2])
def test_spaces_of_one_and_two_genes_are_searched_too(name: Any, size: Any) -> None:
    space = Space.box([0.0] * size, [1.0] * size)

    found = maximise(
        optimizers[name](),
        space,
        lambda asked: -((asked.genomes - 0.3) ** 2).sum(axis=1),
        400,
        np.random.default_rng(0),
    )

    assert found.fitness[0] > -1e-3


def test_the_papers_evolution_adds_one_newcomer_at_a_time() -> None:
    hill = Hill()

    search("steady_state", hill, 60)

    assert [len(each) for each in hill.asked] == [20] + [1] * 40


def test_a_newcomer_always_differs_from_every_member() -> None:
    optimizer, rng = SteadyState(SteadyStateOptions(mutation=0.001)), np.random.default_rng(0)
    state = optimizer.init(SPACE)
    genomes = optimizer.ask(state, rng)
    state = optimizer.tell(state, genomes, Hill().of(genomes))

    newcomers = [optimizer.ask(state, rng)[0] for _ in range(100)]

    assert not any(np.any(np.all(state.genomes == newcomer, axis=1)) for newcomer in newcomers)


def test_members_are_of_two_parents_gene_by_gene() -> None:
    optimizer = SteadyState(SteadyStateOptions(crossover=1.0, mutation_scale=1e-9, finest_scale=1e-9))
    rng = np.random.default_rng(0)
    state = optimizer.init(SPACE)
    genomes = optimizer.ask(state, rng)
    state = optimizer.tell(state, genomes, Hill().of(genomes))

    newcomer = optimizer.ask(state, rng)[0]

    assert all(np.any(np.isclose(state.genomes[:, gene], newcomer[gene])) for gene in range(SPACE.size))
