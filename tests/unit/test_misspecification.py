"""The check whether any simulator reproduces the samples, and what follows from it."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from gaplab.schemas.misfit import Identification
from gaplab.services.core.answers import Answers
from gaplab.services.core.arrays import NO_READINGS, frozen
from gaplab.services.core.discrepancies.fitness import SquaredFitness
from gaplab.services.core.discrepancies.readings import Readings
from gaplab.services.core.linear_models import DEVIATIONS, SURPRISING, fit_of, widened
from gaplab.services.core.optimizers.steady_state import SteadyState
from gaplab.services.core.space import Space
from gaplab.services.core.tuners.base import TuningTask
from gaplab.services.core.tuners.gauss_newton import GaussNewton
from gaplab.services.core.tuning import Misfit
from gaplab.services.core.types import Fit, Sample, Simulator
from gaplab.services.findings.identification import Means, verdicts
from gaplab.services.findings.misfit import Tuning, doubt, misfit_point
from gaplab.services.findings.simulator_sentences import unreproduced
from gaplab.services.world.sensing import Sensors

SPACE = Space.box([0.0, 10.0], [1.0, 30.0])
SENSORS = Sensors(("roll", "height"), ("rad", "m"), frozen([0.02, 0.005]), frozen([0.5, 1.0, 1.5]))
GENOMES = np.random.default_rng(8).random((4, 3))


def sense(genomes: Any, parameters: Any, tilt: float = 0.0) -> Any:
    """Fitness and readings `(n, m, 7)`, over their noise, that bend with the tunables; `tilt` is in no simulator."""
    places = (parameters - SPACE.lower) / SPACE.extent
    phase = genomes @ np.linspace(1.0, 4.0, 18).reshape(3, 6)
    readings = 20.0 * np.sin(phase[:, None] + 2.0 * places[None, :, :1]) + 15.0 * places[None, :, 1:] * phase[:, None]
    readings = readings + tilt * np.array([1.0, 0.0] * 3)
    return np.concatenate([readings[..., :1], readings], axis=-1)


def misfit(seed: int, tilt: float) -> Misfit:
    """The discrepancy from four samples of a reality between the bounds, measured with noise."""
    rng = np.random.default_rng(seed)
    seen = sense(GENOMES, SPACE.draw(1, rng), tilt)[:, 0]
    seen[:, 1:] += rng.normal(size=seen[:, 1:].shape)
    samples = [Sample(genome, float(row[0]), frozen(row[1:])) for genome, row in zip(GENOMES, seen, strict=True)]
    answers = Answers(lambda *_: np.empty((0, 0)), sense=sense, periods=SENSORS.reading_periods)
    return Misfit(answers, samples, Readings(), SENSORS.reading_times_s)


def found(seed: int, tilt: float) -> tuple[Simulator, Fit]:
    task = TuningTask(misfit(seed, tilt), SPACE, SteadyState(), 1, 60, ())
    (best,) = GaussNewton().tune(task, np.random.default_rng(seed))
    fit = fit_of(best, task.misfit, SPACE, np.random.default_rng(seed))
    assert fit is not None
    return best, fit


def test_a_reality_between_the_bounds_surprises_rarely_and_one_beyond_the_model_always() -> None:
    honest = [found(seed, 0.0)[1] for seed in range(10)]
    tilted = [found(seed, 25.0)[1] for seed in range(10)]

    assert sum(fit.surprise <= SURPRISING for fit in honest) <= 1
    assert all(fit.surprise <= SURPRISING for fit in tilted)
    assert np.median([fit.interval_scale for fit in honest]) < 1.6
    assert min(fit.interval_scale for fit in tilted) > 2.0


def test_a_reading_that_no_simulator_has_differs_and_a_sensor_that_failed_does_not_count() -> None:
    truth = SPACE.at(np.array([[0.3, 0.6]]))
    seen = sense(GENOMES, truth, 25.0)[:, 0]
    seen[0, 1] = np.nan
    seen[:, 6] = np.nan
    samples = [Sample(genome, float(row[0]), frozen(row[1:])) for genome, row in zip(GENOMES, seen, strict=True)]
    answers = Answers(lambda *_: np.empty((0, 0)), sense=sense, periods=SENSORS.reading_periods)

    errors = Misfit(answers, samples, Readings(), SENSORS.reading_times_s).reading_errors(truth[0])

    assert errors == pytest.approx([25.0, 0.0, 25.0, 0.0, 25.0, np.nan], nan_ok=True)


def test_without_a_known_noise_nothing_is_said() -> None:
    samples = [Sample(genome, 0.3) for genome in GENOMES]
    answers = Answers(lambda genomes, parameters: np.zeros((len(genomes), len(parameters))))
    best = Simulator(frozen([0.5, 20.0]))

    assert (
        fit_of(best, Misfit(answers, samples, SquaredFitness(), NO_READINGS), SPACE, np.random.default_rng(1)) is None
    )

    repeated = [replace(sample, repeats=frozen([0.2, 0.4])) for sample in samples]
    known = Misfit(answers, repeated, SquaredFitness(), NO_READINGS)
    fit = fit_of(best, known, SPACE, np.random.default_rng(1))
    assert fit is not None
    assert fit.reading_errors.size == 0


def test_physics_that_fails_around_the_best_simulator_says_nothing() -> None:
    silent = misfit(1, 0.0)
    silent._answers = Answers(
        lambda *_: np.empty((0, 0)), sense=lambda g, p: np.full((len(g), len(p), 7), np.nan), periods=SENSORS.periods
    )

    assert fit_of(Simulator(frozen([0.5, 20.0])), silent, SPACE, np.random.default_rng(1)) is None


def test_intervals_are_widened_around_the_estimate_within_the_bounds() -> None:
    ends, place = frozen([[0.4, 0.55], [10.0, 12.0]]), frozen([0.5, 11.0])
    noisy = Fit(1.0, 1.0, 3.0, noise=frozen([0.2, 4.0]) / DEVIATIONS)

    wide = widened(ends, place, Fit(1.0, 1.0, 3.0), SPACE)
    near = widened(frozen([[0.28, 0.72], [18.0, 26.0]]), frozen([0.5, 22.0]), Fit(1.0, 1.0, 2.0), SPACE)

    assert wide == pytest.approx(np.array([[0.2, 0.65], [10.0, 14.0]]))
    assert near == pytest.approx(np.array([[0.0, 1.0], [14.0, 30.0]]))
    assert widened(ends, place, None, SPACE) == pytest.approx(ends)
    more = np.array([[0.5 - np.hypot(0.3, 0.2), 0.75], [10.0, 16.0]])
    assert widened(ends, place, noisy, SPACE) == pytest.approx(more)


def test_where_answers_are_smooth_noise_is_most_of_the_error_and_the_intervals_have_it() -> None:
    inside = {"with": 0, "without": 0}
    for seed in range(30):
        truth = SPACE.draw(1, np.random.default_rng(seed))[0]
        best, fit = found(seed, 0.0)
        assert best.interval is not None
        for name, known in (("with", fit), ("without", replace(fit, noise=NO_READINGS))):
            lower, upper = widened(best.interval, best.parameters, known, SPACE).T
            inside[name] += int(((lower <= truth) & (truth <= upper)).sum())

    assert inside["with"] >= 0.85 * 60
    assert inside["without"] < 0.5 * 60


def tuning(surprise: float) -> Tuning:
    fit = Fit(8.0, surprise, 1.0, frozen([1.0, 2.0, 9.0, np.nan, 5.0, 1.0]))
    interval = frozen([[0.45, 0.55], [10.0, 30.0]])
    return Tuning(frozen([0.5, 20.0]), 200.0, 2, np.nan, np.nan, interval=interval, discrepancy=Readings(), fit=fit)


def test_it_is_said_how_far_off_and_where_most_and_identified_is_not() -> None:
    tunings = [tuning(0.02), tuning(0.04), tuning(0.4)]

    said = unreproduced("abc", tunings, SENSORS, "× noise")

    assert said.startswith(
        "no simulator reproduces the samples: the best err by 10 × noise a sample, where noise and rough physics would "
        "leave 2 (2 of 3 repetitions say so); most differs roll, by 6 × noise or 0.12 rad, most at 1 s, then height, "
    )
    assert "the height or slope of the ground, a weak or slow motor, mass, delay" in said
    points = [misfit_point(1, tunings, ["grip", "mass"], SPACE)]
    grip, mass = verdicts(points, [2], Means(), doubt(tunings, simulated=True))
    assert (grip.verdict, mass.verdict) == (Identification.DOUBTFUL, Identification.NOT)
    assert grip.sentence.startswith("grip: doubtful, for no simulator reproduces the samples; ")
    assert unreproduced("abc", [tuning(0.02), tuning(0.4), tuning(0.4)], SENSORS, "× noise") == ""
    assert unreproduced("abc", [replace(tuning(0.02), fit=None)], SENSORS, "× noise") == ""


def test_a_tunable_is_identified_only_where_the_model_was_tested_and_is_credible() -> None:
    points = [misfit_point(1, [tuning(0.4)], ["grip", "mass"], SPACE)]
    unknown = replace(tuning(0.4), fit=None)

    sure, exact, less, untested = (
        verdicts(points, [2], Means(), doubt([each], simulated=simulated))[0]
        for each, simulated in ((tuning(0.4), False), (unknown, True), (tuning(0.1), False), (unknown, False))
    )

    assert sure.verdict is exact.verdict is Identification.IDENTIFIED
    assert less.verdict is untested.verdict is Identification.PARTLY
    assert less.sentence.startswith("grip: partly identified, for the samples raise some doubt about the model; ")
    assert untested.sentence.startswith("grip: partly identified, for nothing tells noise from a wrong model; ")
    assert untested.helps == ("repeats of a measurement, or the discrepancy readings",)
