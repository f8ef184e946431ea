"""The preset `lean`: what it sets, what stored specs mean without it, and that all of it repeats itself to the bit."""

from typing import Any

import pytest

from gaplab.schemas.plugin import PluginRef
from gaplab.schemas.resolved import ResolvedSpec
from gaplab.schemas.spec import ExperimentSpec, StudySpec
from gaplab.services.core.loop import repetition
from gaplab.services.core.optimizers.cma_es import CmaEs, CmaEsOptions
from gaplab.services.core.strategies import strategies
from gaplab.services.core.strategies.base import Diverse
from gaplab.services.core.tuners import tuners
from gaplab.services.core.tuners.search import SearchOptions, SearchTuner
from gaplab.services.specs.defaults import PRESETS
from gaplab.services.specs.resolution import expected_rollouts, resolve, resolve_experiment
from tests.fakes import flat, small_setting
from tests.parameters import few

DIVERSE = sorted(name for name, each in strategies.items() if issubclass(each, Diverse))
TUNER = SearchTuner(SearchOptions(equal_rollouts=True))
OFF = {"warm_start": False, "equal_rollouts": False}


def resolved(**spec: Any) -> ResolvedSpec:
    return resolve_experiment(
        ExperimentSpec.model_validate({"strategy": "informative", "robot": "toy_function"} | spec)
    )


def lean_setting(strategy: Any, **changes: Any) -> Any:
    """A small repetition with every part of `lean`."""
    options = {"simulators": 6, "weightiest": 3} if strategy in DIVERSE else {}
    own = strategies[strategy].controller_optimizer is not None
    controllers = {} if own else {"controller_optimizer": CmaEs(CmaEsOptions(members=5))}
    return small_setting(strategy, options, tuner=TUNER, **controllers, **changes)


class TestPreset:
    @pytest.mark.parametrize("preset", sorted(set(PRESETS) - {"lean"}))
    def test_every_part_is_off_in_all_other_presets(self, preset: Any) -> None:
        for name in DIVERSE:
            spec = resolved(strategy=name, budget=preset)

            assert spec.strategy.options["weightiest"] is None
            assert spec.tuner == PluginRef(name="search", options=OFF)
            assert spec.controller_optimizer == spec.optimizer == resolved().optimizer

    def test_lean_sets_every_part(self) -> None:
        spec = resolved(budget="lean")

        assert (spec.iterations, spec.repetitions) == (10, 40)
        assert spec.controller_optimizer.name == "cma_es"
        assert spec.optimizer == resolved().optimizer
        assert spec.tuner.options == {"warm_start": False, "equal_rollouts": True}
        assert spec.strategy.options["weightiest"] == 10
        assert resolved(budget="lean", strategy="simulated_fit").strategy.options == {}

    def test_a_name_tells_options_that_the_preset_does_not_set(self) -> None:
        whole = {"name": "informative", "options": {"weightiest": None}}

        assert resolved(budget="lean", strategy="informative").name == "informative"
        assert resolved(budget="lean", strategy=whole).name == "informative (weightiest None)"
        assert resolved(strategy=whole).name == "informative"

    def test_what_a_spec_gives_beats_the_preset(self) -> None:
        spec = resolved(
            budget="lean",
            controller_optimizer="steady_state",
            tuner={"name": "search", "options": OFF},
            strategy={"name": "informative", "options": {"weightiest": None, "simulators": 5}},
        )

        assert spec.controller_optimizer == resolved().optimizer
        assert spec.tuner.options == OFF
        assert (spec.strategy.options["weightiest"], spec.strategy.options["simulators"]) == (None, 5)

    def test_another_tuner_stays_as_it_is(self) -> None:
        assert resolved(budget="lean", tuner="climbers").tuner == resolved(tuner="climbers").tuner

    @pytest.mark.parametrize("name", sorted({**strategies, **tuners}))
    def test_the_options_that_it_sets_are_options(self, name: str) -> None:
        plugin = strategies[name] if name in strategies else tuners[name]

        plugin.Options.model_validate(plugin.preset("lean"))

    def test_a_resolved_spec_resolves_to_itself(self) -> None:
        parts = {"controller_optimizer": "cma_es", "tuner": {"name": "search", "options": {"warm_start": True}}}
        for changes in ({"budget": "lean"}, parts):
            for strategy in ("simulated_fit", *DIVERSE):
                spec = resolved(strategy=strategy, **changes)

                assert resolve_experiment(spec) == spec

    def test_the_whole_of_figure_4_is_less_than_a_tenth_of_the_papers(self) -> None:
        lean, paper = (
            sum(
                expected_rollouts(each) * each.repetitions
                for each in resolve(StudySpec.model_validate({"budget": budget, "direct_repetitions": 100}))
            )
            for budget in ("lean", "paper")
        )

        fit = (10 + 11) * 1_350 + sum(2_000 // samples * samples for samples in range(1, 11))
        weighed = fit + (19 + 9 * 9) * 1_350  # the first selection is in 20 simulators, nine are in 10
        assert lean == 40 * (2 * fit + 2 * weighed + 2 * (fit - 10 * 1_350)) + 100 * 1_350 == 21_456_360
        assert lean / paper < 0.1


class TestAllParts:
    @pytest.mark.parametrize("strategy", few(sorted(strategies), {"simulated_fit", "weighted"}.__contains__))
    def test_a_resumed_repetition_equals_an_uninterrupted_one_wherever_it_stopped(self, strategy: Any) -> None:
        steps = list(repetition(lean_setting(strategy)))

        assert [flat(step) for step in repetition(lean_setting(strategy))] == [flat(step) for step in steps]
        for stopped_after in range(len(steps) + 1):
            rest = repetition(lean_setting(strategy), steps[:stopped_after])
            assert [flat(step) for step in rest] == [flat(step) for step in steps[stopped_after:]]

    @pytest.mark.parametrize("strategy", ["simulated_fit", *DIVERSE])
    def test_no_number_depends_on_how_many_rollouts_are_asked_for_at_a_time(self, strategy: Any) -> None:
        one_by_one = [flat(step) for step in repetition(lean_setting(strategy))]

        together = repetition(lean_setting(strategy, batch_size=lambda: 9))

        assert [flat(step) for step in together] == one_by_one

    @pytest.mark.parametrize("strategy", ["simulated_fit", *DIVERSE])
    def test_they_change_what_is_computed(self, strategy: Any) -> None:
        lean, plain = lean_setting(strategy), small_setting(strategy)

        assert [flat(step) for step in repetition(lean)] != [flat(step) for step in repetition(plain)]
