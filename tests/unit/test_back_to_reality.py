"""What Back-to-Reality promises beside the contract."""

from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from gaplab.schemas.plugin import PluginRef
from gaplab.services.contract.strategies import SPACE, belief
from gaplab.services.core.loop import repetition
from gaplab.services.core.strategies import strategies
from gaplab.services.core.types import Cost, Measured, Sample, Selected, Transferred, Tuned
from tests.fakes import flat, small_setting


def btr(**options: Any) -> Any:
    return strategies.create(PluginRef(name="back_to_reality", options=options))


def sample(x: float, y: float, fitness: float) -> Sample:
    return Sample(np.array([x, y]), fitness)


class Asked:
    """A search that remembers what it was to begin with."""

    start: Any = None

    def __call__(self, score: Any, *, start: Any = None, **_: Any) -> Any:
        self.start = start
        return np.array([0.5, 0.5])


def test_a_round_is_a_search_and_trials_that_cost_no_rollout_and_teach_no_simulator() -> None:
    steps = list(repetition(replace(small_setting(iterations=6), strategy=btr(trials=2))))
    selected = [step for step in steps if isinstance(step, Selected)]
    tuned = [step for step in steps if isinstance(step, Tuned)]

    assert [step.iteration for step in selected if step.cost.rollouts] == [1, 4]
    for before, after in pairwise(tuned):
        taught = after.iteration in (1, 4)
        assert (flat(before.simulators) != flat(after.simulators)) == taught
        assert bool(after.cost.rollouts) == taught


def test_the_best_measured_controller_is_transferred_at_no_cost_also_after_a_trial() -> None:
    steps = list(repetition(replace(small_setting(iterations=6), strategy=btr(trials=2))))
    samples = [step.sample for step in steps if isinstance(step, Measured)]
    first, *transferred = [step for step in steps if isinstance(step, Transferred)]

    np.testing.assert_array_equal(first.genome, small_setting().known)
    for step in transferred:
        best = max(samples[: step.iteration], key=lambda each: each.fitness)
        np.testing.assert_array_equal(step.genome, best.genome)
        assert step.cost == Cost()


@pytest.mark.parametrize("last", [1.5, float("nan")])
def test_a_trial_mutates_the_fittest_of_its_round_by_a_step_that_success_widens(last: float) -> None:
    before = [sample(0.9, 0.9, 9.0)] * 5
    strategy, measured = btr(), [sample(0.4, 0.4, 1.0), sample(0.5, 0.5, 2.0), sample(0.1, 0.1, last)]

    trial = strategy.select(belief(strategy, [*before, *measured]), Asked(), np.random.default_rng(7))

    step = 0.05 * 1.22 * 0.95 * np.random.default_rng(7).standard_normal((1, 2))[0]
    np.testing.assert_allclose(trial, np.array([0.5, 0.5]) + step)


def test_a_search_begins_with_the_best_measured_controller_and_its_mutants() -> None:
    first, second, strategy = Asked(), Asked(), btr(trials=1, mutants=30)
    known = belief(strategy, [sample(0.5, 0.5, 2.0), sample(0.1, 0.1, 1.0)])

    strategy.select(belief(strategy), first, np.random.default_rng(0))
    strategy.select(known, second, np.random.default_rng(0))

    assert first.start is None
    np.testing.assert_array_equal(second.start[0], [0.5, 0.5])
    assert second.start.shape == (31, 2)
    assert 0.05 < SPACE.apart(second.start[1:], second.start[0]).std() < 0.15


def test_only_the_first_sample_of_a_round_is_a_lesson_unless_trials_are() -> None:
    samples = [sample(0.1, 0.1, float(number)) for number in range(7)]

    assert [each.fitness for each in btr(trials=2).lessons(samples)] == [0.0, 3.0, 6.0]
    assert list(btr(trials=2, learn_from_trials=True).lessons(samples)) == samples
