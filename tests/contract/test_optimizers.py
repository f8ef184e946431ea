"""What every optimizer promises, the day its file is there."""

from typing import Any

import numpy as np
import pytest

from gaplab.services.core.optimizers import optimizers
from gaplab.services.core.optimizers.steady_state import SteadyState, SteadyStateOptions
from gaplab.services.core.search import maximise
from gaplab.services.core.types import Space

SPACE = Space.box([0.0, -2.0, 0.0], [1.0, 2.0, 5.0], [True, False, False])
SUMMIT = np.array([0.9, 0.5, 4.0])


class Hill:
    """A concave fitness with its summit inside the box; it remembers how it was asked."""

    def __init__(self, transform: Any = lambda fitness: fitness) -> None:
        self.transform = transform
        self.asked = []  # type: ignore[var-annotated]

    def __call__(self, question: Any) -> Any:
        self.asked.append(question.genomes.copy())
        return self.of(question.genomes)

    def of(self, genomes: Any) -> Any:
        return self.transform(-(((genomes - SUMMIT) / SPACE.extent) ** 2).sum(axis=1))


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

    def test_asks_only_within_the_box(self, name: Any) -> None:
        hill = Hill()

        search(name, hill)

        asked = np.vstack(hill.asked)
        assert np.all((asked >= SPACE.lower) & (asked <= SPACE.upper))

    def test_climbs_the_hill(self, name: Any) -> None:
        found = search(name, Hill(), 2000)

        np.testing.assert_allclose(found.genomes[0], SUMMIT, atol=0.02 * SPACE.extent.max())

    def test_returns_its_members_best_first_with_their_own_fitness(self, name: Any) -> None:
        found = search(name, Hill())

        np.testing.assert_array_equal(found.fitness, np.sort(found.fitness)[::-1])
        np.testing.assert_allclose(found.fitness, Hill().of(found.genomes))

    def test_never_loses_the_best_it_was_told(self, name: Any) -> None:
        hill = Hill()

        found = search(name, hill)

        assert found.fitness[0] == Hill().of(np.vstack(hill.asked)).max()

    def test_repeats_itself_for_the_same_stream(self, name: Any) -> None:
        np.testing.assert_array_equal(search(name, Hill()).genomes, search(name, Hill()).genomes)

    def test_compares_by_rank_alone(self, name: Any) -> None:
        plain = search(name, Hill())
        transformed = search(name, Hill(lambda fitness: np.exp(3 * fitness) - 7))

        np.testing.assert_array_equal(plain.genomes, transformed.genomes)

    def test_nan_never_wins(self, name: Any) -> None:
        found = search(name, Hill(lambda fitness: np.where(fitness > -0.05, np.nan, fitness)), 500)

        assert np.isfinite(found.fitness[0])
        assert found.fitness[0] <= -0.05

    @pytest.mark.parametrize("endless", [np.inf, -np.inf])
    def test_what_is_infinite_never_wins(self, name: Any, endless: Any) -> None:
        found = search(name, Hill(lambda fitness: np.where(fitness > -0.05, endless, fitness)), 500)

        assert np.isfinite(found.fitness[0])
        assert found.fitness[0] <= -0.05

    def test_goes_on_where_everything_fails(self, name: Any) -> None:
        found = search(name, Hill(lambda fitness: np.full_like(fitness, np.nan)))

        assert np.all(np.isneginf(found.fitness))

    def test_leaves_the_state_it_was_given_as_it_was(self, name: Any) -> None:
        optimizer, rng = optimizers[name](), np.random.default_rng(0)
        state = optimizer.init(SPACE)
        state = optimizer.tell(state, *(lambda genomes: (genomes, Hill().of(genomes)))(optimizer.ask(state, rng)))
        before = state.genomes.copy(), state.fitness.copy()

        genomes = optimizer.ask(state, rng)
        optimizer.tell(state, genomes, np.full(len(genomes), 1e9))

        np.testing.assert_array_equal(state.genomes, before[0])
        np.testing.assert_array_equal(state.fitness, before[1])

    def test_keeps_as_many_diverse_members_as_it_is_asked_to(self, name: Any) -> None:
        found = maximise(optimizers[name]().diverse(9), SPACE, Hill(), 200, np.random.default_rng(0))

        assert found.size == 9
        assert len(np.unique(found.genomes, axis=0)) == 9


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
