"""The contract of an optimizer."""

from collections.abc import Callable
from functools import partial

import numpy as np

from gaplab.services.contract.promises import check_repeats
from gaplab.services.core.arrays import FloatArray, Genomes, frozen
from gaplab.services.core.optimizers.base import Optimizer, Population
from gaplab.services.core.search import Question, maximise
from gaplab.services.core.space import Space

SPACE = Space.box([0.0, -2.0, 0.0], [1.0, 2.0, 5.0], [True, False, False])
SUMMIT = frozen([0.9, 0.5, 4.0])
Plugin = type[Optimizer]


class Hill:
    """A concave fitness with its summit inside the box; it remembers how it was asked."""

    def __init__(self, transform: Callable[[FloatArray], FloatArray] = lambda fitness: fitness) -> None:
        self.transform = transform
        self.asked: list[Genomes] = []

    def __call__(self, question: Question) -> FloatArray:
        """Return the fitness of the genomes that are asked for."""
        self.asked.append(question.genomes.copy())
        return self.of(question.genomes)

    def of(self, genomes: Genomes) -> FloatArray:
        """Return the fitness `(n,)` of genomes `(n, 3)`."""
        return self.transform(-(((genomes - SUMMIT) / SPACE.extent) ** 2).sum(axis=1))


def searched(plugin: Plugin, hill: Hill, evaluations: int = 300) -> Population:
    """Return what a new optimizer finds on a hill."""
    return maximise(plugin(), SPACE, hill, evaluations, np.random.default_rng(3))


def numbers(optimizer: Optimizer, seed: int, members: int = 0) -> FloatArray:
    """Return all that an optimizer asks for and finds on a hill, as one vector; with members, of its diverse one."""
    hill = Hill()
    searching = optimizer.diverse(members) if members else optimizer
    found = maximise(searching, SPACE, hill, 200, np.random.default_rng(seed))
    return np.concatenate([np.ravel(each) for each in (*hill.asked, found.genomes, found.fitness)])


def asks_within_the_box(plugin: Plugin) -> None:
    """Asks only for genomes within the bounds."""
    hill = Hill()
    searched(plugin, hill)
    asked = np.vstack(hill.asked)
    assert np.all((asked >= SPACE.lower) & (asked <= SPACE.upper)), "it asks for genomes outside the bounds"


def climbs_the_hill(plugin: Plugin) -> None:
    """Finds the summit of a concave hill in 2,000 evaluations."""
    found = searched(plugin, Hill(), 2000).genomes[0]
    near = np.allclose(found, SUMMIT, atol=0.02 * SPACE.extent.max())
    assert near, f"it finds {found.tolist()}; the summit is at {SUMMIT.tolist()}"


def returns_members_best_first(plugin: Plugin) -> None:
    """Returns its members best first, each with its own fitness."""
    found = searched(plugin, Hill())
    assert np.array_equal(found.fitness, np.sort(found.fitness)[::-1]), "its members are not sorted, best first"
    assert np.allclose(found.fitness, Hill().of(found.genomes)), "its members have the fitness of others"


def keeps_the_best(plugin: Plugin) -> None:
    """Keeps the best genome that it was told."""
    hill = Hill()
    found, best = searched(plugin, hill).fitness[0], Hill().of(np.vstack(hill.asked)).max()
    assert found == best, f"it was told a fitness of {best} and returns {found}"


def repeats_itself(plugin: Plugin) -> None:
    """Finds the same with the same random stream, whatever it searched before."""
    questions = {
        "a search": partial(numbers, seed=3),
        "a search with another stream": partial(numbers, seed=4),
        "a search for diverse members": partial(numbers, seed=3, members=9),
    }
    check_repeats(plugin, questions, "use only `rng`, and keep nothing but the population from one call for the next")


def compares_by_rank(plugin: Plugin) -> None:
    """Compares fitness by rank alone."""
    plain, bent = (searched(plugin, hill).genomes for hill in (Hill(), Hill(lambda fitness: np.exp(3 * fitness) - 7)))
    assert np.array_equal(plain, bent), "an ascending transformation of fitness changes what it finds"


def lets_nan_never_win(plugin: Plugin) -> None:
    """Ranks a candidate whose fitness is nan or infinite below all others."""
    for bad in (np.nan, np.inf, -np.inf):
        hill = Hill(partial(_spoilt, bad=bad))
        found = searched(plugin, hill, 500)
        finite = np.isfinite(found.fitness[0]) and found.fitness[0] <= -0.05
        assert finite, f"where fitness is {bad} near the summit, its best is {found.fitness[0]}"


def _spoilt(fitness: FloatArray, bad: float) -> FloatArray:
    return np.where(fitness > -0.05, bad, fitness)


def goes_on_where_everything_fails(plugin: Plugin) -> None:
    """Goes on where the fitness of every genome is nan."""
    found = searched(plugin, Hill(lambda fitness: np.full_like(fitness, np.nan)))
    assert np.all(np.isneginf(found.fitness)), "members whose fitness is nan must have -inf"


def leaves_the_given_state(plugin: Plugin) -> None:
    """Leaves the state that it was given unchanged."""
    optimizer, rng = plugin(), np.random.default_rng(0)
    state = optimizer.init(SPACE)
    genomes = optimizer.ask(state, rng)
    state = optimizer.tell(state, genomes, Hill().of(genomes))
    before = state.genomes.copy(), state.fitness.copy()
    genomes = optimizer.ask(state, rng)
    optimizer.tell(state, genomes, np.full(len(genomes), 1e9))
    same = np.array_equal(state.genomes, before[0]) and np.array_equal(state.fitness, before[1])
    assert same, "`ask` or `tell` changes the given state; return another"


def keeps_diverse_members(plugin: Plugin) -> None:
    """Keeps as many different members as `diverse` asks for."""
    found = maximise(plugin().diverse(9), SPACE, Hill(), 200, np.random.default_rng(0))
    different = len(np.unique(found.genomes, axis=0))
    assert (found.size, different) == (9, 9), f"of 9 members it keeps {found.size}, of which {different} differ"


def begins_with_given_genomes(plugin: Plugin) -> None:
    """Begins with genomes that it did not ask for, as a warm start does, and keeps the best of them."""
    hill, start = Hill(), frozen([SUMMIT, *SPACE.draw(8, np.random.default_rng(1))])
    found = maximise(plugin().diverse(9), SPACE, hill, 60, np.random.default_rng(0), start)
    assert np.array_equal(hill.asked[0], start), "the search does not begin with the given genomes"
    best = found.genomes[0]
    assert np.array_equal(best, SUMMIT), f"it was told of the summit at {SUMMIT.tolist()} and returns {best.tolist()}"
