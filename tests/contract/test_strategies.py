"""What the strategies of the paper promise; test_contract.py asks what every strategy does."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from gaplab.schemas.plugin import PluginRef
from gaplab.services.contract.strategies import GridSearch, belief
from gaplab.services.core.scoring import uniqueness_penalty
from gaplab.services.core.search import Allowance
from gaplab.services.core.space import Space
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
def test_each_strategy_tells_its_place_in_the_paper_or_its_source(name: Any) -> None:
    described = strategies[name].describe()

    assert described.name == name
    assert "Paper" in described.source or name not in {*PAPER, "direct"}
    assert described.source != "gaplab"


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

    def look(score: Any, **_: Any) -> Any:
        found.append(score(grid, unit * paraboloid(grid, known.parameters)))
        return grid[0]

    search: Any = look
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

    known = {"space", "known", "samples", "simulators", "tunables", "names", "scale", "discrepancy"}
    known |= {"candidates", "commands"}  # of recordings
    known |= {"members", "reading_times_s", "reading_periods"}
    assert set(vars(believed)) == known
    assert not any(np.array_equal(each.parameters, TRUTH) for each in believed.simulators)


def options_of(name: Any, **options: Any) -> Any:
    return strategies.create(PluginRef(name=name, options=options))


def transferred(strategy: Any) -> Any:
    believed = belief(strategy)
    return believed, strategy.transfer(believed, GridSearch(believed), np.random.default_rng(0))


def test_domain_randomization_transfers_the_best_mean_over_its_random_simulators() -> None:
    believed, genome = transferred(options_of("domain_randomization"))

    assert believed.parameters.shape == (20, 2)
    np.testing.assert_allclose(genome, believed.parameters.mean(axis=0), atol=0.02)


def test_the_noise_envelope_varies_base_aspects_a_little_around_the_middle_of_their_bounds() -> None:
    strategy = options_of("noise_envelope", simulators=200)
    tunables = Space.box([0.0, 2.0], [1.0, 6.0])

    drawn = strategy.draw(tunables, ("static_friction", "dynamic_friction"), np.random.default_rng(0))

    assert drawn[:, 0].min() < 0.05
    assert drawn[:, 0].max() > 0.95
    assert 3.6 <= drawn[:, 1].min() < 3.7
    assert 4.3 < drawn[:, 1].max() <= 4.4


def test_the_noise_envelope_transfers_what_is_fit_in_its_worst_draw_or_on_average_less_deviations() -> None:
    believed, worst = transferred(options_of("noise_envelope"))
    _, mean = transferred(options_of("noise_envelope", fitness="mean_minus_deviation", kappa=0.0))

    everywhere = np.random.default_rng(1).random((500, 2))
    of_worst = paraboloid(worst[None], believed.parameters).min()
    assert of_worst >= paraboloid(everywhere, believed.parameters).min(axis=1).max() - 0.01
    np.testing.assert_allclose(mean, believed.parameters.mean(axis=0), atol=0.02)


def test_equal_rollouts_divide_the_evaluations_by_the_simulators() -> None:
    def evaluations(name: Any, **options: Any) -> Any:
        return Allowance.of_transfer(options_of(name, **options), 500, tunables=3).evaluations

    assert evaluations("domain_randomization") == 500
    assert evaluations("domain_randomization", equal_rollouts=True) == 25
    assert evaluations("noise_envelope", equal_rollouts=True) == 62


def test_estimation_exploration_selects_the_summit_of_its_best_model() -> None:
    best = belief(strategies["estimation_exploration"]()).parameters[0]

    np.testing.assert_allclose(select("estimation_exploration"), best, atol=0.02)


class Sensors:
    """A search whose readings are the models, amplified by the first gene, with chaos by the second."""

    def __call__(self, score: Any, *, parameters: Any = None, senses: Any = False, candidates: Any = None) -> Any:
        first, second = candidates[:, 0, None], candidates[:, 1, None]
        readings = first * parameters.sum(axis=1) + second * np.sin(1e6 * parameters.sum(axis=1))
        return candidates[int(np.nanargmax(score(candidates, np.stack([readings, readings], axis=2))))]


@pytest.mark.parametrize(("reliability", "chaotic"), [(0.0, True), (0.5, False)])
def test_a_test_makes_models_disagree_and_with_reliability_no_model_with_itself(reliability: Any, chaotic: Any) -> None:
    strategy = options_of("estimation_exploration", select="disagreement", reliability=reliability)

    found = strategy.select(belief(strategy), Sensors(), np.random.default_rng(0))

    assert (found[1] > 0.5) == chaotic


def test_a_controller_that_was_measured_is_not_tried_again() -> None:
    strategy = options_of("estimation_exploration", select="disagreement")
    first = strategy.select(belief(strategy), Sensors(), np.random.default_rng(0))

    again = strategy.select(belief(strategy, [Sample(first, 1.0)]), Sensors(), np.random.default_rng(0))

    assert not np.array_equal(first, again)


def test_what_an_evaluation_costs_follows_from_the_options() -> None:
    def simulators(name: Any, **options: Any) -> Any:
        return options_of(name, **options).selection_simulators(3, learned=False)

    assert simulators("estimation_exploration") == 1
    assert simulators("estimation_exploration", select="disagreement") == 10
    assert simulators("estimation_exploration", select="disagreement", reliability=0.0) == 5
    assert simulators("weighted") == 20
    assert simulators("weighted", reliability_weight=1.0) == 40
    assert simulators("weighted", information_weight=1.0) == 23
    nothing = {"fit_weight": 0.0, "disagreement_weight": 0.0}
    assert simulators("weighted", **nothing, information_weight=1.0) == 4


def test_weighted_without_normalisation_is_fit_and_informative() -> None:
    plain = select("weighted", options={"simulators": 3, "normalise": False})

    np.testing.assert_array_equal(plain, select("simulated_fit_and_informative", options={"simulators": 3}))


def test_normalised_weights_have_no_unit() -> None:
    class Scaled(GridSearch):
        def __call__(self, score: Any, **asked: Any) -> Any:
            return super().__call__(lambda genomes, fitnesses: score(genomes, 1e3 * fitnesses), **asked)

    strategy = options_of("weighted", simulators=3, reliability_weight=1.0)
    believed = belief(strategy)

    found = [strategy.select(believed, search(believed), np.random.default_rng(0)) for search in (GridSearch, Scaled)]

    np.testing.assert_array_equal(*found)


@pytest.mark.parametrize("name", ["uniqueness", "reliability", "information"])
def test_each_other_term_of_the_weighted_sum_changes_the_selection(name: Any) -> None:
    samples = [Sample(np.array([0.3, 0.3]), 0.9)]

    plain = select("weighted", samples, options={"simulators": 3})
    changed = select("weighted", samples, options={"simulators": 3, f"{name}_weight": 5.0})

    assert not np.array_equal(plain, changed)
