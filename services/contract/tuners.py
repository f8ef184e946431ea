"""The contract of a tuner."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from gaplab.services.contract.promises import check_repeats
from gaplab.services.core.answers import Answers
from gaplab.services.core.arrays import Fitnesses, FloatArray, Genomes, Outcomes, Parameters, frozen
from gaplab.services.core.discrepancies.readings import Readings
from gaplab.services.core.optimizers.steady_state import SteadyState
from gaplab.services.core.space import Space
from gaplab.services.core.tuners.base import Tuner, TuningTask
from gaplab.services.core.tuning import Misfit
from gaplab.services.core.types import Sample, Simulator

SPACE = Space.box([0.0, -2.0], [1.0, 2.0])
TRUTH = frozen([0.7, -1.0])
TIMES_S = frozen([0.25, 0.5, 0.75])
EVALUATIONS = 200
TOLERANCE = 0.1
"""Discrepancy by which the first simulator may be above the median; the noise of one reading is 1."""

Plugin = type[Tuner]


def sensed(genomes: Genomes, parameters: Parameters) -> Outcomes:
    """Return fitness and three readings `(n, m, 4)`: smooth functions of genomes `(n, 2)` and parameters `(m, 2)`."""
    places = (parameters - SPACE.lower) / SPACE.extent
    product = genomes[:, None, :] * places[None, :, :]
    readings = np.stack([product[..., 0], product[..., 1], np.sin(product.sum(axis=-1))], axis=-1)
    return np.concatenate([product.sum(axis=-1)[..., None], 100.0 * readings], axis=-1)


class Physics:
    """Physics that counts its rollouts, and fails above a value of the first tunable."""

    def __init__(self, fails_above: float = np.inf) -> None:
        self.fails_above = fails_above
        self.rollouts = 0
        self.asked: list[Parameters] = []

    def fitness(self, genomes: Genomes, parameters: Parameters) -> Fitnesses:
        """Return the fitness `(n, m)`."""
        return self.sense(genomes, parameters)[..., 0]

    def sense(self, genomes: Genomes, parameters: Parameters) -> Outcomes:
        """Return fitness and readings `(n, m, 4)`."""
        self.rollouts += len(genomes) * len(parameters)
        self.asked.append(parameters)
        found = sensed(genomes, parameters)
        found[:, parameters[:, 0] > self.fails_above] = np.nan
        return found


def samples() -> tuple[Sample, ...]:
    """Return three samples, measured where the tunables are `TRUTH`."""
    genomes = np.random.default_rng(4).random((3, 2))
    measured = sensed(genomes, TRUTH[None, :])[:, 0]
    rows = zip(genomes, measured, strict=True)
    return tuple(Sample(frozen(genome), float(row[0]), frozen(row[1:])) for genome, row in rows)


def tuned(
    tuner: Tuner, physics: Physics, ensemble: int = 1, seed: int = 0, evaluations: int = EVALUATIONS
) -> Sequence[Simulator]:
    """Return the simulators that a tuner finds."""
    misfit = _misfit(physics)
    optimizer = SteadyState().diverse(ensemble) if ensemble > 1 else SteadyState()
    rng = np.random.default_rng(seed)
    previous = tuple(Simulator(frozen(row)) for row in SPACE.draw(ensemble, rng))
    found = tuner.tune(TuningTask(misfit, SPACE, optimizer, ensemble, evaluations, previous), rng)
    return tuple(
        replace(
            each,
            parameters=frozen(each.parameters),
            squared_error=float(each.squared_error),
            interval=None if each.interval is None else frozen(each.interval),
        )
        for each in found
    )


def _misfit(physics: Physics) -> Misfit:
    return Misfit(Answers(physics.fitness, sense=physics.sense), samples(), Readings(), TIMES_S)


def finds_the_simulator(plugin: Plugin) -> None:
    """Finds the simulator where readings say enough."""
    found = tuned(plugin(), Physics())[0]
    away = np.abs(found.parameters - TRUTH) / SPACE.extent
    assert away.max() < 0.15, f"it finds {found.parameters.tolist()}; the truth is {TRUTH.tolist()}"


def returns_as_many_as_wanted(plugin: Plugin) -> None:
    """Returns one simulator or an ensemble, within the bounds."""
    for ensemble in (1, 7):
        found = np.array([each.parameters for each in tuned(plugin(), Physics(), ensemble)])
        assert found.shape == (ensemble, 2), f"of {ensemble} simulators it returns an array of shape {found.shape}"
        inside = (SPACE.lower <= found) & (found <= SPACE.upper)
        assert inside.all(), "it returns simulators outside the bounds"


def states_the_discrepancy_of_each(plugin: Plugin) -> None:
    """Returns each simulator with its own discrepancy."""
    found = tuned(plugin(), Physics(), 7)
    own = _misfit(Physics()).of(np.array([each.parameters for each in found]))
    stated = np.array([each.squared_error for each in found])
    assert np.allclose(own, stated), "its simulators have the discrepancy of others"


def returns_its_best_first(plugin: Plugin) -> None:
    """Returns its best estimate first: of seven simulators, one whose discrepancy is at most their median."""
    for seed in range(3):
        errors = [each.squared_error for each in tuned(plugin(), Physics(), 7, seed)]
        best = errors[0] <= np.median(errors) + TOLERANCE
        assert best, (
            f"of seven simulators the first has the discrepancy {errors[0]:.3g}; median: {np.median(errors):.3g}"
        )


def keeps_to_its_budget(plugin: Plugin) -> None:
    """Evaluates no more simulators than it may, within the bounds, also with the smallest budget that it permits."""
    for evaluations in (plugin().least_evaluations(SteadyState(), 7), EVALUATIONS):
        physics = Physics()
        tuned(plugin(), physics, 7, evaluations=evaluations)
        permitted = evaluations * len(samples())
        assert physics.rollouts <= permitted, f"it takes {physics.rollouts} rollouts; permitted: {permitted}"
        asked = np.vstack(physics.asked)
        assert np.all((SPACE.lower <= asked) & (asked <= SPACE.upper)), "it asks for simulators outside the bounds"


def divides_its_evaluations(plugin: Plugin) -> None:
    """Divides its evaluations by a whole number of 1 or more, for any number of samples."""
    for count in range(11):
        found = plugin().divisor(count)
        assert isinstance(found, int), f"for {count} samples its divisor is {found!r}"
        assert found >= 1, f"for {count} samples its divisor is {found!r}"


def repeats_itself(plugin: Plugin) -> None:
    """Finds the same with the same random stream, whatever it tuned before."""
    questions = {
        "what it finds": partial(_numbers, seed=0),
        "what it finds with another stream": partial(_numbers, seed=1),
    }
    check_repeats(plugin, questions, "use only `rng`, and keep nothing but `task.previous` from one call for the next")


def _numbers(tuner: Tuner, seed: int) -> FloatArray:
    found = tuned(tuner, Physics(), 7, seed)
    arrays = [array for each in found for array in (each.parameters, each.interval) if array is not None]
    scalars = [number for each in found for number in (each.squared_error, each.weight) if number is not None]
    return np.concatenate([*map(np.ravel, arrays), scalars])


def copes_with_failed_physics(plugin: Plugin) -> None:
    """Copes with simulators whose physics fails."""
    found = tuned(plugin(), Physics(fails_above=0.8), 3)
    assert np.isfinite(found[0].squared_error), "its best simulator is one whose physics fails"
    assert len(tuned(plugin(), Physics(fails_above=-1.0), 3)) == 3, "it returns too few where all physics fails"


def states_intervals_around_its_best(plugin: Plugin) -> None:
    """States intervals and weights that mean something, if it states any."""
    found = tuned(plugin(), Physics(), 7)
    for each in found:
        if each.interval is not None:
            assert each.interval.shape == (2, 2), f"its interval has the shape {each.interval.shape}; permitted: (p, 2)"
            assert (each.interval[:, 0] <= each.interval[:, 1]).all(), "an interval ends before it begins"
    weights = [each.weight for each in found if each.weight is not None]
    assert len(weights) in {0, len(found)}, "some of its simulators have a weight, and others none"
    assert not weights or np.isclose(sum(weights), 1.0), f"its weights sum to {sum(weights)}; permitted: 1"
