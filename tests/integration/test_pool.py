"""One repetition on many cores, with the numbers of one."""

import os
import signal
from typing import Any

import numpy as np
import pytest
import ray

from gaplab.schemas.spec import ExperimentSpec
from gaplab.services.core.loop import repetition
from gaplab.services.specs.assembly import setting
from gaplab.services.specs.resolution import resolve_experiment
from gaplab.services.store.lease import Claim, TimedStep
from gaplab.workers import ray_tasks
from gaplab.workers.checkpoints import CHECKPOINT_S
from gaplab.workers.pool import Pool, SharedCall, sizes
from tests.processes import processes_of_ray
from tests.waiting import wait_until

SPEC = resolve_experiment(ExperimentSpec.model_validate({"strategy": "informative", "budget": "smoke"}))


pytestmark = pytest.mark.usefixtures("ray")


@pytest.fixture(scope="module")
def alone() -> Any:
    return setting(SPEC, 0)


def asked(alone: Any, genomes: Any, simulators: Any) -> Any:
    rng = np.random.default_rng(0)
    return alone.genomes.draw(genomes, rng), alone.parameters.draw(simulators, rng)


@pytest.fixture
def pool(alone: Any) -> Any:
    """A pool that knows how long a rollout takes, and has a helper."""
    warm = Pool(SPEC, alone.simulate, 1)
    warm(*asked(alone, 2, 1))
    wait_until(lambda: warm.batch_size() > 1)  # without work, which would keep the helper from starting
    return warm


@pytest.fixture
def spreads(monkeypatch: pytest.MonkeyPatch) -> Any:
    """What was spread over cores."""
    spread = []
    run = SharedCall.run
    monkeypatch.setattr(SharedCall, "run", lambda self: spread.append(self) or run(self))  # type: ignore[func-returns-value]
    return spread


@pytest.mark.parametrize(("genomes", "simulators"), [pytest.param(1, 1, marks=pytest.mark.release), (3, 5)])
def test_what_is_spread_over_cores_is_what_one_core_computes(
    alone: Any, pool: Any, genomes: Any, simulators: Any
) -> None:
    question = asked(alone, genomes, simulators)

    np.testing.assert_array_equal(pool(*question), alone.simulate(*question))


@pytest.mark.release
def test_rollouts_are_spread_if_there_are_several(alone: Any, pool: Any, spreads: Any) -> None:
    pool(*asked(alone, 1, 1))
    assert not spreads

    pool(*asked(alone, 1, 12))
    assert spreads


def until(pool: Any, alone: Any, batch: Any) -> None:
    """Wait until so many rollouts are what keeps the cores busy; one call has said that there is work for them."""
    pool(*asked(alone, batch, 1))
    wait_until(lambda: pool.batch_size() == batch)


@pytest.mark.release
def test_it_asks_for_as_many_rollouts_at_a_time_as_keep_the_cores_busy(alone: Any, pool: Any) -> None:
    until(pool, alone, 3)  # this process, and two idle cores


@pytest.mark.release
def test_a_long_call_gets_help_that_came_after_it_began(alone: Any, spreads: Any) -> None:
    question = asked(alone, 10, 20)

    first = iter([True])  # each wait counts as the time of a rollout, and rows of slow rollouts are shared one by one

    def slow(genomes: Any, parameters: Any) -> Any:
        if next(first, False):
            wait_until(lambda: sharing._helpers.ready(*question))
        return alone.simulate(genomes, parameters)

    sharing = Pool(SPEC, slow, 1)
    sharing(*question)

    assert spreads


@pytest.mark.parametrize("signum", [signal.SIGKILL, pytest.param(signal.SIGSTOP, marks=pytest.mark.release)])
def test_a_helper_that_dies_or_dawdles_costs_time_and_no_result(
    alone: Any, pool: Any, spreads: Any, signum: Any
) -> None:
    question = asked(alone, 1, 12)
    expected = alone.simulate(*question)

    for helper in processes_of_ray("Helper"):
        os.kill(helper, signum)
    got = pool(*question)

    np.testing.assert_array_equal(got, expected)
    assert spreads[-1].lost
    assert pool.batch_size() == 1  # it is not asked again


@pytest.mark.release
def test_one_of_several_helpers_that_dies_is_asked_no_more(alone: Any, pool: Any) -> None:
    question = asked(alone, 1, 2)
    until(pool, alone, 3)
    live, dead = pool._helpers.ready(*question)
    ray.kill(dead)

    spread = SharedCall([question] * 6, alone.simulate, [live, dead], rollout_s=10.0)
    spread.run()
    pool._helpers.helped(but_for=spread.dead)

    assert set(spread.dead) == {dead}
    assert dead not in pool._helpers.ready(*question)
    assert live in pool._helpers.ready(*question)


@pytest.mark.parametrize(
    ("rows", "cores", "least", "parts"),
    [
        (20, 2, 1, [8, 1, 1, 1, 1, 8]),  # first and last begin; the cores meet in the middle
        (20, 20, 1, [1] * 20),
        (20, 4, 2, [4, 2, 2, 4, 4, 4]),
        (3, 5, 1, [1, 1, 1]),
        (5, 2, 9, [5]),
    ],
)
def test_a_call_is_dealt_in_large_parts_first_and_small_ones_in_the_end(
    rows: Any, cores: Any, least: Any, parts: Any
) -> None:
    assert sizes(rows, cores, least) == parts


def test_a_task_computes_every_step_of_a_repetition() -> None:
    spec = resolve_experiment(
        ExperimentSpec.model_validate(
            {"strategy": "random", "robot": "toy_function", "iterations": 2, "repetitions": 1, "budget": "smoke"}
        )
    )
    claim = Claim(id=0, epoch=0, experiment_id="none", number=0, spec=spec)

    stream = ray_tasks.run.remote(claim, {}, CHECKPOINT_S, None)

    steps = [each for batch in stream for each in ray.get(batch) if isinstance(each, TimedStep)]  # type: ignore[attr-defined]
    assert len(steps) == sum(1 for _ in repetition(setting(spec, 0)))
