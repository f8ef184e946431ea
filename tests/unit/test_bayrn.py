"""Bayesian domain randomization: which simulators come first, and where the next ones are."""

from typing import Any

import numpy as np

from gaplab.services.contract.strategies import TUNABLES, belief
from gaplab.services.core.loop import repetition
from gaplab.services.core.strategies.bayrn import BayRn, BayRnOptions
from gaplab.services.core.types import Sample, Selected, Tuned
from tests.fakes import flat, small_setting

BEST = np.array([0.8, 0.3])
"""The simulator from which controllers transfer best."""


def after(strategy: Any, fitnesses: Any) -> Any:
    """The next simulator after samples with these fitnesses."""
    return strategy.promising(belief(strategy, [Sample(np.array([0.5, 0.5]), value) for value in fitnesses]))


def transferred_from(simulator: Any) -> float:
    return float(1.0 - ((simulator - BEST) ** 2).sum())


def test_random_simulators_come_first_and_then_those_near_the_best() -> None:
    strategy, fitnesses, tried = BayRn(), list[float](), list[Any]()

    for _ in range(12):
        tried.append(after(strategy, fitnesses))
        fitnesses.append(transferred_from(tried[-1]))

    assert np.array_equal(tried[:3], belief(strategy).parameters)
    assert np.all((np.array(tried) >= TUNABLES.lower) & (np.array(tried) <= TUNABLES.upper))
    np.testing.assert_allclose(tried[-1], BEST, atol=0.15)


def test_a_simulator_whose_measurement_failed_says_nothing() -> None:
    strategy = BayRn(BayRnOptions(first=2))

    without, failed = after(strategy, [0.3, np.nan]), after(strategy, [0.3, np.nan, np.nan])

    assert np.array_equal(without, failed)
    assert np.array_equal(after(strategy, [np.nan] * 4), belief(strategy).parameters[-1])


def test_without_an_allowance_for_what_is_unknown_the_best_so_far_is_next() -> None:
    found = after(BayRn(BayRnOptions(beta=0.0, noise=1e-6)), [0.0, 1.0, 0.0])

    first = belief(BayRn()).parameters
    assert np.argmin(np.linalg.norm(first - found, axis=1)) == 1


def test_nothing_is_tuned_and_the_log_alone_says_which_simulator_is_next() -> None:
    setting = small_setting("bayrn", iterations=5)

    steps = list(repetition(setting))

    tunings = [step for step in steps if isinstance(step, Tuned)]
    assert {flat(step.simulators) for step in tunings} == {flat(tunings[0].simulators)}
    assert not any(step.cost.rollouts for step in tunings)
    for stopped_after in range(len(steps)):
        assert flat(next(repetition(setting, steps[:stopped_after]))) == flat(steps[stopped_after])
    assert len({step.genome.tobytes() for step in steps if isinstance(step, Selected)}) == 5
