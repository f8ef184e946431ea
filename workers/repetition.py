"""One repetition as one Ray task: it streams its steps back, and never sees the database."""

from collections.abc import Iterator
from dataclasses import replace
from time import perf_counter

import ray

from gaplab.services.core.types import Measured, Probed
from gaplab.services.running.execution import Checkpoint, Claim, Delivered
from gaplab.services.specs.assembly import setting
from gaplab.workers.checkpoints import recorded
from gaplab.workers.nodes import Versions, check_here
from gaplab.workers.pool import Pool

BATCH_S = 0.2
"""Steps shorter than this travel together; what reality answered never waits."""


@ray.remote(num_cpus=1, max_retries=0, num_returns="streaming")
def run(claim: Claim, expected: Versions, checkpoint_s: float) -> Iterator[tuple[Delivered, ...]]:
    """The steps that follow the claim's log, in batches, as they are computed; the first batch says that it has begun.

    It is never retried by Ray: a repetition goes on from its stored log, not from its beginning. The engine stays warm
    in the worker process from one task to the next.

    Raises:
        ClusterUnusable: this node has not the versions that are expected.
    """
    check_here(expected)
    yield ()
    alone = setting(claim.spec, claim.number)
    pool = Pool(claim.spec, alone.simulate, alone.batch_size(), expected)
    spread = replace(alone, simulate=pool, batch_size=pool.batch_size)
    yield from batches(recorded(spread, claim.log, claim.checkpoints, checkpoint_s))


def batches(delivered: Iterator[Delivered]) -> Iterator[tuple[Delivered, ...]]:
    """The same in batches; one ends with an answer of reality or a checkpoint, or when it is old enough."""
    batch: list[Delivered] = []
    begun = perf_counter()
    for each in delivered:
        batch.append(each)
        if _waits_for_nothing(each) or perf_counter() - begun >= BATCH_S:
            yield tuple(batch)
            batch = []
            begun = perf_counter()
    if batch:
        yield tuple(batch)


def _waits_for_nothing(delivered: Delivered) -> bool:
    return isinstance(delivered, Checkpoint) or isinstance(delivered.step, Measured | Probed)
