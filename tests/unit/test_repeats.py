"""Repeats of measurements: mean, noise, weights, floors, and nothing of that without spread."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from gaplab.schemas.plugin import PluginRef
from gaplab.services.core.answers import Answers
from gaplab.services.core.arrays import frozen
from gaplab.services.core.loop import repetition
from gaplab.services.core.repeats import mean, pooled_variance, standard_error, variance_of_mean, weights
from gaplab.services.core.strategies.base import DiverseOptions
from gaplab.services.core.tuners import tuners
from gaplab.services.core.tuning import Misfit
from gaplab.services.core.types import Belief, Measured, Probed, Sample, Simulator
from gaplab.services.specs.measured import outcome_of
from gaplab.services.world.robots import robots
from tests.experiments import same
from tests.fakes import TRUTH, paraboloid, small_setting

GENOMES = np.random.default_rng(3).random((4, 2))


def sample(*values: float, genome: Any = (0.5, 0.5)) -> Sample:
    repeats = frozen(values) if len(values) > 1 else frozen([])
    return Sample(frozen(genome), mean(frozen(values)), repeats=repeats)


@pytest.mark.parametrize("value", [0.1, 1 / 3, 1e-300, -7.1, 1e300])
@pytest.mark.parametrize("count", [2, 3, 7, 10])
def test_the_mean_of_equal_values_is_the_value_to_the_bit_and_they_have_no_spread(value: float, count: int) -> None:
    values = frozen([value] * count)

    assert mean(values) == value
    assert (pooled_variance([values]), standard_error(values)) == (0.0, 0.0)


def test_noise_is_pooled_over_samples_with_repeats() -> None:
    samples = [sample(1.0, 3.0), sample(0.0, 0.0, 3.0), sample(9.0)]

    assert pooled_variance(each.repeats for each in samples) == pytest.approx((2.0 + 6.0) / 3)
    assert variance_of_mean(samples) == pytest.approx((2.0 + 6.0) / 3 / 2)
    assert variance_of_mean([sample(9.0)]) == variance_of_mean([]) == 0.0
    assert standard_error(frozen([1.0, 3.0])) == pytest.approx(1.0)
    assert standard_error(frozen([1.0])) is None


def test_samples_weigh_as_many_values_as_they_have_and_errors_stay_in_the_unit_of_fitness() -> None:
    assert weights([sample(1.0, 2.0), sample(3.0, 4.0)]) is None
    assert weights([sample(1.0), sample(3.0)]) is None
    assert weights([sample(1.0, 2.0, 3.0), sample(4.0)]).tolist() == [1.5, 0.5]  # type: ignore[union-attr]


def test_the_noise_of_a_misfit_is_the_variance_of_a_weighted_error_of_the_right_simulator() -> None:
    rng, sd, found = np.random.default_rng(5), 0.3, []
    for _ in range(400):
        truth = [float(paraboloid(genome[None], TRUTH[None])[0, 0]) for genome in GENOMES]
        counts = (1, 2, 4, 9)
        samples = [
            sample(*(value + sd * rng.standard_normal(count)), genome=genome)
            for value, count, genome in zip(truth, counts, GENOMES, strict=True)
        ]
        misfit = Misfit(Answers(paraboloid), samples)
        found.append((misfit.of(TRUTH[None])[0] / len(samples), misfit.noise))
        residuals = misfit.residuals(TRUTH[None])
        assert (residuals**2).sum() == pytest.approx(misfit.of(TRUTH[None])[0])
    error, noise = np.mean(found, axis=0)
    assert noise == pytest.approx(sd**2 / np.mean(counts), rel=0.05)
    assert error == pytest.approx(noise, rel=0.1)


def test_a_floor_under_the_weights_is_at_least_the_noise() -> None:
    def belief(*samples: Sample) -> Belief:
        found = small_setting()
        return Belief(found.genomes, found.known, samples, (Simulator(TRUTH),), found.parameters, found.names)

    options = DiverseOptions(least_error=0.1)
    assert options.floor(belief(sample(1.0), sample(2.0))) == pytest.approx(0.1**2)
    assert options.floor(belief(sample(1.0, 1.02), sample(2.0, 2.02))) == pytest.approx(0.1**2)
    assert options.floor(belief(sample(1.0, 3.0), sample(2.0, 4.0))) == pytest.approx(1.0)


@pytest.mark.parametrize("tuner", ["search", "gauss_newton"])
@pytest.mark.parametrize("strategy", ["simulated_fit", "simulated_fit_and_informative"])
def test_equal_repeats_give_the_numbers_of_one_value_to_the_bit(strategy: str, tuner: str) -> None:
    once = small_setting(strategy, tuner=tuners.create(PluginRef(name=tuner)))
    alone = list(repetition(once))
    repeated, log = [], []
    for step in repetition(once):
        log.append(_repeated(step))
        following = next(iter(repetition(once, log)), None)
        repeated.append(following)

    assert all(map(same, map(_bare, log), alone))
    assert all(map(same, map(_bare, filter(None, repeated)), alone[1:]))


def _repeated(step: Any) -> Any:
    """The same step, with a measurement that was done three times and gave the same."""
    if isinstance(step, Measured):
        repeats = frozen([step.sample.fitness] * 3)
        return Measured(step.iteration, replace(step.sample, fitness=mean(repeats), repeats=repeats))
    if isinstance(step, Probed):
        return replace(step, repeats=frozen([step.fitness] * 3))
    return step


def _bare(step: Any) -> Any:
    if isinstance(step, Measured):
        return Measured(step.iteration, replace(step.sample, repeats=frozen([])))
    return replace(step, repeats=frozen([])) if isinstance(step, Probed) else step


def test_readings_of_repeats_are_averaged_where_they_are_known() -> None:
    sensors = robots.create(PluginRef(name="quadruped", options={"counted_s": 0.25})).sensors
    tables = [[[0.1, None, 0.1, 0.2, None]], [[0.1, 0.3, 0.3, 0.2, None]], [[0.1, None, 0.2, 0.2, None]]]
    outcome, repeats = outcome_of(sensors, (0.1, 0.1, 0.1), tables)
    alone, _ = outcome_of(sensors, (0.1,), [[[0.1, 0.3, 0.2, 0.2, None]]])

    assert outcome.fitness == 0.1
    assert list(repeats) == [0.1] * 3
    assert outcome.readings == pytest.approx(alone.readings, nan_ok=True)
    assert same(outcome.readings[[0, 1, 3, 4]], alone.readings[[0, 1, 3, 4]])
