"""The Ray task that runs one repetition on one core, and its deliveries."""

import logging
from collections.abc import Callable, Iterator
from contextlib import suppress
from ctypes import CDLL
from dataclasses import replace
from time import perf_counter
from typing import TypeAlias

import ray
from ray.exceptions import RayTaskError

from gaplab.services.core.errors import RealityFailed
from gaplab.services.core.loop import Setting
from gaplab.services.core.ports import Reality
from gaplab.services.core.types import Measured, Probed
from gaplab.services.specs.assembly import engine_of, setting
from gaplab.services.specs.blame import describe, raised
from gaplab.services.store.lease import Claim, Delivered, Failure, Pulse, TimedStep
from gaplab.workers.checkpoints import recorded
from gaplab.workers.nodes import Versions, check_here
from gaplab.workers.permits import Handle, PermittedReality, asking
from gaplab.workers.pool import Pool

BATCH_S = 0.2
"""Shorter steps are delivered in batches; an answer of reality is delivered at once."""

Batch: TypeAlias = tuple[Delivered | Pulse | Failure, ...]
"""The items that a worker sends at once."""

log = logging.getLogger("gaplab.worker")


@ray.remote(num_cpus=1, max_retries=0, num_returns="streaming")
def run(claim: Claim, expected: Versions, checkpoint_s: float, permits: Handle | None) -> Iterator[Batch]:
    """Yield the steps that follow the claim's log, in batches; the first batch is empty, and shows that the task runs.

    Ray never retries the task: a repetition continues from its stored log, not from its beginning. The worker process
    keeps the engine loaded from task to task. An error is delivered as a text, because not every error can be sent.

    Raises:
        ClusterUnusable: this node lacks the expected versions.
        PluginDiffers: this process lacks those of the plug-ins.
    """
    check_here(expected)
    yield ()
    yield from delivered(lambda: _prepared(claim, expected, permits), claim, checkpoint_s)
    give_back_memory()


def give_back_memory() -> None:
    """Give the system what was freed: glibc keeps hundreds of MB of what engines had."""
    with suppress(AttributeError, OSError, TypeError):  # another C library
        CDLL(None).malloc_trim(0)


def delivered(prepare: Callable[[], Setting], claim: Claim, checkpoint_s: float) -> Iterator[Batch]:
    """Yield what follows the claim's log, in batches; if anything raises, the last batch is the failure."""
    try:
        yield from batches(recorded(prepare(), claim.log, claim.checkpoints, checkpoint_s))
    except (Exception, SystemExit) as error:  # noqa: BLE001 - a plug-in may raise anything
        yield (failure_of(error),)


def _prepared(claim: Claim, expected: Versions, permits: Handle | None) -> Setting:
    alone = setting(claim.spec, claim.number)
    if permits is not None:
        alone = replace(alone, reality=_permitted(alone.reality, claim, permits))
    pool = Pool(claim.spec, alone.simulate, alone.batch_size(), expected, alone.sense)
    return replace(alone, simulate=pool, sense=pool.sense, batch_size=pool.batch_size)


def _permitted(reality: Reality, claim: Claim, permits: Handle) -> PermittedReality:
    ref = claim.spec.reality.engine
    assert ref is not None, "permits are for hardware behind an engine"
    return PermittedReality(reality, engine_of(ref).stop, asking(permits, claim.id, claim.epoch))


def failure_of(error: BaseException) -> Failure:
    """Return the failure for an error; the message of reality's code stays hidden."""
    if not isinstance(error, RealityFailed):
        log.error("failed", exc_info=error)
        return Failure(describe(error))
    cause = error.__cause__ or error
    return Failure(f"reality failed: {raised(cause)}", f"reality failed: {describe(cause)}", of_reality=True)


def told(error: RayTaskError) -> str:
    """Return the sentence of an error that a task raised; one that could not be sent is a text already."""
    return describe(error.cause if isinstance(error.cause, Exception) else error)


def batches(deliveries: Iterator[Delivered | Pulse]) -> Iterator[Batch]:
    """Yield the deliveries in batches; a batch ends with all but a step of simulation, or when it is old."""
    batch: list[Delivered | Pulse] = []
    begun = perf_counter()
    for delivered in deliveries:
        batch.append(delivered)
        urgent = not isinstance(delivered, TimedStep) or isinstance(delivered.step, Measured | Probed)
        if urgent or perf_counter() - begun >= BATCH_S:
            yield tuple(batch)
            batch = []
            begun = perf_counter()
    if batch:
        yield tuple(batch)
