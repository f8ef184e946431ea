"""Readings: what sensors say, from a robot to its samples."""

from typing import Any

import numpy as np
import pytest

from gaplab.schemas.plugin import PluginRef
from gaplab.schemas.spec import ExperimentSpec
from gaplab.services.core.answers import Answers, pack
from gaplab.services.core.arrays import frozen, nearest
from gaplab.services.core.discrepancies import discrepancies
from gaplab.services.core.discrepancies.readings import Readings, ReadingsOptions
from gaplab.services.core.errors import InvalidSpec, PluginBroken
from gaplab.services.core.loop import repetition
from gaplab.services.core.tuning import Misfit
from gaplab.services.core.types import Measured, Probed, Sample
from gaplab.services.measuring.answering import check_values
from gaplab.services.specs.assembly import setting
from gaplab.services.specs.measured import needs_readings, outcome_of
from gaplab.services.specs.resolution import resolve_experiment
from gaplab.services.specs.robots import sensors
from gaplab.services.world.robots.base import Sensors
from gaplab.services.world.robots.quadruped import Quadruped

SENSORS = Sensors(("roll", "x"), ("rad", "m"), frozen([0.1, 2.0]), frozen([1.0, 2.0, 3.0]))


def quadruped(**changes: Any) -> Any:
    small = {"strategy": "random", "iterations": 1, "repetitions": 1, "engine": "mujoco"}
    budget = {"preset": "smoke", "controller_evaluations": 30, "simulator_evaluations": 30}
    return resolve_experiment(ExperimentSpec.model_validate(small | {"budget": budget} | changes))


def test_readings_are_in_units_of_noise_and_come_time_by_time() -> None:
    values = np.array([[0.1, 2.0], [0.2, 4.0], [0.3, 6.0]])

    readings = SENSORS.standardised(values)

    assert (SENSORS.size, readings.tolist()) == (6, pytest.approx([1, 1, 2, 2, 3, 3]))
    assert SENSORS.reading_times_s.tolist() == [1, 1, 2, 2, 3, 3]
    assert np.allclose(SENSORS.values(readings), values)


TURNING = Sensors(("roll", "x"), ("rad", "m"), frozen([0.1, 2.0]), frozen([1.0, 2.0]), frozen([2 * np.pi, 0.0]))
"""Sensors of which the first one is an angle."""


def on_its_back(*rolls: float) -> Any:
    """Readings of repeats, each of one angle at both times."""
    return [[[roll, 1.0], [roll, 1.0]] for roll in rolls]


@pytest.mark.parametrize(
    ("rolls", "mean"),
    [
        ((3.13, -3.13), np.pi),
        ((-3.13, 3.13), np.pi),
        ((3.0, -3.2, 3.0), 3.0277),
        ((0.25, 0.75), 0.5),
        ((0.5, 0.5), 0.5),
    ],
)
def test_the_mean_of_angles_is_that_on_a_circle(rolls: Any, mean: float) -> None:
    outcome, _ = outcome_of(TURNING, [0.0] * len(rolls), on_its_back(*rolls))

    roll, x = TURNING.values(outcome.readings)[0]
    assert (abs(roll), x) == (pytest.approx(mean, abs=1e-4), 1.0)


def test_a_simulator_that_lies_on_its_back_reproduces_a_robot_on_its_back() -> None:
    outcome, _ = outcome_of(TURNING, [0.0], on_its_back(-3.13))
    sample = Sample(np.zeros(1), *outcome)
    lying, standing = TURNING.standardised(np.array(on_its_back(3.13, 0.0)))
    simulated = np.array([[[0.0, *lying], [0.0, *standing]]])
    answers = Answers(
        lambda genomes, _: np.zeros((len(genomes), 2)), sense=lambda *_: simulated, periods=TURNING.reading_periods
    )

    misfit = Misfit(answers, [sample], Readings(), TURNING.reading_times_s)

    near, far = misfit.of(np.zeros((2, 1)))
    assert near == pytest.approx((2 * np.pi - 6.26) ** 2 / 0.1**2 / 2, rel=1e-6)
    assert far == pytest.approx(3.13**2 / 0.1**2 / 2, rel=1e-6)
    assert (misfit.residuals(np.zeros((2, 1))) ** 2).sum(axis=1) == pytest.approx([near, far])


def test_what_does_not_turn_is_not_shifted_and_nothing_becomes_nan() -> None:
    readings, periods = np.array([np.nan, 70.0, 1.0, 50.0]), TURNING.reading_periods

    shifted = nearest(readings, np.array([0.0, -70.0, np.nan, 50.0]), periods)

    assert np.array_equal(shifted, readings, equal_nan=True)
    assert nearest(readings, readings, SENSORS.reading_periods[:4]) is readings


def test_sensing_changes_no_fitness_and_repeats_itself() -> None:
    made, rng = setting(quadruped(), 0), np.random.default_rng(0)
    genomes, parameters = made.genomes.draw(3, rng), made.parameters.draw(2, rng)

    outcomes = made.sense(genomes, parameters)

    assert outcomes.shape == (3, 2, 1 + Quadruped().sensors.size)
    assert np.array_equal(outcomes[..., 0], made.simulate(genomes, parameters))
    assert np.array_equal(outcomes, made.sense(genomes, parameters))
    assert np.isfinite(outcomes).all()


def test_the_quadruped_senses_how_it_stands_and_where() -> None:
    made = setting(quadruped(), 0)
    sensors = Quadruped().sensors

    roll, pitch, height, x, y = sensors.values(made.reality(made.known).readings).T

    assert (height > 0.05).all()
    assert (np.abs(roll) < 0.5).all()
    assert (np.abs(pitch) < 0.5).all()
    reached = np.hypot(x[-1], y[-1]) / (sensors.times_s[-1] - sensors.times_s[0])
    assert reached == pytest.approx(made.reality(made.known).fitness, rel=0.3)


def test_a_sample_and_a_probe_carry_their_readings() -> None:
    steps = list(repetition(setting(quadruped(discrepancy="readings"), 0)))

    measured = [step for step in steps if isinstance(step, Measured)]
    probed = [step for step in steps if isinstance(step, Probed)]
    assert [len(step.sample.readings) for step in measured] == [50]
    assert [len(step.readings) for step in probed] == [50, 50]


def test_early_readings_count_and_a_failed_sensor_does_not() -> None:
    discrepancy = Readings(ReadingsOptions(seconds=1.0))
    simulated = np.zeros((1, 1, 7))
    measured = np.array([[9.0, 1.0, np.nan, 3.0, 5.0, 100.0, 100.0]])

    (term,) = discrepancy.terms(simulated, measured, SENSORS.reading_times_s)[0]

    assert term == pytest.approx((1 + 9 + 25) / 3)  # the last time is two seconds after the first


def test_physics_that_failed_is_nan_even_where_reality_has_no_readings() -> None:
    simulated, measured = np.zeros((1, 2, 7)), np.full((1, 7), np.nan)
    simulated[0, 1], measured[0, 0] = np.nan, 0.3

    terms = Readings().terms(simulated, measured, SENSORS.reading_times_s)

    assert terms.tolist() == [[0.0, pytest.approx(np.nan, nan_ok=True)]]


EARLY = [0.02, 0.01, 0.1, 0.0, 0.0]
WITHOUT = [None] * 5
TOLD = "a reading up to 1 s after the first is missing: the discrepancy readings compares nothing else"


@pytest.mark.parametrize("readings", [None, [[*[WITHOUT] * 9, EARLY]], [[WITHOUT] * 10]])
def test_what_lacks_the_readings_that_are_compared_is_refused(readings: Any) -> None:
    """It would fit every simulator, so tuning would be random."""
    sample = {"genome": [0.5] * 24, "values": [0.4], "readings": readings}

    with pytest.raises(InvalidSpec, match=f"^/reality/samples/0/readings: {TOLD}.*in `readings`$"):
        quadruped(discrepancy="readings", reality={"kind": "physical", "samples": [sample]})
    with pytest.raises(InvalidSpec, match=f"^/readings: {TOLD}.*let the driver return .fitness, readings.*answer`$"):
        check_values(quadruped(discrepancy="readings", reality={"kind": "physical"}), (0.4,), readings, None)

    check_values(quadruped(reality={"kind": "physical", "samples": [sample]}), (0.4,), readings, None)


def test_one_early_reading_is_enough_and_a_failed_measurement_needs_none() -> None:
    spec = quadruped(discrepancy="readings", reality={"kind": "physical"})

    early: Any = [[EARLY, *[WITHOUT] * 9]]
    check_values(spec, (0.4,), early, None)
    check_values(spec, None, None, None)


def test_a_spec_that_compares_readings_needs_a_robot_that_has_some() -> None:
    with pytest.raises(InvalidSpec) as refused:
        resolve_experiment(
            ExperimentSpec(
                strategy=PluginRef(name="random"),
                robot=PluginRef(name="toy_function"),
                discrepancy=PluginRef(name="readings"),
            )
        )

    (violation,) = refused.value.violations
    assert (violation.pointer, violation.permitted) == (
        "/discrepancy",
        ["absolute_fitness", "huber", "squared_fitness"],
    )


def test_a_tuner_that_needs_squares_says_so() -> None:
    with pytest.raises(InvalidSpec, match="needs a sum of squares"):
        quadruped(tuner="gauss_newton", discrepancy="absolute_fitness")


def test_readings_that_a_robot_does_not_have_cannot_be_asked_for() -> None:
    answers = Answers(lambda genomes, parameters: np.zeros((len(genomes), len(parameters))))

    with pytest.raises(PluginBroken, match="no sensors"):
        answers.sense(np.zeros((1, 1)), np.zeros((1, 1)))


def test_answers_with_readings_go_through_checkpoints() -> None:
    recorded: list[Any] = []

    class Recorder:
        def genomes_per_call(self, simulators: int) -> int:
            return 2

        def record(self, answers: Any, rollouts: int, budget: int) -> None:
            recorded.extend(answers)

    calls = []

    def sense(genomes: Any, parameters: Any) -> Any:
        calls.append(len(genomes))
        return np.arange(len(genomes) * len(parameters) * 3, dtype=float).reshape(len(genomes), len(parameters), 3)

    def fitness(genomes: Any, parameters: Any) -> Any:
        return sense(genomes, parameters)[..., 0]

    genomes, parameters = np.random.default_rng(0).random((3, 2)), np.random.default_rng(1).random((4, 2))
    first = Answers(fitness, recorder=Recorder(), sense=sense).sense(genomes, parameters)

    again = Answers(fitness, checkpoints=[pack(recorded)], sense=sense).sense(genomes, parameters)

    assert np.array_equal(first, again)
    assert calls == [2, 1]


@pytest.mark.parametrize(("discrepancy", "needed"), [("readings", True), ("squared_fitness", False)])
def test_an_experiment_says_whether_its_answers_need_readings(discrepancy: str, needed: bool) -> None:
    spec = quadruped(discrepancy=discrepancy, reality={"kind": "physical"})
    found = sensors(spec)

    assert found is not None
    assert needs_readings(discrepancies.create(spec.discrepancy), found) is needed
