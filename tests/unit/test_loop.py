"""The algorithm of Fig. 2."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from gaplab.services.core.arrays import frozen
from gaplab.services.core.discrepancies.fitness import AbsoluteFitness
from gaplab.services.core.errors import PluginBroken
from gaplab.services.core.loop import repetition
from gaplab.services.core.strategies import strategies
from gaplab.services.core.strategies.base import DiverseOptions, Strategy
from gaplab.services.core.strategies.paper import Informative, Random
from gaplab.services.core.types import (
    Belief,
    Budget,
    History,
    Measured,
    Outcome,
    Probed,
    Sample,
    Selected,
    Transferred,
    Tuned,
    recorded_fitness,
)
from tests.fakes import CountedReality, Recorder, flat, paraboloid, small_setting
from tests.parameters import few

REUSING = Budget(40, 30, 50, reuse_transfer=True)
PHASES = (Selected, Measured, Tuned, Transferred, Probed)


def test_iteration_0_tunes_nothing_and_the_others_run_through_every_phase() -> None:
    steps = list(repetition(small_setting()))

    assert [type(step) for step in steps] == [Tuned, Transferred, Probed, *PHASES * 3]
    assert [step.iteration for step in steps] == [0] * 3 + [1] * 5 + [2] * 5 + [3] * 5


@pytest.mark.parametrize("strategy", sorted(strategies))
def test_a_resumed_repetition_equals_an_uninterrupted_one_wherever_it_stopped(strategy: Any) -> None:
    steps = list(repetition(small_setting(strategy)))

    for stopped_after in range(len(steps) + 1):
        rest = repetition(small_setting(strategy), steps[:stopped_after])
        assert [flat(step) for step in rest] == [flat(step) for step in steps[stopped_after:]]


@pytest.mark.parametrize("batch", few([2, 9, 1_000], (9).__eq__))
@pytest.mark.parametrize("strategy", sorted(strategies))
def test_no_number_depends_on_how_many_rollouts_are_asked_for_at_a_time(strategy: Any, batch: Any) -> None:
    one_by_one = [flat(step) for step in repetition(small_setting(strategy))]

    together = repetition(replace(small_setting(strategy), batch_size=lambda: batch))

    assert [flat(step) for step in together] == one_by_one


def test_newcomers_are_foreseen_so_that_fewer_calls_are_waited_for() -> None:
    def calls_of_a_transfer(batch: Any) -> Any:
        simulate = Recorder()
        setting = small_setting("random", simulate=simulate, batch_size=lambda: batch)
        steps = repetition(setting)
        next(steps)
        next(steps)
        return len(simulate.calls)

    assert calls_of_a_transfer(8) < 0.8 * calls_of_a_transfer(1)


def test_reality_is_asked_once_for_each_sample_and_each_probe() -> None:
    reality = CountedReality()

    list(repetition(small_setting(reality=reality)))

    assert reality.asked == 3 + 4


def test_a_resumed_repetition_does_not_measure_again_what_is_in_the_log() -> None:
    log = list(repetition(small_setting()))[:5]
    reality = CountedReality()

    list(repetition(small_setting(reality=reality), log))

    assert isinstance(log[-1], Measured)
    assert reality.asked == 2 + 3


def test_noise_is_as_large_as_the_spec_says_and_none_by_default() -> None:
    def away(**noise: float) -> Any:
        """The noise of samples and probes, and of a reading, of 100 repetitions; and the scales of these."""
        noises, readings, scales = [], [], []
        real = CountedReality()
        for number in range(100):
            noisy = small_setting("random", reality=lambda genome: Outcome(real(genome).fitness, frozen([7.0])))
            steps: list[Any] = list(repetition(replace(noisy, repetition=number, iterations=1, **noise)))
            measured = [step.sample if isinstance(step, Measured) else step for step in steps[2:]]
            kept: list[Any] = [each for each in measured if isinstance(each, Sample | Probed)]
            genomes = [steps[1].genome, kept[1].genome, steps[-2].genome]
            noises += [each.fitness - real(genome).fitness for each, genome in zip(kept, genomes, strict=True)]
            readings += [float(each.readings[0]) - 7.0 for each in kept]
            scales.append(abs(steps[1].fitness))
        return np.array(noises), np.array(readings), float(np.mean(scales))

    in_unit, read, scale = away(noise_unit=0.5)
    share, _, _ = away(noise=0.5)

    assert np.unique(in_unit).size == in_unit.size == 300
    assert in_unit.std() == pytest.approx(0.5, rel=0.15)
    assert read.std() == pytest.approx(1.0, rel=0.15)
    assert abs(np.corrcoef(in_unit, read)[0, 1]) < 0.2
    assert share.std() == pytest.approx(0.5 * scale, rel=0.15)
    assert away()[0].tolist() == [0.0] * 300


@pytest.mark.parametrize("strategy", ["simulated_fit", "informative"])
def test_a_resumed_repetition_has_the_noise_of_an_uninterrupted_one(strategy: Any) -> None:
    noisy = small_setting(strategy, noise=0.3)
    steps = list(repetition(noisy))

    for stopped_after in range(len(steps)):
        rest = repetition(replace(noisy, batch_size=lambda: 9), steps[:stopped_after])
        assert [flat(step) for step in rest] == [flat(step) for step in steps[stopped_after:]]


@pytest.mark.parametrize(
    ("strategy", "options", "expected"),
    [
        # transfers 4 × 40, selections 3 × 30, tunings 50 × (1 + 2 + 3)
        ("simulated_fit", {}, 160 + 90 + 300),
        ("simulated_fit_and_unique", {}, 160 + 90 + 300),
        ("informative", {"simulators": 4}, 160 + 90 * 4 + 300),
        ("simulated_fit_and_informative", {"simulators": 4}, 160 + 90 * 4 + 300),
        ("random", {}, 160 + 300),
        ("known_fit", {}, 160 + 300),
    ],
)
def test_budgets_are_honoured_to_the_rollout_and_reported_in_the_steps(
    strategy: Any, options: Any, expected: Any
) -> None:
    simulate = Recorder()

    steps = list(repetition(small_setting(strategy, options, simulate=simulate)))

    costs = [step.cost for step in steps if hasattr(step, "cost")]
    assert sum(cost.rollouts + cost.saved for cost in costs) == expected
    assert sum(cost.rollouts for cost in costs) == simulate.rollouts <= expected
    assert all(cost.saved >= 0 for cost in costs)


@pytest.mark.parametrize("failed", [{2}, {1, 2}, {1, 2, 3}])
def test_what_a_failed_measurement_does_not_take_of_the_budget_is_saved(failed: Any) -> None:
    reality = CountedReality(lambda genome: float("nan") if reality.asked // 2 in failed else float(genome.sum()))  # type: ignore[has-type]

    steps = list(repetition(small_setting("random", reality=reality)))

    costs = [step.cost for step in steps if hasattr(step, "cost")]
    assert sum(cost.rollouts + cost.saved for cost in costs) == 160 + 300


def test_a_strategy_that_transfers_the_best_of_many_simulators_saves_the_budget_of_all() -> None:
    class Fittest(Informative):
        selects_transferred = True

    strategy = Fittest(DiverseOptions(simulators=4))

    steps = list(repetition(replace(small_setting(budget=REUSING), strategy=strategy)))

    assert {step.cost.saved for step in steps if isinstance(step, Selected)} == {30 * 4}


@pytest.mark.parametrize(
    ("said", "wrong"), [(True, "'eager' has .* one search a selection"), (False, "'eager' has .* searches = False")]
)
def test_a_search_for_which_there_is_no_budget_is_refused(said: Any, wrong: Any) -> None:
    class Eager(Strategy):
        name = "eager"
        searches = said

        def select(self, belief: Any, search: Any, rng: Any) -> Any:
            search(lambda genomes, fitnesses: fitnesses[:, 0])
            return search(lambda genomes, fitnesses: -fitnesses[:, 0])

    simulate, of_a_transfer, of_a_search = Recorder(), 40, 30

    with pytest.raises(PluginBroken, match=wrong):
        list(repetition(replace(small_setting(simulate=simulate), strategy=Eager())))

    assert simulate.rollouts <= of_a_transfer + of_a_search * said


def test_a_budget_that_the_population_does_not_divide_is_honoured_too() -> None:
    simulate = Recorder()
    budget = Budget(controller_evaluations=7, selection_evaluations=6, simulator_evaluations=9)

    steps = list(repetition(small_setting(simulate=simulate, budget=budget, iterations=1)))

    costs = [step.cost for step in steps if hasattr(step, "cost")]
    assert sum(cost.rollouts + cost.saved for cost in costs) == 7 + 6 + 9 + 7


def test_with_reuse_simulated_fit_tries_the_controller_that_was_just_transferred() -> None:
    steps = list(repetition(small_setting(budget=REUSING)))

    transferred = [step.genome for step in steps if isinstance(step, Transferred)]
    selected = [step for step in steps if isinstance(step, Selected)]
    np.testing.assert_array_equal([step.genome for step in selected], transferred[:-1])
    assert {(step.cost.rollouts, step.cost.saved) for step in selected} == {(0, 30)}


def test_simulated_fit_searches_with_the_budget_of_every_selection() -> None:
    steps = list(repetition(small_setting()))

    assert {step.cost.rollouts for step in steps if isinstance(step, Selected)} == {30}
    transferred = [step.genome for step in steps if isinstance(step, Transferred)]
    assert not any(np.array_equal(step.genome, transferred[0]) for step in steps if isinstance(step, Selected))


def test_fit_strategies_close_the_gap() -> None:
    steps = list(repetition(small_setting(budget=Budget(400, 400, 400))))

    start, *_, end = (step.recorded for step in steps if isinstance(step, Probed))
    assert end > 0.999
    assert start < 0.95


def test_the_recorded_fitness_is_the_larger_of_probe_and_best_sample() -> None:
    samples = [Sample(np.zeros(1), 0.4), Sample(np.zeros(1), 0.9), Sample(np.zeros(1), float("nan"))]

    assert recorded_fitness(0.5, samples) == 0.9
    assert recorded_fitness(1.5, samples) == 1.5
    assert recorded_fitness(float("nan"), samples) == 0.9
    assert np.isnan(recorded_fitness(float("nan"), []))


def test_a_measurement_that_failed_counts_but_teaches_nothing() -> None:
    reality = CountedReality(lambda genome: float("nan"))

    steps = list(repetition(small_setting(reality=reality)))

    assert reality.asked == 7
    assert all(np.isnan(step.recorded) for step in steps if isinstance(step, Probed))
    assert all(step.simulators[0].squared_error == 0.0 for step in steps if isinstance(step, Tuned))


def test_physics_that_fails_everywhere_is_counted_and_ends_in_no_fitness() -> None:
    def broken(genomes: Any, parameters: Any) -> Any:
        return np.full((len(genomes), len(parameters)), np.nan)

    steps = list(repetition(small_setting(simulate=broken)))

    transfers = [step for step in steps if isinstance(step, Transferred)]
    assert all(np.isnan(step.fitness) for step in transfers)
    assert all(step.cost.failures == step.cost.rollouts > 0 for step in transfers)


def test_a_controller_whose_physics_fails_never_wins() -> None:
    def broken_on_the_left(genomes: Any, parameters: Any) -> Any:
        return np.where(genomes[:, :1] < 0.8, np.nan, paraboloid(genomes, parameters))

    steps = list(repetition(small_setting(simulate=broken_on_the_left)))

    assert all(step.genome[0] >= 0.8 for step in steps if isinstance(step, Selected | Transferred))


def test_repetitions_strategies_and_seeds_draw_different_simulators() -> None:
    settings = [small_setting(), small_setting(repetition=5), small_setting(seed=12), small_setting("random")]

    drawn = {flat(next(repetition(setting))) for setting in settings}

    assert len(drawn) == len(settings)


def test_an_ensemble_strategy_keeps_as_many_simulators_as_it_asks_for() -> None:
    steps = list(repetition(small_setting("informative", {"simulators": 7})))

    assert {len(step.simulators) for step in steps if isinstance(step, Tuned)} == {7}


def test_the_population_of_a_fit_strategy_yields_its_one_best_simulator() -> None:
    steps = list(repetition(small_setting("simulated_fit")))

    assert {len(step.simulators) for step in steps if isinstance(step, Tuned)} == {1}


def test_the_transfer_evolves_in_the_best_simulator() -> None:
    best = np.array([0.3, 0.6])
    setting = small_setting(budget=Budget(500, 10, 10))
    step = Tuned(1, tuple(replace(each) for each in next(repetition(setting)).simulators))  # type: ignore[union-attr]
    step = replace(step, simulators=(replace(step.simulators[0], parameters=best),))

    transferred = next(repetition(setting, [step]))

    np.testing.assert_allclose(transferred.genome, best, atol=0.01)  # type: ignore[union-attr]


def test_the_scale_is_the_size_of_the_first_transferred_fitness_that_has_one() -> None:
    def scale(*fitnesses: float) -> float | None:
        history = History()
        for number, fitness in enumerate(fitnesses):
            history = history.after(Transferred(number, np.zeros(2), fitness))
        return history.scale

    assert scale() is None
    assert scale(0.4, 0.9) == 0.4
    assert scale(-2.0) == 2.0
    assert scale(float("nan"), 0.0, 0.7) == 0.7


def test_a_strategy_is_told_the_scale_and_the_discrepancy() -> None:
    told: list[Belief] = []

    class Listener(Random):
        def select(self, belief: Any, search: Any, rng: Any) -> Any:
            told.append(belief)
            return super().select(belief, search, rng)

    setting = small_setting(strategy="random", discrepancy=AbsoluteFitness())

    steps = list(repetition(replace(setting, strategy=Listener())))

    first = next(step.fitness for step in steps if isinstance(step, Transferred))
    assert [(each.scale, each.discrepancy.name) for each in told] == [(first, "absolute_fitness")] * 3


@pytest.mark.parametrize("count", [1, 20])
def test_simulators_drawn_before_any_sample_have_no_error(count: Any) -> None:
    options = {"simulators": count}

    drawn = next(repetition(small_setting("domain_randomization", options))).simulators  # type: ignore[union-attr]

    assert len(drawn) == count
    assert all(each.squared_error == 0.0 for each in drawn)
