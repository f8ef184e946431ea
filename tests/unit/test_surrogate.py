"""What sequential surrogate optimization promises beside the contract."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from gaplab.schemas.plugin import PluginRef
from gaplab.services.contract.strategies import GridSearch, belief
from gaplab.services.core.loop import repetition
from gaplab.services.core.strategies import strategies
from gaplab.services.core.types import Measured, Sample, Selected, Transferred
from tests.fakes import TRUTH, CountedReality, Recorder, paraboloid, small_setting


def steps_of(name: str, kind: Any, **changes: Any) -> Any:
    return [step for step in repetition(small_setting(name, **changes)) if isinstance(step, kind)]


def away(first: Any, second: Any) -> Any:
    return np.linalg.norm(small_setting().genomes.apart(first, second))


def test_surrogate_finds_the_summit_of_reality_without_any_simulator() -> None:
    simulate = Recorder()

    transferred = steps_of("surrogate", Transferred, iterations=10, simulate=simulate)

    assert simulate.rollouts == 0
    np.testing.assert_array_equal(transferred[0].genome, small_setting().known)
    assert away(transferred[-1].genome, TRUTH) < 0.05


def test_surrogate_begins_with_variations_of_the_known_controller() -> None:
    first = [step.genome - small_setting().known for step in steps_of("surrogate", Selected)]

    assert np.abs(first).max() <= 0.25
    assert np.min(first) < 0 < np.max(first)


def test_no_sample_of_surrogate_is_near_another_unless_all_controllers_are() -> None:
    samples = [step.sample.genome for step in steps_of("surrogate", Measured, iterations=10)]

    for number, sample in enumerate(samples[3:], 3):
        assert min(away(sample, other) for other in samples[:number]) >= 0.05 * 2**0.5


def test_surrogate_does_not_try_a_failed_controller_again() -> None:
    reality = CountedReality(lambda genome: float("nan") if away(genome, TRUTH) < 0.1 else -away(genome, TRUTH))

    samples = [step.sample for step in steps_of("surrogate", Measured, iterations=10, reality=reality)]

    failed = [each.genome for each in samples if np.isnan(each.fitness)]
    assert failed
    apart = [away(one, other) for place, one in enumerate(failed) for other in failed[:place]]
    assert min(apart, default=1.0) >= 0.05 * 2**0.5


@pytest.mark.parametrize(("transferred_at", "disputes"), [(0.0, True), (0.3, False)])
def test_fit_unless_near_selects_the_most_disputed_only_if_the_transferred_is_near_a_sample(
    transferred_at: float, disputes: bool
) -> None:
    strategy = strategies.create(PluginRef(name="fit_unless_near", options={"simulators": 3}))
    sample = Sample(np.array([0.5, 0.5]), 0.8)
    believed = replace(belief(strategy, [sample]), members=sample.genome[None] + transferred_at)

    genome = strategy.select(believed, GridSearch(believed), np.random.default_rng(0))

    disputed = strategies.create(PluginRef(name="informative", options={"simulators": 3}))
    most = disputed.select(believed, GridSearch(believed), np.random.default_rng(0))
    np.testing.assert_allclose(genome, most if disputes else believed.parameters[0], atol=0.02)


def test_fit_unless_near_never_tries_next_to_a_sample_what_it_takes_for_fit() -> None:
    samples = [step.sample.genome for step in steps_of("fit_unless_near", Measured, iterations=5)]
    plain = [step.sample.genome for step in steps_of("simulated_fit", Measured, iterations=5)]

    assert nearest(samples) > nearest(plain)


def nearest(genomes: Any) -> Any:
    return min(away(one, other) for place, one in enumerate(genomes) for other in genomes[:place])


def tilted(genomes: Any, parameters: Any) -> Any:
    """Simulators that none of which is right: they take a wide gene for fit."""
    return paraboloid(genomes, parameters) + genomes[:, 1:]


def test_residual_corrects_what_no_simulator_reproduces() -> None:
    corrected = steps_of("residual", Transferred, iterations=8, simulate=tilted)
    tuned = steps_of("simulated_fit", Transferred, iterations=8, simulate=tilted)

    assert away(corrected[-1].genome, TRUTH) < 0.1 < away(tuned[-1].genome, TRUTH)


def test_residual_corrects_nothing_while_no_simulator_survives_the_samples() -> None:
    asked: list[Any] = []

    def search(score: Any, *, start: Any, **_: Any) -> Any:
        asked.append(score(start, np.full((1, 1), np.nan)))
        asked.append(score(start + 0.1, np.ones((1, 1))))
        return start[0]

    residual: Any = strategies.create(PluginRef(name="residual"))
    residual.transfer(belief(residual, [Sample(TRUTH, 5.0)]), search, np.random.default_rng(0))

    assert [float(scores[0]) for scores in asked] == pytest.approx([np.nan, 1.0], nan_ok=True)
