"""What the strategies of the paper promise; test_contract.py asks what every strategy does."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from gaplab.schemas.plugin import PluginRef
from gaplab.services.contract.strategies import GridSearch, belief
from gaplab.services.core.scoring import uniqueness_penalty
from gaplab.services.core.strategies import strategies
from gaplab.services.core.types import Sample, Simulator
from tests.fakes import TRUTH, paraboloid

PAPER = [
    "informative",
    "known_fit",
    "random",
    "simulated_fit",
    "simulated_fit_and_informative",
    "simulated_fit_and_unique",
]


def select(name: Any, samples: Any = (), seed: Any = 0, options: Any = None) -> Any:
    strategy = strategies.create(PluginRef(name=name, options=options or {}))
    believed = belief(strategy, samples)
    return strategy.select(believed, GridSearch(believed), np.random.default_rng(seed))


@pytest.mark.parametrize("name", sorted(strategies))
def test_each_strategy_tells_its_place_in_the_paper(name: Any) -> None:
    described = strategies[name].describe()

    assert described.name == name
    assert "Paper" in described.source


def test_the_papers_six_strategies_and_the_baseline_are_there() -> None:
    assert {*PAPER, "direct"} <= set(strategies)
    assert [name for name in strategies if strategies[name].in_reality] == ["direct"]


def test_simulated_fit_selects_the_summit_of_its_simulator() -> None:
    simulator = belief(strategies["simulated_fit"]()).parameters[0]

    np.testing.assert_allclose(select("simulated_fit"), simulator, atol=0.02)


def test_uniqueness_moves_the_selection_away_from_a_sample_on_the_summit() -> None:
    summit = select("simulated_fit")
    sample = Sample(summit, 1.0)

    moved = select("simulated_fit_and_unique", [sample])

    assert np.linalg.norm(moved - summit) > 0.02
    assert uniqueness_penalty(moved[None], np.array([1.0]), [sample])[0] < 0.5


@pytest.mark.parametrize("name", ["simulated_fit_and_unique", "simulated_fit_and_informative", "informative"])
def test_no_default_depends_on_the_unit_of_fitness(name: str) -> None:
    metres, millimetres = scores(name, 1.0), scores(name, 1_000.0)

    np.testing.assert_allclose(millimetres / 1_000, metres, rtol=1e-9)


def scores(name: str, unit: float) -> Any:
    """Scores of controllers if fitness is counted in a unit that is so many times smaller."""
    strategy = strategies[name]()
    known = belief(strategy, [Sample(np.array([0.5, 0.5]), 0.8 * unit)])
    errors = [0.0002 * (1 + rank) * unit**2 for rank in range(len(known.simulators))]
    simulators = tuple(map(Simulator, known.parameters, errors))
    known = replace(known, simulators=simulators, scale=0.9 * unit)
    grid, found = np.random.default_rng(3).random((50, 2)), list[Any]()

    def search(score: Any) -> Any:
        found.append(score(grid, unit * paraboloid(grid, known.parameters)))
        return grid[0]

    strategy.select(known, search, np.random.default_rng(0))
    return found[0]


def test_informative_selects_where_the_simulators_disagree_most() -> None:
    genome = select("informative", options={"simulators": 3})

    parameters = belief(strategies.create(PluginRef(name="informative", options={"simulators": 3}))).parameters
    everywhere = paraboloid(np.random.default_rng(1).random((500, 2)), parameters).std(axis=1)
    assert paraboloid(genome[None], parameters).std() >= everywhere.max()


def test_the_weights_of_the_mixture_lead_from_fit_to_informative() -> None:
    name = "simulated_fit_and_informative"
    only_fit = select(name, options={"simulators": 3, "informative_weight": 0.0})
    only_informative = select(name, options={"simulators": 3, "fit_weight": 0.0})

    np.testing.assert_array_equal(only_informative, select("informative", options={"simulators": 3}))
    parameters = belief(strategies.create(PluginRef(name=name, options={"simulators": 3}))).parameters
    np.testing.assert_allclose(only_fit, parameters.mean(axis=0), atol=0.02)


def test_random_selections_are_uniform() -> None:
    drawn = np.array([select("random", seed=seed) for seed in range(400)])

    np.testing.assert_allclose(drawn.mean(axis=0), [0.5, 0.5], atol=0.05)


def test_known_fit_adds_up_to_a_quarter_to_each_gene_wraps_phases_and_clips_widths() -> None:
    drawn = np.array([select("known_fit", seed=seed) for seed in range(200)])

    added = np.mod(drawn[:, 0] - 0.2, 1.0)
    assert added.min() >= 0.0
    assert 0.2 < added.max() <= 0.25
    assert drawn[:, 1].min() >= 0.9
    assert drawn[:, 1].max() == 1.0


def test_truth_is_not_among_what_a_strategy_is_given() -> None:
    believed = belief(strategies["informative"]())

    assert set(vars(believed)) == {"space", "known", "samples", "simulators", "scale", "discrepancy"}
    assert not any(np.array_equal(each.parameters, TRUTH) for each in believed.simulators)
