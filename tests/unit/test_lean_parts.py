"""The parts of the preset `lean`, one by one: an optimizer of controllers, warm starts, simulators of most weight."""

from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from gaplab.schemas.resolved import ResolvedSpec
from gaplab.schemas.spec import ExperimentSpec
from gaplab.services.core.errors import InvalidSpec
from gaplab.services.core.loop import repetition
from gaplab.services.core.optimizers.cma_es import CmaEs
from gaplab.services.core.optimizers.steady_state import SteadyState, SteadyStateOptions
from gaplab.services.core.scoring import weights_of
from gaplab.services.core.strategies import strategies
from gaplab.services.core.strategies.base import Diverse, DiverseOptions
from gaplab.services.core.tuners.search import SearchOptions, SearchTuner
from gaplab.services.core.types import Belief, History, Measured, Sample, Selected, Simulator, Transferred, Tuned
from gaplab.services.plugins.external import named_in
from gaplab.services.specs.assembly import setting
from gaplab.services.specs.resolution import expected_rollouts, resolve_experiment
from tests.fakes import Recorder, flat, paraboloid, small_setting

DIVERSE = sorted(name for name, each in strategies.items() if issubclass(each, Diverse))
TINY = {"preset": "lean", "controller_evaluations": 30, "selection_evaluations": 20, "simulator_evaluations": 75}
WARM = SearchTuner(SearchOptions(warm_start=True))


def resolved(**spec: Any) -> ResolvedSpec:
    return resolve_experiment(
        ExperimentSpec.model_validate({"strategy": "informative", "robot": "toy_function"} | spec)
    )


class Watched(SteadyState):
    """The paper's evolution, which remembers the spaces that it searches in."""

    def __init__(self, spaces: Any) -> None:
        super().__init__(SteadyStateOptions(population=5))
        self.spaces = spaces

    def init(self, space: Any) -> Any:
        self.spaces.append(space)
        return super().init(space)


class TestOptimizerOfControllers:
    def test_it_searches_for_controllers_and_the_optimizer_for_simulators(self) -> None:
        simulators, controllers = [], []  # type: ignore[var-annotated]
        one = small_setting(optimizer=Watched(simulators), controller_optimizer=Watched(controllers))

        list(repetition(one))

        assert [space is one.genomes for space in controllers] == [True] * 7
        assert [space is one.parameters for space in simulators] == [True] * 3

    def test_the_same_optimizer_changes_nothing(self) -> None:
        one = small_setting("informative")

        same = repetition(replace(one, controller_optimizer=one.optimizer))

        assert [flat(step) for step in same] == [flat(step) for step in repetition(one)]

    def test_a_spec_assembles_both(self) -> None:
        one = setting(resolved(controller_optimizer="cma_es"), 0)

        assert (type(one.controller_optimizer), type(one.optimizer)) == (CmaEs, SteadyState)

    @pytest.mark.parametrize(
        ("given", "pointer", "permitted"),
        [
            ("cma_se", "/controller_optimizer", None),
            (
                {"name": "steady_state", "options": {"population": 600}},
                "/budget/controller_evaluations",
                "at least 600",
            ),
        ],
    )
    def test_what_cannot_be_run_is_refused_with_its_place(self, given: Any, pointer: str, permitted: Any) -> None:
        with pytest.raises(InvalidSpec) as refusal:
            resolved(budget="desk", controller_optimizer=given)

        violations = {each.pointer: each for each in refusal.value.violations}
        assert pointer in violations
        assert "/budget/simulator_evaluations" not in violations
        assert permitted in (None, violations[pointer].permitted)

    def test_it_is_a_plug_in_that_the_spec_names(self) -> None:
        spec = resolved().model_dump(mode="json") | {"controller_optimizer": {"name": "mine", "options": {}}}

        assert {"optimizer mine", "optimizer steady_state"} < set(named_in(spec))


class TestWarmStart:
    @staticmethod
    def tuned(one: Any) -> Any:
        return [step for step in repetition(one) if isinstance(step, Tuned)]

    @pytest.mark.parametrize("strategy", ["simulated_fit", "informative"])
    def test_a_tuning_begins_with_the_simulators_of_the_one_before(self, strategy: str) -> None:
        options = {"simulators": 6} if strategy == "informative" else {}

        class Asked(SearchTuner):
            def tune(self, task: Any, rng: Any) -> Any:
                of, begun = task.misfit.of, []  # type: ignore[var-annotated]

                def noted(simulators: Any) -> Any:
                    begun.append(simulators)
                    return of(simulators)

                task.misfit.of = noted
                found = super().tune(task, rng)
                firsts.append(begun[0])
                return found

        for warm in (True, False):
            firsts = []  # type: ignore[var-annotated]
            before = self.tuned(small_setting(strategy, options, tuner=Asked(SearchOptions(warm_start=warm))))

            begun = [
                np.array_equal(first, [each.parameters for each in step.simulators])
                for first, step in zip(firsts, before, strict=False)
            ]
            assert begun == [warm] * 3

    def test_its_simulators_have_the_error_on_all_samples(self) -> None:
        steps: Any = list(repetition(small_setting("informative", {"simulators": 6}, tuner=WARM)))

        samples = [step.sample for step in steps if hasattr(step, "sample")]
        genomes, measured = np.array([each.genome for each in samples]), np.array([each.fitness for each in samples])
        for each in steps[-3].simulators:
            errors = (paraboloid(genomes, each.parameters[None])[:, 0] - measured) ** 2
            assert each.squared_error == pytest.approx(errors.sum())

    def test_it_costs_no_more_than_its_budget(self) -> None:
        for step in self.tuned(small_setting("informative", {"simulators": 6}, tuner=WARM))[1:]:
            assert step.cost.rollouts + step.cost.saved == 50 * step.iteration
            assert step.cost.saved >= 0

    def test_no_tuning_ends_worse_than_the_simulators_that_it_began_with(self) -> None:
        steps = list(repetition(small_setting("informative", {"simulators": 6}, tuner=WARM, iterations=6)))
        samples = [step.sample for step in steps if isinstance(step, Measured)]
        tunings = [step for step in steps if isinstance(step, Tuned)]

        for before, after in pairwise(tunings):
            seen = samples[: after.iteration]
            genomes, measured = np.array([each.genome for each in seen]), np.array([each.fitness for each in seen])
            begun = np.array([each.parameters for each in before.simulators])
            errors = ((paraboloid(genomes, begun) - measured[:, None]) ** 2).sum(axis=0)
            assert after.simulators[0].squared_error <= errors.min() * (1 + 1e-12)

    def test_without_simulators_before_it_is_a_search_from_scratch(self) -> None:
        sample = Sample(np.array([0.4, 0.6]), 0.8)
        scratch, warm = (
            small_setting("random", tuner=tuner, known_samples=(sample,)) for tuner in (SearchTuner(), WARM)
        )

        assert flat(next(repetition(warm))) == flat(next(repetition(scratch)))


class TestEqualRollouts:
    TUNER = SearchTuner(SearchOptions(equal_rollouts=True))

    def test_each_tuning_takes_as_many_rollouts_as_that_on_one_sample(self) -> None:
        steps = repetition(small_setting("simulated_fit", tuner=self.TUNER, iterations=4))

        spent = [step.cost.rollouts + step.cost.saved for step in steps if isinstance(step, Tuned)]

        assert spent == [0, 50, 50, 48, 48]

    def test_the_estimate_is_what_is_spent(self) -> None:
        spec = {
            "strategy": "random",
            "robot": "toy_function",
            "iterations": 5,
            "repetitions": 1,
            "held_out": 0.4,
            "budget": {"preset": "smoke", "simulator_evaluations": 100},
            "tuner": {"name": "search", "options": {"equal_rollouts": True}},
        }
        resolved = resolve_experiment(ExperimentSpec.model_validate(spec))

        costs = [step.cost for step in repetition(setting(resolved, 0)) if hasattr(step, "cost")]

        assert sum(each.rollouts + each.saved for each in costs) == expected_rollouts(resolved)

    def test_too_few_evaluations_for_the_last_tuning_are_refused(self) -> None:
        spec = {
            "strategy": "random",
            "robot": "toy_function",
            "budget": {"preset": "paper", "simulator_evaluations": 150},
            "tuner": {"name": "search", "options": {"equal_rollouts": True}},
        }
        with pytest.raises(InvalidSpec, match="equal_rollouts divides them by 10 samples") as refused:
            resolve_experiment(ExperimentSpec.model_validate(spec))

        (violation,) = refused.value.violations
        assert violation.pointer == "/budget/simulator_evaluations"
        assert violation.permitted == "at least 200"


class TestWeightiest:
    def test_the_first_selection_is_in_all_simulators_and_later_ones_in_the_weightiest(self) -> None:
        for name in set(DIVERSE) - {"fit_unless_near"}:  # that asks the best simulator, unless a sample is near
            simulate = Recorder()
            steps = repetition(small_setting(name, {"simulators": 6, "weightiest": 2}, simulate=simulate))
            counts = []
            for step in steps:
                if isinstance(step, Selected):
                    counts.append({simulators for _, simulators in simulate.calls})
                    assert step.cost.rollouts + step.cost.saved == 30 * (6 if step.iteration == 1 else 2)
                simulate.calls.clear()

            assert counts == [{6}, {2}, {2}]

    def test_a_failed_sample_teaches_no_weights(self) -> None:
        belief = some_belief([0.0, 0.0, 0.0], [Sample(np.zeros(2), float("nan"))])

        assert DiverseOptions(simulators=3, weightiest=2).weighed(belief) is belief

    def test_weight_counts_not_the_place(self) -> None:
        belief = some_belief([1.0, float("inf"), 0.5, 2.0], [Sample(np.zeros(2), 0.3)])
        options = DiverseOptions(simulators=4, weightiest=2, least_error=0.0)

        chosen = options.weighed(belief)

        assert [each.squared_error for each in chosen.simulators] == [1.0, 0.5]
        assert weights_of(chosen.simulators, options.floor(chosen)) == pytest.approx([1 / 3, 2 / 3])

    def test_posterior_shares_count_where_a_tuner_gives_them(self) -> None:
        belief = some_belief([1.0, 2.0, 3.0], [Sample(np.zeros(2), 0.3)])
        shares = tuple(
            replace(each, weight=share) for each, share in zip(belief.simulators, (0.2, 0.3, 0.5), strict=True)
        )

        chosen = DiverseOptions(simulators=3, weightiest=2).weighed(replace(belief, simulators=shares))

        assert [each.weight for each in chosen.simulators] == [0.3, 0.5]

    def test_as_many_as_the_ensemble_has_change_nothing(self) -> None:
        for name in DIVERSE:
            all_, counted = (
                [flat(step) for step in repetition(small_setting(name, {"simulators": 6, "weightiest": count}))]
                for count in (None, 6)
            )

            assert counted == all_

    def test_the_estimate_is_what_is_spent_and_saved(self) -> None:
        for name in ("simulated_fit", "direct", *DIVERSE):
            spec = resolved(strategy=name, budget=TINY, iterations=3)
            costs = [
                step.cost for step in repetition(setting(spec, 0)) if isinstance(step, Selected | Tuned | Transferred)
            ]

            assert sum(each.rollouts + each.saved for each in costs) == expected_rollouts(spec)

    def test_reliability_and_information_need_simulators_beside_those_that_count(self) -> None:
        options = {"simulators": 6, "weightiest": 2, "reliability_weight": 1.0, "information_weight": 1.0}
        simulate = Recorder()

        selections = [
            step
            for step in repetition(small_setting("weighted", options, simulate=simulate))
            if isinstance(step, Selected)
        ]

        spent = [step.cost.rollouts + step.cost.saved for step in selections]
        assert spent == [30 * (6 + 6 + 2), 30 * (2 + 2 + 2), 30 * (2 + 2 + 2)]


def some_belief(errors: Any, samples: Any) -> Any:
    """A belief with simulators of these errors."""
    one = small_setting("informative")
    simulators = tuple(Simulator(np.array([0.1 * rank, 0.5]), error) for rank, error in enumerate(errors))
    history = History(samples=tuple(samples), simulators=simulators)
    return Belief(
        space=one.genomes,
        known=one.known,
        samples=history.samples,
        simulators=simulators,
        tunables=one.parameters,
        names=one.names,
    )
