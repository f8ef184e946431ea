"""One repetition as one Ray task: it streams its steps back, and never sees the database."""

from collections.abc import Iterator
from dataclasses import replace
from time import perf_counter

import ray

from schemas.spec import ExperimentSpec
from services.core.loop import repetition
from services.core.types import Measured, Probed, Step
from services.execution import TimedStep
from services.simulation import setting
from workers.nodes import Versions, check_here
from workers.pool import Pool

BATCH_S = 0.2
"""Steps shorter than this travel together; what reality answered never waits."""


@ray.remote(num_cpus=1, max_retries=0, num_returns="streaming")
def run(
    spec: ExperimentSpec, number: int, log: tuple[Step, ...], expected: Versions
) -> Iterator[tuple[TimedStep, ...]]:
    """The steps that follow the log, in batches, as they are computed; an empty batch says that it has its core.

    It is never retried by Ray: a repetition goes on from its stored log, not from its beginning. The engine stays warm
    in the worker process from one task to the next.

    Raises:
        ClusterUnusable: this node has not the versions that are expected.
    """
    check_here(expected)
    yield ()
    alone = setting(spec, number)
    pool = Pool(spec, alone.simulate, alone.batch(), expected)
    yield from batches(repetition(replace(alone, simulate=pool, batch=pool.batch), log))


def batches(steps: Iterator[Step]) -> Iterator[tuple[TimedStep, ...]]:
    """The steps with the time that each took; a batch ends with an answer of reality, or when it is old enough."""
    batch: list[TimedStep] = []
    begun = last = perf_counter()
    for step in steps:
        now = perf_counter()
        batch.append(TimedStep(step, now - last))
        last = now
        if isinstance(step, Measured | Probed) or now - begun >= BATCH_S:
            yield tuple(batch)
            batch = []
            begun = last = perf_counter()
    if batch:
        yield tuple(batch)
