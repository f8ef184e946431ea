"""The contract of a strategy.

A strategy without samples selects nothing, so that what it transfers is checked in place of what it selects.
"""

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from gaplab.services.contract.promises import check_repeats
from gaplab.services.core.arrays import (
    NO_GENOMES,
    NO_READINGS,
    Fitnesses,
    FloatArray,
    Genome,
    Genomes,
    Outcomes,
    Parameters,
    frozen,
)
from gaplab.services.core.space import Space
from gaplab.services.core.strategies.base import Score, Strategy
from gaplab.services.core.types import Belief, Sample, Simulator

SPACE = Space.box([0.0, 0.0], [1.0, 1.0], [True, False])
TUNABLES, NAMES = Space.box([0.0, 0.0], [1.0, 1.0]), ("static_friction", "dynamic_friction")
SAMPLES = (Sample(frozen([0.5, 0.5]), 0.8), Sample(frozen([0.1, 0.5]), float("nan")))
Plugin = type[Strategy]


def hill(genomes: Genomes, parameters: Parameters) -> Fitnesses:
    """Return the fitness `(n, m)` of genomes `(n, 2)` on hills whose summits are at the parameters `(m, 2)`."""
    fitnesses: Fitnesses = 1.0 - ((genomes[:, None, :] - parameters[None, :, :]) ** 2).sum(axis=2)
    return fitnesses


def seen(genomes: Genomes, parameters: Parameters) -> Outcomes:
    """Return that fitness, and as readings the differences from the summits, `(n, m, 3)`."""
    return np.concatenate([hill(genomes, parameters)[..., None], genomes[:, None, :] - parameters], axis=2)


def belief(strategy: Strategy, samples: Sequence[Sample] = ()) -> Belief:
    """Return what a strategy knows, read-only: its simulators, a hand-designed genome and samples."""
    rng = np.random.default_rng(5)
    drawn = np.asarray(strategy.draw(TUNABLES, NAMES, rng))
    expected = (strategy.ensemble, 2)
    assert drawn.shape == expected, f"its first simulators have the shape {drawn.shape}, not {expected}"
    assert np.all((drawn >= 0.0) & (drawn <= 1.0)), f"it draws simulators outside the bounds 0 to 1: {drawn.tolist()}"
    simulators = tuple(Simulator(frozen(row), 0.1) for row in drawn)
    return Belief(SPACE, frozen([0.2, 0.9]), tuple(samples), simulators, TUNABLES, NAMES)


class GridSearch:
    """A search that looks at every point of a grid, and counts its calls and its simulators.

    Attributes:
        several: whether a genome may have several scores.
        calls: number of its calls.
        simulators: most simulators of a call.
        scores: `(n,)`, or `(n, o)`: scores of its last call.
        members: `(n, g)`: the best genomes of its last call.
    """

    def __init__(self, believed: Belief, *, several: bool = False) -> None:
        self.believed = believed
        self.several = several
        self.calls = self.simulators = 0
        self.scores: FloatArray = NO_READINGS
        self.members: Genomes = NO_GENOMES

    def __call__(
        self,
        score: Score,
        *,
        parameters: Parameters | None = None,
        senses: bool = False,
        candidates: Genomes | None = None,
        start: Genomes | None = None,
    ) -> Genome:
        """Return the genome of the grid, of the start or of the candidates, with the highest score."""
        self.calls += 1
        simulators = self.believed.parameters if parameters is None else parameters
        self.simulators = max(self.simulators, len(simulators))
        axis = np.linspace(0, 1, 41)
        grid = np.array(np.meshgrid(axis, axis)).reshape(2, -1).T if candidates is None else candidates
        if candidates is None and start is not None and len(start):
            grid = np.vstack([start, grid])
        scores = np.asarray(score(grid, (seen if senses else hill)(grid, simulators)))
        sized = scores.shape[:1] == (len(grid),) and scores.ndim <= 1 + self.several
        assert sized, f"its score of {len(grid)} genomes has the shape {scores.shape}"
        self.scores = scores
        first = scores.reshape(len(grid), -1)[:, 0]
        order = np.argsort(-np.where(np.isnan(first), -np.inf, first), kind="stable")
        self.members = grid[order[:20]]
        best: Genome = grid[order[0]]
        return best


def chosen(strategy: Strategy, samples: Sequence[Sample], *, transfer: bool) -> tuple[FloatArray, GridSearch]:
    """Return the genome that a strategy selects or transfers, and how it searched for it."""
    search = GridSearch(belief(strategy, samples), several=strategy.controller_optimizer is not None)
    choose = strategy.transfer if transfer else strategy.select
    return np.asarray(choose(search.believed, search, np.random.default_rng(0))), search


def selects_a_genome_of_the_space(plugin: Plugin) -> None:
    """Selects a genome within the bounds of the space."""
    _check_inside(chosen(plugin(), (), transfer=not plugin.takes_samples)[0], "selects")


def transfers_a_genome_of_the_space(plugin: Plugin) -> None:
    """Transfers a genome within the bounds of the space."""
    _check_inside(chosen(plugin(), SAMPLES, transfer=True)[0], "transfers")


def _check_inside(genome: FloatArray, verb: str) -> None:
    assert genome.shape == (2,), f"in a space of 2 genes it {verb} an array of shape {genome.shape}"
    inside = bool(np.all((genome >= SPACE.lower) & (genome <= SPACE.upper)))
    assert inside, f"it {verb} {genome.tolist()}, outside the bounds 0 to 1"


def selects_the_same_from_the_same(plugin: Plugin) -> None:
    """Selects and transfers the same from the same belief and random stream, whatever it did before."""
    questions: dict[str, Callable[[Strategy], FloatArray]] = {}
    for known, samples in (("without samples", ()), ("with samples", SAMPLES)):
        if plugin.takes_samples:
            questions[f"what it selects {known}"] = partial(_numbers, samples=samples, transfer=False)
        questions[f"what it transfers {known}"] = partial(_numbers, samples=samples, transfer=True)
    check_repeats(plugin, questions, "use only `rng`, and keep nothing but the belief from one call for the next")


def _numbers(strategy: Strategy, samples: Sequence[Sample], *, transfer: bool) -> FloatArray:
    """Return the drawn simulators, the scores of a search and the chosen genome, as one vector."""
    genome, search = chosen(strategy, samples, transfer=transfer)
    return np.concatenate([np.ravel(each) for each in (search.believed.parameters, search.scores, genome)])


def copes_with_failed_measurements(plugin: Plugin) -> None:
    """Copes with samples, of which some have a fitness of nan."""
    genome, _ = chosen(plugin(), SAMPLES, transfer=not plugin.takes_samples)
    assert np.isfinite(genome).all(), f"with a failed sample it selects {genome.tolist()}: use `belief.learnable`"


def searches_as_it_says(plugin: Plugin) -> None:
    """Calls its search once, or never if it has `searches = False`."""
    strategy = plugin()
    if not strategy.takes_samples:
        return
    _, search = chosen(strategy, (), transfer=False)
    expected = int(strategy.searches)
    assert search.calls == expected, f"it has searches = {strategy.searches}, but searches {search.calls} times"
    stated = strategy.selection_simulators(TUNABLES.size, learned=False)
    assert search.simulators <= stated, f"it searches in {search.simulators} simulators, but states {stated}"


def transfers_as_it_says(plugin: Plugin) -> None:
    """Searches at most once for a transfer, in as many simulators as it states."""
    strategy = plugin()
    _, search = chosen(strategy, SAMPLES, transfer=True)
    stated = strategy.transfer_simulators(TUNABLES.size)
    assert search.calls <= 1, f"its transfer searches {search.calls} times"
    assert search.simulators <= stated, f"it transfers from {search.simulators} simulators, but states {stated}"


def learns_from_its_samples(plugin: Plugin) -> None:
    """States which of its samples simulators are tuned on, in `lessons`."""
    strategy = plugin()
    lessons = strategy.lessons(SAMPLES)
    strange = [each for each in lessons if not any(each is sample for sample in SAMPLES)]
    again = len(strategy.lessons(SAMPLES)) == len(lessons)
    assert again, "asked again, it learns from others: keep nothing from one call for the next"
    assert not strange, f"its lessons have {len(strange)} samples that were not measured"
