"""What a strategy of one's own may decide: its transfer, its simulators and its lessons."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from gaplab.schemas.spec import ExperimentSpec
from gaplab.services.contract.strategies import seen
from gaplab.services.core.errors import PluginBroken
from gaplab.services.core.loop import repetition
from gaplab.services.core.strategies import strategies
from gaplab.services.core.strategies.base import Strategy
from gaplab.services.core.types import Cost, Measured, Probed, Selected, Transferred, Tuned
from gaplab.services.specs.assembly import setting
from gaplab.services.specs.resolution import expected_rollouts, resolve_experiment
from tests.fakes import CountedReality, Recorder, flat, paraboloid, small_setting


class Plain(Strategy):
    """Searches for the fittest in all three simulators."""

    name = "plain"
    ensemble = 3  # type: ignore[assignment]

    def select(self, belief: Any, search: Any, rng: Any) -> Any:
        return search(lambda _, fitnesses: fitnesses.mean(axis=1))


class Robust(Plain):
    """Transfers the fittest on average."""

    def transfer_simulators(self, tunables: Any) -> Any:
        return self.ensemble

    def transfer(self, belief: Any, search: Any, rng: Any) -> Any:
        return self.select(belief, search, rng)


class Patient(Plain):
    """Learns after every second sample."""

    def lessons(self, samples: Any) -> Any:
        return samples[: len(samples) // 2 * 2]


class Stubborn(Plain):
    """Learns nothing."""

    def lessons(self, samples: Any) -> Any:
        return ()


class Continuing(Plain):
    """Tunes nothing, and each of its searches begins with what the last one ended with."""

    tunes, continues = False, True

    def select(self, belief: Any, search: Any, rng: Any) -> Any:
        self.began = belief.members
        found = search(lambda _, fitnesses: fitnesses.mean(axis=1), start=belief.members)
        assert np.array_equal(search.members[0], found)
        return found

    def transfer_simulators(self, tunables: Any) -> Any:
        return self.ensemble

    def transfer(self, belief: Any, search: Any, rng: Any) -> Any:
        return self.select(belief, search, rng)


def steps_of(strategy: Any, **changes: Any) -> Any:
    return list(repetition(replace(small_setting(**changes), strategy=strategy)))


def of(kind: Any, steps: Any) -> Any:
    return [step for step in steps if isinstance(step, kind)]


def test_a_transfer_in_several_simulators_reports_the_score_and_costs_all_of_them() -> None:
    simulate = Recorder()
    steps = steps_of(Robust(), simulate=simulate)

    transferred, tuned = of(Transferred, steps), of(Tuned, steps)
    for controller, simulators in zip(transferred, tuned, strict=True):
        parameters = np.array([each.parameters for each in simulators.simulators])
        assert controller.fitness == pytest.approx(paraboloid(controller.genome[None], parameters).mean())
        assert controller.cost.rollouts + controller.cost.saved == 40 * 3
    assert sum(step.cost.rollouts for step in steps if hasattr(step, "cost")) == simulate.rollouts


def test_the_fitness_of_a_controller_that_no_search_found_is_unknown() -> None:
    class Known(Plain):
        def transfer(self, belief: Any, search: Any, rng: Any) -> Any:
            return belief.known

    (first, *_) = of(Transferred, steps_of(Known()))

    assert np.isnan(first.fitness)
    assert first.cost == Cost(saved=40)


def test_more_simulators_than_stated_are_refused_and_so_are_those_outside_of_the_bounds() -> None:
    class Greedy(Plain):
        def transfer(self, belief: Any, search: Any, rng: Any) -> Any:
            return search(lambda _, fitnesses: fitnesses[:, 0])

    class Outside(Plain):
        def transfer(self, belief: Any, search: Any, rng: Any) -> Any:
            return search(lambda _, fitnesses: fitnesses[:, 0], parameters=belief.parameters[:1] + 5)

    with pytest.raises(PluginBroken, match="searches in 3 simulators; permitted: 1 to 1"):
        steps_of(Greedy())
    with pytest.raises(PluginBroken, match=r"'plain' returned .* permitted: 0\.0 to 1\.0"):
        steps_of(Outside())


def test_fewer_simulators_than_stated_are_saved() -> None:
    class Modest(Plain):
        def select(self, belief: Any, search: Any, rng: Any) -> Any:
            return search(lambda _, fitnesses: fitnesses[:, 0], parameters=belief.parameters[:1])

    for step in of(Selected, steps_of(Modest())):
        assert step.cost.rollouts <= 30
        assert step.cost.rollouts + step.cost.saved == 30 * 3


def test_readings_are_given_to_a_search_that_asks_for_them_and_are_none_without_sensors() -> None:
    widths = []

    class Sensing(Plain):
        def select(self, belief: Any, search: Any, rng: Any) -> Any:
            def score(genomes: Any, outcomes: Any) -> Any:
                widths.append(outcomes.shape[1:])
                return outcomes[:, 0, 0]

            return search(score, senses=True)

    with_sensors = steps_of(Sensing(), sense=lambda genomes, parameters: seen(genomes, parameters))
    assert set(widths) == {(3, 3)}
    widths.clear()
    without = steps_of(Sensing())
    assert set(widths) == {(3, 1)}
    assert [flat(step) for step in of(Selected, with_sensors)] == [flat(step) for step in of(Selected, without)]


def test_candidates_are_the_only_genomes_that_a_search_evaluates_as_far_as_its_budget_goes() -> None:
    class Choosing(Plain):
        def select(self, belief: Any, search: Any, rng: Any) -> Any:
            candidates = np.column_stack([np.linspace(0, 0.9, 100), np.full(100, 0.5)])
            found = search(lambda genomes, _: genomes[:, 0], candidates=candidates)
            assert found[0] == candidates[29, 0]
            return found

    for step in of(Selected, steps_of(Choosing())):
        assert step.cost.rollouts == 30 * 3


def test_after_a_sample_that_teaches_nothing_simulators_controller_and_probe_stay_at_no_cost() -> None:
    reality = CountedReality()
    steps = steps_of(Patient(), reality=reality)

    tuned, transferred, probed = (of(kind, steps) for kind in (Tuned, Transferred, Probed))
    for kept in (1, 3):
        assert flat(tuned[kept].simulators) == flat(tuned[kept - 1].simulators)
        assert tuned[kept].cost == Cost(saved=50 * kept)
        assert flat(transferred[kept].genome) == flat(transferred[kept - 1].genome)
        assert (transferred[kept].fitness, transferred[kept].cost) == (transferred[kept - 1].fitness, Cost(saved=40))
        assert probed[kept].fitness == probed[kept - 1].fitness
    assert flat(tuned[2].simulators) != flat(tuned[1].simulators)
    assert reality.asked == 3 + 2  # three samples, and the probes of iterations 0 and 2
    samples = [step.sample.fitness for step in of(Measured, steps)]
    assert probed[3].recorded == max(probed[3].fitness, *samples)


def test_a_strategy_without_lessons_keeps_its_first_simulators_at_no_cost() -> None:
    tuned = of(Tuned, steps_of(Stubborn()))

    assert len({flat(step.simulators) for step in tuned}) == 1
    assert [step.cost for step in tuned] == [Cost(), *(Cost(saved=50 * count) for count in (1, 2, 3))]


def test_samples_that_are_no_lessons_are_not_tuned_on() -> None:
    class Choosy(Plain):
        def lessons(self, samples: Any) -> Any:
            return samples[-1:]

    tuned = of(Tuned, steps_of(Choosy()))

    assert [step.cost for step in tuned[1:]] == [Cost(rollouts=50 * 1, saved=50 * count) for count in (0, 1, 2)]


def test_a_strategy_that_does_not_tune_pays_for_none_and_searches_each_transfer_anew() -> None:
    steps = steps_of(Continuing())

    tuned, transferred = of(Tuned, steps), of(Transferred, steps)
    assert len({flat(step.simulators) for step in tuned}) == 1
    assert {step.cost for step in tuned} == {Cost()}
    assert all(step.cost.rollouts + step.cost.saved == 40 * 3 for step in transferred)


def test_a_strategy_that_continues_begins_each_search_with_the_members_of_the_last_one() -> None:
    strategy, log = Continuing(), list[Any]()
    for step in repetition(replace(small_setting(), strategy=strategy)):
        if isinstance(step, Selected | Transferred):
            before = [each.members for each in of(Selected | Transferred, log)]
            np.testing.assert_array_equal(strategy.began, before[-1] if before else np.empty((0, 0)))
            assert step.members.shape == (5, 2)
        log.append(step)

    assert not any(len(step.members) for step in of(Selected | Transferred, steps_of(Plain())))


@pytest.mark.parametrize(
    "strategy", [Robust(), Patient(), Stubborn(), Continuing()], ids=lambda each: type(each).__name__
)
def test_a_repetition_with_a_strategy_of_ones_own_resumes_bit_equal_wherever_it_stopped(strategy: Any) -> None:
    steps = steps_of(strategy)

    for stopped_after in range(len(steps) + 1):
        rest = repetition(replace(small_setting(), strategy=strategy), steps[:stopped_after])
        assert [flat(step) for step in rest] == [flat(step) for step in steps[stopped_after:]]


OPTIONS: list[tuple[str, dict[str, Any]]] = [
    *((name, {}) for name in sorted(strategies) if not strategies[name]().senses),  # the toy has no sensors
    ("domain_randomization", {"simulators": 3, "equal_rollouts": True}),
    ("back_to_reality", {"trials": 1, "learn_from_trials": True}),
    ("noise_envelope", {"simulators": 2, "fitness": "mean_minus_deviation", "equal_rollouts": True}),
    ("noise_envelope", {"base": "static_friction, dynamic_friction", "epsilon": 0.02}),
    ("weighted", {"simulators": 4, "uniqueness_weight": 1, "reliability_weight": 1, "information_weight": 0.5}),
    ("weighted", {"fit_weight": 0, "disagreement_weight": 0, "information_weight": 1, "information": "trace"}),
]


@pytest.mark.parametrize(("name", "options"), OPTIONS)
def test_every_strategy_runs_on_the_toy_and_costs_what_was_estimated(name: Any, options: Any) -> None:
    spec = ExperimentSpec.model_validate({
        "strategy": {"name": name, "options": options}, "robot": "toy_function", "iterations": 2, "repetitions": 1,
        "tunables": ["static_friction", "dynamic_friction"], "budget": "smoke",
    })  # fmt: skip
    resolved = resolve_experiment(spec)

    steps = list(repetition(setting(resolved, 0)))

    costs = [step.cost for step in steps if hasattr(step, "cost")]
    assert sum(cost.rollouts + cost.saved for cost in costs) == expected_rollouts(resolved)
    assert len(of(Probed, steps)) == (3 if strategies[name].takes_samples else 1)
    asks = bool(strategies[name]().transfer_simulators(2))
    assert all(np.isfinite(step.fitness) == asks for step in of(Transferred, steps))
    assert resolve_experiment(resolved) == resolved
