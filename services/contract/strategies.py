"""The contract of a strategy."""

from collections.abc import Sequence

import numpy as np

from gaplab.services.core.arrays import Fitnesses, Genome, Genomes, Parameters
from gaplab.services.core.space import Space
from gaplab.services.core.strategies.base import Score, Strategy
from gaplab.services.core.types import Belief, Sample, Simulator

SPACE = Space.box([0.0, 0.0], [1.0, 1.0], [True, False])
SAMPLES = (Sample(np.array([0.5, 0.5]), 0.8), Sample(np.array([0.1, 0.5]), float("nan")))
Plugin = type[Strategy]


def hill(genomes: Genomes, parameters: Parameters) -> Fitnesses:
    """Return the fitness `(n, m)` of genomes `(n, 2)` on hills whose summits are at the parameters `(m, 2)`."""
    fitnesses: Fitnesses = 1.0 - ((genomes[:, None, :] - parameters[None, :, :]) ** 2).sum(axis=2)
    return fitnesses


def belief(strategy: Strategy, samples: Sequence[Sample] = ()) -> Belief:
    """Return what a strategy knows: its simulators, a hand-designed genome and samples."""
    rng = np.random.default_rng(5)
    simulators = tuple(Simulator(row, 0.1) for row in rng.random((strategy.ensemble, 2)))
    return Belief(SPACE, np.array([0.2, 0.9]), tuple(samples), simulators)


class GridSearch:
    """A search that looks at every point of a grid, and counts its calls."""

    def __init__(self, believed: Belief) -> None:
        self.believed = believed
        self.calls = 0

    def __call__(self, score: Score) -> Genome:
        """Return the genome of the grid with the highest score."""
        self.calls += 1
        axis = np.linspace(0, 1, 41)
        grid = np.array(np.meshgrid(axis, axis)).reshape(2, -1).T
        scores = np.asarray(score(grid, hill(grid, self.believed.parameters)))
        assert scores.shape == (len(grid),), f"its score of {len(grid)} genomes has the shape {scores.shape}"
        best: Genome = grid[int(np.argmax(scores))]
        return best


def selected(strategy: Strategy, samples: Sequence[Sample] = (), seed: int = 0) -> Genome:
    """Return the genome that a strategy selects."""
    believed = belief(strategy, samples)
    return strategy.select(believed, GridSearch(believed), np.random.default_rng(seed))


def selects_a_genome_of_the_space(plugin: Plugin) -> None:
    """Selects a genome within the bounds of the space."""
    genome = np.asarray(selected(plugin()))
    assert genome.shape == (2,), f"in a space of 2 genes it selects an array of shape {genome.shape}"
    inside = bool(np.all((genome >= SPACE.lower) & (genome <= SPACE.upper)))
    assert inside, f"it selects {genome.tolist()}, outside the bounds 0 to 1"


def selects_the_same_from_the_same(plugin: Plugin) -> None:
    """Selects the same genome from the same belief and random stream."""
    first, second = selected(plugin()), selected(plugin())
    assert np.array_equal(first, second), f"it selects {first.tolist()}, then {second.tolist()}: use only `rng`"


def copes_with_failed_measurements(plugin: Plugin) -> None:
    """Copes with samples, of which some have a fitness of nan."""
    genome = selected(plugin(), SAMPLES)
    assert np.isfinite(genome).all(), f"with a failed sample it selects {genome.tolist()}: use `belief.learnable`"


def searches_as_it_says(plugin: Plugin) -> None:
    """Searches once, or never with `searches = False`."""
    strategy = plugin()
    search = GridSearch(belief(strategy))
    strategy.select(belief(strategy), search, np.random.default_rng(0))
    expected = int(strategy.searches)
    assert search.calls == expected, f"it has searches = {strategy.searches}, but searches {search.calls} times"


def is_described(plugin: Plugin) -> None:
    """Has a docstring whose first line is a sentence."""
    summary = plugin.describe().summary
    assert summary.endswith("."), f"its summary in the catalogue is {summary!r}; end it with a full stop"


CHECKS = (
    selects_a_genome_of_the_space,
    selects_the_same_from_the_same,
    copes_with_failed_measurements,
    searches_as_it_says,
    is_described,
)
