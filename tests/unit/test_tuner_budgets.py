"""No tuner spends more than its budget, however small, and the loop refuses one that does."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gaplab.schemas.plugin import PluginRef
from gaplab.services.contract.tuners import SPACE, Physics, tuned
from gaplab.services.core.errors import PluginBroken
from gaplab.services.core.loop import repetition
from gaplab.services.core.optimizers.base import Population
from gaplab.services.core.optimizers.steady_state import SteadyState
from gaplab.services.core.space import Space
from gaplab.services.core.tuners import tuners
from gaplab.services.core.tuners.abc_smc import AbcSmc
from gaplab.services.core.tuners.base import Tuner, TuningTask
from gaplab.services.core.tuners.gauss_newton import GaussNewton
from gaplab.services.core.tuners.search import SearchTuner
from gaplab.services.core.types import Budget, Tuned
from tests.fakes import flat, small_setting
from tests.parameters import few

OPTIONS: list[tuple[str, dict[str, Any]]] = [
    *((name, {}) for name in tuners),
    ("search", {"warm_start": True, "equal_rollouts": True}),
    ("gauss_newton", {"rounds": 1}),
    ("gauss_newton", {"rounds": 20, "evaluations": 8}),
    ("least_squares", {"loss": "huber", "step": 0.1}),
    ("abc_smc", {"rounds": 1}),
    ("abc_smc", {"rounds": 100}),
    ("abc_smc", {"rounds": 100, "kept": 0.9}),
    ("simopt", {"draws": 10, "updates": 100}),
]


def tuner(name: str, options: dict[str, Any]) -> Tuner:
    return tuners.create(PluginRef(name=name, options=options))


@pytest.mark.parametrize(("name", "options"), OPTIONS)
@pytest.mark.parametrize("ensemble", [1, 2, 7, 20])
def test_a_tuner_keeps_to_every_budget_that_a_spec_permits(name: str, options: Any, ensemble: int) -> None:
    """Specs, also stored ones, have at least 2 evaluations, and at least one for each simulator."""
    for evaluations in {max(2, ensemble), ensemble + 1, 2 * ensemble + 1, 30, 61}:
        physics = Physics()

        found = tuned(tuner(name, options), physics, ensemble, evaluations=evaluations)

        assert physics.rollouts <= evaluations * 3
        assert len(found) == ensemble
        assert all(np.isfinite(each.squared_error) for each in found)


@pytest.mark.parametrize(("name", "options"), OPTIONS)
@pytest.mark.parametrize("strategy", few(["simulated_fit", "informative"], "informative".__eq__))
@pytest.mark.parametrize("held_out", few([0.0, 0.5], (0.5).__eq__))
def test_no_tuning_of_a_repetition_costs_more_than_its_budget(
    name: str, options: Any, strategy: str, held_out: float
) -> None:
    setting = small_setting(
        strategy, {} if strategy == "simulated_fit" else {"simulators": 5},
        tuner=tuner(name, options), budget=Budget(40, 30, 15), held_out=held_out,
    )  # fmt: skip

    steps = list(repetition(setting))

    assert all(step.cost.saved >= 0 for step in steps if isinstance(step, Tuned))
    for stopped_after in range(len(steps)):
        assert flat(next(repetition(setting, steps[:stopped_after]))) == flat(steps[stopped_after])


def test_rounds_that_fit_have_the_numbers_of_before() -> None:
    """Four rounds of 15, as `evaluations // rounds` says."""
    physics = Physics()

    tuned(AbcSmc(), physics, evaluations=60)

    assert [len(asked) for asked in physics.asked] == [15] * 4


def test_rounds_are_fewer_where_the_budget_has_too_few_evaluations() -> None:
    for evaluations, sizes in ((60, [2] * 30), (61, [2] * 30), (3, [3]), (2, [2])):
        physics = Physics()

        tuned(tuner("abc_smc", {"rounds": 100}), physics, evaluations=evaluations)

        assert [len(asked) for asked in physics.asked] == sizes


class Spendthrift(SearchTuner):
    """Evaluates one simulator more than it may."""

    name = "spendthrift"

    def tune(self, task: TuningTask, rng: Any) -> Any:
        task.misfit.of(SPACE.draw(1, rng))
        return super().tune(task, rng)


def test_a_tuner_that_spends_more_than_its_budget_is_refused() -> None:
    with pytest.raises(PluginBroken, match=r"'spendthrift' .* took 51 rollouts; permitted: at most 50"):
        list(repetition(small_setting(tuner=Spendthrift())))


class Loose(SearchTuner):
    """Returns a list with lists, as plug-ins may."""

    name = "loose"

    def tune(self, task: TuningTask, rng: Any) -> Any:
        loose: Any = {"squared_error": np.float32(0.25), "interval": [[0.0, 1.0]] * 2}
        return [replace(each, parameters=each.parameters.tolist(), **loose) for each in super().tune(task, rng)]


def test_simulators_of_a_tuner_are_stored_as_arrays_and_numbers() -> None:
    setting = small_setting(tuner=Loose())

    _, *tuned = [step for step in repetition(setting) if isinstance(step, Tuned)]

    for (simulator,) in (step.simulators for step in tuned):
        assert (type(simulator.parameters), type(simulator.squared_error)) == (np.ndarray, float)
        assert simulator.interval is not None
        assert simulator.interval.shape == (2, 2)
    with pytest.raises(ValueError, match="read-only"):
        tuned[0].simulators[0].parameters[0] = 0.0


class Wordy(SearchTuner):
    """Returns an error that is not a number."""

    name = "wordy"

    def tune(self, task: TuningTask, rng: Any) -> Any:
        wrong: Any = "small"
        return tuple(replace(each, squared_error=wrong) for each in super().tune(task, rng))


def test_an_error_of_a_tuner_that_is_no_number_is_refused() -> None:
    with pytest.raises(
        PluginBroken, match=r"'wordy' .* returned a simulator whose error, interval or weight is not a number"
    ):
        list(repetition(small_setting(tuner=Wordy())))


class Listing(SteadyState):
    """Asks for lists, or for something of another shape."""

    name = "listing"
    reshaped: Any = staticmethod(lambda genomes: genomes.tolist())

    def ask(self, state: Population, rng: Any) -> Any:
        return self.reshaped(super().ask(state, rng))


def test_an_optimizer_may_ask_for_lists_and_for_no_other_shape() -> None:
    usual, listed = (list(repetition(small_setting(optimizer=each))) for each in (SteadyState(), Listing()))
    assert list(map(flat, usual)) == list(map(flat, listed))

    for wrong in (
        lambda genomes: genomes[0],
        lambda genomes: genomes[:, :-1],
        lambda _: [[0.5], [0.5, 0.5]],
        lambda _: "x",
    ):
        Listing.reshaped = staticmethod(wrong)
        with pytest.raises(
            PluginBroken, match=r"optimizer 'listing' asks for genomes of shape .*; permitted: \(n, 2\)"
        ):
            list(repetition(small_setting(optimizer=Listing())))


def test_least_squares_stays_within_bounds_that_rounding_would_leave() -> None:
    """An ensemble has members on the bounds, and 0.03 + (0.29 - 0.03) is above 0.29."""
    space = Space.box([0.03, 0.03], [0.29, 0.29])
    setting = small_setting("informative", {"simulators": 20}, tuner=GaussNewton(), parameters=space)

    tunings = [step for step in repetition(setting) if isinstance(step, Tuned)]

    assert max(simulator.parameters.max() for step in tunings for simulator in step.simulators) == 0.29


@pytest.mark.parametrize("slopes", [[1.0], [1.0] * 30, [0.0]])
def test_least_squares_has_an_answer_where_all_slopes_are_equal_and_where_nothing_differs(slopes: list[float]) -> None:
    differences: Any = SimpleNamespace(
        residuals=lambda parameters: (parameters - 0.3) * np.array(slopes),
        of=lambda parameters: parameters[:, 0],
        noise=0.0,
    )
    task = TuningTask(differences, Space.box([0.0], [1.0]), SteadyState(), 1, 60, ())

    found = tuner("least_squares", {}).tune(task, np.random.default_rng(0))[0]

    assert found.interval is not None
    if slopes[0]:
        assert [*found.parameters, *found.interval[0]] == pytest.approx([0.3] * 3, abs=1e-6)
    else:
        assert [*found.interval[0]] == [0.0, 1.0]
