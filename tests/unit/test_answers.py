"""A step that was interrupted is repeated from what simulators had answered, to the last bit."""

from dataclasses import replace
from itertools import cycle, product
from typing import Any

import numpy as np
import pytest

from gaplab.schemas.plugin import PluginRef
from gaplab.services.core.answers import BLOCK, Answers, pack, unpack
from gaplab.services.core.loop import next_step, repetition
from gaplab.services.core.optimizers import optimizers
from gaplab.services.core.optimizers.steady_state import SteadyState, SteadyStateOptions
from gaplab.services.core.search import maximise
from gaplab.services.core.space import Space
from gaplab.services.core.strategies import strategies
from gaplab.services.core.types import Budget, History
from tests.fakes import Recorder, flat, paraboloid, small_setting
from tests.parameters import few

BUDGET = Budget(controller_evaluations=24, selection_evaluations=20, simulator_evaluations=24)


class Interrupted(Exception):
    """The power went off."""


class Interruption:
    """A recorder of answers that interrupts the step after some calls."""

    def __init__(self, calls: Any) -> None:
        self.left = calls
        self.answers = []  # type: ignore[var-annotated]

    def genomes_per_call(self, simulators: Any) -> int:
        if not self.left:
            raise Interrupted
        self.left -= 1
        return 1_000

    def record(self, answers: Any, rollouts: Any, budget: int) -> None:
        self.answers += answers


def half_broken(genomes: Any, parameters: Any) -> Any:
    """The paraboloid, where physics fails on a part of the space."""
    return np.where(genomes[:, :1] < 0.3, np.nan, paraboloid(genomes, parameters))


def setting_of(strategy: Any, optimizer: Any, simulate: Any = half_broken, batch: Any = 1) -> Any:
    chosen = optimizers.create(PluginRef(name=optimizer, options={"population": 6}))
    small = small_setting(strategy, optimizer=chosen, budget=BUDGET, simulate=simulate, batch_size=lambda: batch)
    return replace(small, iterations=min(2, small.iterations))


def interrupted(setting: Any, history: Any, calls: Any, answers: Any = ()) -> Any:
    """What the step had been answered when it was interrupted after so many calls; None if it was not."""
    recorder = Interruption(calls)
    try:
        next_step(setting, history, Answers(setting.simulate, setting.batch_size, answers, recorder))
    except Interrupted:
        return pack(recorder.answers)
    return None


def resumed(setting: Any, history: Any, answers: Any) -> Any:
    """The step after the interruption, and how many rollouts it still took."""
    simulate = Recorder(setting.simulate)
    return next_step(setting, history, Answers(simulate, setting.batch_size, answers)), simulate.rollouts


EVERY = list(product(sorted(strategies), sorted(optimizers), [(1, 8), (8, 1), (1, 1)]))
FEW = list(zip(sorted(strategies), cycle(sorted(optimizers)), cycle([(1, 8), (8, 1)]), strict=False))
"""Each strategy, in turn with each optimizer, before and after in batches."""


def named(chosen: Any) -> str:
    strategy, optimizer, (before, after) = chosen
    return f"{strategy}-{optimizer}-{before}-{after}"


@pytest.mark.parametrize("chosen", few(EVERY, FEW.__contains__, named))
def test_a_step_interrupted_anywhere_equals_one_that_was_not(chosen: Any) -> None:
    strategy, optimizer, (before, after) = chosen
    whole = setting_of(strategy, optimizer)
    history = History()
    for step in repetition(whole):
        calls = 0
        while (answers := interrupted(setting_of(strategy, optimizer, batch=before), history, calls)) is not None:
            again, _ = resumed(setting_of(strategy, optimizer, batch=after), history, [answers])
            assert flat(again) == flat(step), (type(step), calls)
            calls = 2 * calls + 1
        history = history.after(step)


@pytest.mark.parametrize("optimizer", sorted(optimizers))
@pytest.mark.parametrize("strategy", few(sorted(strategies), {"informative", "weighted"}.__contains__))
def test_nothing_that_was_answered_is_simulated_again(strategy: Any, optimizer: Any) -> None:
    setting = setting_of(strategy, optimizer)
    history = History()
    for step in repetition(setting):
        _, all_of_it = resumed(setting, history, ())
        calls = 0
        while (answers := interrupted(setting, history, calls)) is not None:
            _, left = resumed(setting, history, [answers])
            assert left == all_of_it - sum(len(row) for _, row in unpack(answers))
            calls = 2 * calls + 1
        history = history.after(step)


def test_a_step_may_be_interrupted_again_and_again() -> None:
    setting = setting_of("informative", "steady_state", batch=8)
    history = History()
    for step in repetition(setting):
        answers = []  # type: ignore[var-annotated]
        while (more := interrupted(setting, history, 3, answers)) is not None:
            answers.append(more)
        again, left = resumed(setting, history, answers)
        assert flat(again) == flat(step)
        assert left <= 3 * 20 * 24
        history = history.after(step)


def test_answers_of_another_step_are_of_no_use_and_do_no_harm() -> None:
    setting = setting_of("simulated_fit", "steady_state")
    steps = list(repetition(setting))
    histories = [History()]
    for step in steps:
        histories.append(histories[-1].after(step))
    transfer, tuning = 1, 5
    wrong = interrupted(setting, histories[transfer], 10)

    again, rollouts = resumed(setting, histories[tuning], [wrong])

    assert flat(again) == flat(steps[tuning])
    assert rollouts == resumed(setting, histories[tuning], ())[1]


def test_answers_survive_packing_to_the_last_bit() -> None:
    rng = np.random.default_rng(0)
    awkward = np.array([[np.nan, -0.0, 5e-324], [np.inf, 0.1 + 0.2, -1.7976931348623157e308]])
    answers = [(rng.bytes(16), row) for row in (awkward[0], awkward[1], awkward[0, :1])]

    unpacked = list(unpack(pack(answers)))

    assert [(key, row.tobytes()) for key, row in unpacked] == [(key, row.tobytes()) for key, row in answers]
    assert len(pack(answers)) == 2 * 8 + 3 * 16 + 7 * 8


def test_many_simulators_are_asked_in_parts() -> None:
    simulate = Recorder()
    genomes, parameters = (
        np.random.default_rng(0).random((2, 2)),
        np.random.default_rng(1).random((2 * BLOCK + 1, 2)),
    )

    fitnesses = Answers(simulate)(genomes, parameters)

    assert simulate.calls == [(2, BLOCK), (2, BLOCK), (2, 1)]
    np.testing.assert_array_equal(fitnesses, paraboloid(genomes, parameters))


@pytest.mark.parametrize("cores", [1, 8, 16])
@pytest.mark.parametrize("offspring", [1, 2, 5, 12])
def test_newcomers_that_are_simulated_ahead_fill_the_idle_cores_and_no_more(offspring: Any, cores: Any) -> None:
    found, cost, calls = searched(offspring, cores)
    alone, same_cost, _ = searched(offspring, 1)

    assert (found.genomes.tobytes(), found.fitness.tobytes()) == (alone.genomes.tobytes(), alone.fitness.tobytes())
    assert cost == same_cost
    assert max(calls) <= max(6, offspring, cores)


def test_nothing_is_simulated_ahead_that_the_budget_does_not_reach() -> None:
    first = np.random.default_rng(0).random((6, 2))  # as the optimizer draws them

    _, cost, calls = searched(5, 16, lambda genomes, _: np.isin(genomes, first).all(axis=1, keepdims=True) * 1.0)

    assert sum(calls) == cost.rollouts


def searched(offspring: Any, cores: Any, simulate: Any = paraboloid) -> Any:
    """What a search finds in one simulator, its cost, and how many genomes it asked for in each call."""
    simulated, rng = Recorder(simulate), np.random.default_rng(0)
    answers = Answers(simulated, lambda: cores)
    answers.budget = 60
    optimizer = SteadyState(SteadyStateOptions(population=6, offspring=offspring))
    found = maximise(
        optimizer,
        Space.box([0.0, 0.0], [1.0, 1.0]),
        lambda asked: answers(asked.genomes, np.array([[0.7, 0.2]]), asked.following)[:, 0],
        60,
        rng,
    )
    return found, answers.cost, [genomes for genomes, _ in simulated.calls]
