"""What `transferability` promises: controllers that reality repeats, from one simulator that nothing tunes."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from gaplab.schemas.spec import ExperimentSpec
from gaplab.services.core.arrays import frozen
from gaplab.services.core.errors import InvalidSpec
from gaplab.services.core.loop import belief_of, repetition
from gaplab.services.core.search import Allowance, ControllerSearch
from gaplab.services.core.types import Budget, Measured, Outcome, Probed, Sample, Selected, Transferred
from gaplab.services.specs.resolution import expected_rollouts, resolve_experiment
from gaplab.services.store.models import StepRow
from gaplab.services.store.queries.logs import columns_of, step_of
from tests.fakes import flat, small_setting

EDGE = 0.6
"""Beyond it, what is fit in simulation falls in reality."""


def walked(genomes: Any, parameters: Any) -> Any:
    """Fitness and two readings of two sensors at two times, `(n, m, 5)`: the larger the first gene, the fitter."""
    far, high = genomes[:, None, 0] + 0.0 * parameters[None, :, 0], genomes[:, None, 1] + 0.0 * parameters[None, :, 0]
    return np.stack([far, far / 2, high, far, high], axis=2)


def fallen(genome: Any) -> Any:
    fitness, *readings = walked(genome[None], np.zeros((1, 2)))[0, 0]
    beyond = max(0.0, genome[0] - EDGE)
    return Outcome(float(fitness - 3 * beyond), frozen(np.array(readings) - 10 * beyond))


def walking(iterations: int = 8, **options: Any) -> Any:
    small = small_setting("transferability", options, simulate=lambda *given: walked(*given)[..., 0])
    times = {"reading_times_s": frozen([1, 1, 2, 2]), "reading_periods": frozen(np.zeros(4))}
    budget = Budget(controller_evaluations=100, selection_evaluations=60)
    return replace(small, sense=walked, reality=fallen, iterations=iterations, budget=budget, **times)


def test_after_some_tests_the_fittest_that_reality_repeats_is_transferred() -> None:
    steps = list(repetition(walking()))

    probes = [step.fitness for step in steps if isinstance(step, Probed)]
    tested = [step.sample.genome[0] for step in steps if isinstance(step, Measured)]
    assert probes[0] < 0.0  # the fittest in simulation falls
    assert probes[-1] > 0.3
    assert min(tested) < EDGE < max(tested)
    transferred = [step for step in steps if isinstance(step, Transferred)]
    assert all(step.fitness == step.genome[0] for step in transferred)  # that in simulation is known


def test_the_evolution_goes_on_from_the_stored_log_alone() -> None:
    steps = list(repetition(walking(3)))
    stored = [step_of(StepRow(**columns_of(step), measured_by="someone")) for step in steps]

    assert all(len(step.members) == 20 for step in stored if isinstance(step, Selected | Transferred))
    for stopped_after in range(len(steps) + 1):
        rest = repetition(walking(3), stored[:stopped_after])
        assert [flat(step) for step in rest] == [flat(step) for step in steps[stopped_after:]]


@pytest.mark.parametrize(("exponent", "normalise"), [(2.0, True), (1.0, False)])
def test_the_estimate_is_the_mean_of_disparities_weighted_by_distance(exponent: float, normalise: bool) -> None:
    asked: list[Any] = []

    class Recorded(ControllerSearch):
        def __call__(self, score: Any, **given: Any) -> Any:
            def kept(genomes: Any, outcomes: Any) -> Any:
                asked.append((genomes, score(genomes, outcomes)))
                return asked[-1][1]

            return super().__call__(kept, **given)

    setting = walking(exponent=exponent, normalise=normalise)
    tested = [Sample(frozen(genes), *fallen(np.array(genes))) for genes in ([0.2, 0.5], [0.9, 0.5])]
    _, search = begun(setting, tested, Recorded)

    genomes, scores = (np.concatenate(each) for each in zip(*asked, strict=True))
    first = genomes[: len(asked[0][0])]
    behaviour = np.column_stack([0.75 * genomes[:, 0], genomes[:, 1], genomes])
    scale = behaviour[: len(first)].std(axis=0)
    apart = np.linalg.norm((behaviour[:, None] - behaviour[:2]) / scale, axis=2)
    weights = np.maximum(apart, 0.01) ** -exponent
    expected = weights @ [0.0, 10 * (0.9 - EDGE)] / (weights.sum(axis=1) if normalise else 2)
    np.testing.assert_allclose(-scores[:, 1], expected)
    np.testing.assert_allclose(scores[:, 2], apart.min(axis=1))
    np.testing.assert_array_equal(first[:2], [each.genome for each in tested])
    assert len(search.members) == 20


def begun(setting: Any, samples: Any, kind: Any) -> Any:
    """What a first selection does with these samples."""
    drawn = next(repetition(setting)).simulators  # type: ignore[union-attr]
    members = setting.genomes.draw(18, np.random.default_rng(2))
    known = belief_of(setting, setting.history([]))
    belief = replace(known, samples=tuple(samples), simulators=drawn, members=members)
    rng = np.random.default_rng(0)
    search = kind("transferability", setting.controller_optimizer, belief, setting.answers(), Allowance(80, 1), rng)
    return setting.strategy.select(belief, search, np.random.default_rng(1)), search


def quadruped(**changes: Any) -> ExperimentSpec:
    small = {"strategy": "transferability", "robot": "quadruped", "iterations": 3, "repetitions": 1}
    budget = {"controller_evaluations": 100, "selection_evaluations": 60, "simulator_evaluations": 2}
    return ExperimentSpec.model_validate(small | {"budget": budget} | changes)


def test_it_costs_its_searches_alone_and_brings_its_own_optimizer() -> None:
    resolved = resolve_experiment(quadruped(held_out=0.5))

    costs = [step.cost for step in repetition(walking(3)) if hasattr(step, "cost")]
    assert sum(cost.rollouts + cost.saved for cost in costs) == expected_rollouts(resolved) == 4 * 100 + 3 * 60
    assert (resolved.controller_optimizer.name, resolved.optimizer.name) == ("nsga2", "steady_state")
    assert resolve_experiment(resolved) == resolved


def test_as_published_has_the_authors_constants() -> None:
    resolved = resolve_experiment(quadruped(budget={"preset": "as_published"}))

    assert resolved.strategy.options == {"exponent": 1.0, "normalise": False}
    assert resolved.controller_optimizer.options["population"] == 100


def test_an_optimizer_with_one_objective_is_refused() -> None:
    with pytest.raises(InvalidSpec, match="has several objectives, and the optimizer cma_es has one"):
        resolve_experiment(quadruped(controller_optimizer="cma_es"))
