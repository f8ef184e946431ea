"""Tasks of Ray: they compute claimed repetitions, each on one core and what is idle beside it, on whatever node."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from time import monotonic
from typing import Any, TypeAlias

import ray
from ray import ObjectRefGenerator
from ray.exceptions import RayError, RayTaskError
from ray.util.scheduling_strategies import NodeAffinitySchedulingStrategy

from gaplab.services.core.loop import Setting
from gaplab.services.plugins.folders import PluginDiffers
from gaplab.services.specs.resolution import hardware_of
from gaplab.services.store.lease import Claim, Failure
from gaplab.services.store.session import Store
from gaplab.workers.errors import ClusterUnusable, TaskLost
from gaplab.workers.expected import Versions, check_here
from gaplab.workers.nodes import process_for, told
from gaplab.workers.permits import Key
from gaplab.workers.pool import Pool
from gaplab.workers.sensitivity import Checks
from gaplab.workers.task import Batch, Patience, delivered, give_back_memory, prepared

ANSWER_S = 0.5
"""Seconds that an answer about a permit may take; a process that stands still gives none, and the permit expires."""

Handle: TypeAlias = Any
"""A handle of a Permits actor, which Ray does not type."""


@ray.remote(num_cpus=0, max_restarts=-1)
class Permits:
    """The permits of one supervisor, in a separate process: they expire even if the supervisor is stopped.

    It runs on the supervisor's node, with which it shares the monotonic clock. So permits that arrive late, because
    this process or the network stood still, expire in time all the same.

    If the process dies, Ray starts another. It permits nothing until the next heartbeat renews the permits.
    """

    def __init__(self) -> None:
        self._until: dict[Key, float] = {}

    def renew(self, keys: Sequence[Key], until: float) -> None:
        """Permit these measurements, and no others, to move hardware until a time of the monotonic clock."""
        self._until = dict.fromkeys(keys, until)

    def left(self, key: Key) -> float:
        """Return the seconds for which the measurement may still move hardware; 0 or less if it may not."""
        return self._until.get(key, 0.0) - monotonic()


def permits_here() -> Handle:
    """Start the process of the permits on this process's node."""
    here = NodeAffinitySchedulingStrategy(ray.get_runtime_context().get_node_id(), soft=False)
    return Permits.options(scheduling_strategy=here).remote()  # type: ignore[attr-defined]  # Ray adds it


def asking(permits: Handle, id_: int, epoch: int) -> Callable[[int], float]:
    """Return a function that asks for the seconds that are left of a permit, given the place of the step in the log.

    It raises TimeoutError if there is no answer in time, or the permits' process died.
    """

    def left(step: int) -> float:
        try:
            return float(ray.get(permits.left.remote((id_, epoch, step)), timeout=ANSWER_S))
        except RayError as error:
            raise TimeoutError from error

    return left


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
    yield from delivered(lambda: _shared(claim, expected, permits), claim, checkpoint_s)
    give_back_memory()


def _shared(claim: Claim, expected: Versions, permits: Handle | None) -> Setting:
    alone = prepared(claim, None if permits is None else asking(permits, claim.id, claim.epoch))
    pool = Pool(claim.spec, alone.simulate, alone.batch_size(), expected, alone.sense)
    return replace(alone, simulate=pool, sense=pool.sense, batch_size=pool.batch_size)


@dataclass(frozen=True)
class RayTask:
    """A repetition in Ray; see `Task`."""

    stream: ObjectRefGenerator

    def take(self) -> Batch | None:
        """Return the next batch, or None at the end; see `Task`."""
        try:
            batch: Batch = ray.get(next(self.stream))
        except StopIteration:
            return None
        except RayTaskError as error:
            if isinstance(error.cause, ClusterUnusable | PluginDiffers):
                raise error.cause from error
            return (Failure(told(error)),)
        except RayError as error:
            raise TaskLost(f"the worker was lost: {type(error).__name__}") from error
        return batch

    def cancel(self) -> None:
        """End the task at once."""
        ray.cancel(self.stream, force=True)


class RayTasks:
    """The tasks of one supervisor in Ray; see `Tasks`."""

    def __init__(self, versions: Versions | None = None) -> None:
        self.versions = versions or {}
        self._permits: Handle | None = None

    def start(self, claim: Claim, expected: Versions, checkpoint_s: float) -> RayTask:
        """Give a claimed repetition to a task of Ray."""
        hardware = hardware_of(claim.spec) is not None
        if hardware and self._permits is None:
            self._permits = permits_here()
        permits = self._permits if hardware else None
        return RayTask(run.options(**process_for(expected)).remote(claim, expected, checkpoint_s, permits))

    def ready(self, tasks: Sequence[RayTask], longest_s: float) -> list[RayTask]:
        """Return the tasks that have something; see `Tasks`."""
        by_stream = {task.stream: task for task in tasks}
        streams = list(by_stream)
        ready, _ = ray.wait(streams, num_returns=len(streams), timeout=0)
        if not ready:
            ready, _ = ray.wait(streams, num_returns=1, timeout=longest_s)
        return [by_stream[stream] for stream in ready]

    def permit(self, keys: Sequence[Key], until: float) -> None:
        """Permit these measurements and no others; see `Tasks`."""
        if self._permits is not None:
            self._permits.renew.remote(keys, until)

    def checks(self, store: Store, owner: str, lease_s: float, patience: Patience) -> Checks:
        """Return the sensitivity checks of a supervisor."""
        return Checks(store, owner, lease_s, self.versions, patience)
