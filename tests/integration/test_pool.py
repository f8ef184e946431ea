"""One repetition on many cores, with the numbers of one."""

import os
import time

import numpy as np
import pytest
import ray

from schemas.spec import ExperimentSpec
from services.resolution import resolve_experiment
from services.settings import Settings
from services.simulation import setting
from workers import pool as pools
from workers.cluster import cluster
from workers.pool import Pool
from workers.spread import sizes

SPEC = resolve_experiment(ExperimentSpec.model_validate({"strategy": "informative", "budget": "smoke"}))


@pytest.fixture(scope="module")
def alone():
    return setting(SPEC, 0)


@pytest.fixture(scope="module", autouse=True)
def ray_with_two_warm_cores(alone):
    with cluster(Settings(workers=2)):
        ray.get([pools._part.remote(SPEC.model_dump_json(), {}, *asked(alone, 10, 1)) for _ in range(4)])
        yield


def asked(alone, genomes, simulators):
    rng = np.random.default_rng(0)
    return alone.genomes.draw(genomes, rng), alone.parameters.draw(simulators, rng)


@pytest.fixture
def pool(alone):
    """A pool that knows how long a rollout takes."""
    warm = Pool(SPEC, alone.simulate, 1)
    warm(*asked(alone, 2, 1))
    return warm


@pytest.mark.parametrize(("genomes", "simulators"), [(1, 1), (1, 8), (7, 1), (3, 5), (5, 3)])
def test_what_is_spread_over_cores_is_what_one_core_computes(alone, pool, genomes, simulators):
    question = asked(alone, genomes, simulators)

    np.testing.assert_array_equal(pool(*question), alone.simulate(*question))


def test_rollouts_are_spread_when_cores_are_idle_and_the_work_is_worth_it(alone, pool, monkeypatch):
    sent = []
    remote = pools._part.remote
    monkeypatch.setattr(pools._part, "remote", lambda *part: sent.append(part) or remote(*part))

    pool(*asked(alone, 1, 1))
    assert not sent

    deadline = time.monotonic() + 20
    while not sent:  # once a core is idle
        assert time.monotonic() < deadline
        pool(*asked(alone, 1, 12))


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
def test_a_call_is_dealt_in_large_parts_first_and_small_ones_in_the_end(rows, cores, least, parts):
    assert sizes(rows, cores, least) == parts


def test_it_asks_for_as_many_rollouts_at_a_time_as_keep_the_cores_busy(pool):
    deadline = time.monotonic() + 20
    while pool.batch() != 3:  # this process, and two idle cores
        assert time.monotonic() < deadline
        time.sleep(0.2)


@ray.remote(num_cpus=1, max_retries=0)
def dying(*part):
    os._exit(1)


@ray.remote(num_cpus=1, max_retries=0)
def dawdling(*part):
    time.sleep(60)


@pytest.mark.parametrize("other", [dying, dawdling])
def test_a_core_that_dies_or_dawdles_costs_time_and_no_result(alone, pool, monkeypatch, other):
    monkeypatch.setattr(pools, "_part", other)
    question = asked(alone, 1, 12)

    np.testing.assert_array_equal(pool(*question), alone.simulate(*question))
