"""A claimed repetition: the task that computes it elsewhere, its deliveries, and the limits of time for them.

Two modules start such tasks: `ray_tasks` on a cluster, `process_tasks` in processes of this machine.
"""

import logging
from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import suppress
from ctypes import CDLL
from dataclasses import dataclass, field, replace
from time import monotonic, perf_counter
from typing import TYPE_CHECKING, Any, Protocol, TypeAlias

from gaplab.services.core.answers import BLOCK
from gaplab.services.core.loop import Setting
from gaplab.services.core.types import Measured, Probed
from gaplab.services.plugins.folders import PluginDiffers
from gaplab.services.specs.assembly import RealityFailed, engine_of, setting
from gaplab.services.specs.blame import describe, raised
from gaplab.services.store.lease import Claim, Delivered, Failure, Pulse, Requested, TimedStep
from gaplab.workers.checkpoints import recorded
from gaplab.workers.errors import TaskLost
from gaplab.workers.expected import Versions
from gaplab.workers.permits import Key, PermittedReality

if TYPE_CHECKING:
    from gaplab.services.store.session import Store  # a worker has no database

BATCH_S = 0.2
"""Shorter steps are delivered in batches; an answer of reality is delivered at once."""

Batch: TypeAlias = tuple[Delivered | Pulse | Failure, ...]
"""The items that a worker sends at once."""

log = logging.getLogger("gaplab.worker")


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


def prepared(claim: Claim, left: Callable[[int], float] | None) -> Setting:
    """Return the setting of a claim; hardware needs permits, of which `left` tells as `PermittedReality` says."""
    alone = setting(claim.spec, claim.number)
    if left is None:
        return alone
    ref = claim.spec.reality.engine
    assert ref is not None, "permits are for hardware behind an engine"
    return replace(alone, reality=PermittedReality(alone.reality, engine_of(ref).stop, left))


def failure_of(error: BaseException) -> Failure:
    """Return the failure for an error; the message of reality's code stays hidden."""
    if not isinstance(error, RealityFailed):
        log.error("failed", exc_info=error)
        return Failure(describe(error))
    cause = error.__cause__ or error
    return Failure(f"reality failed: {raised(cause)}", f"reality failed: {describe(cause)}", of_reality=True)


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


class Task(Protocol):
    """A repetition that is computed elsewhere."""

    def take(self) -> Batch | None:
        """Return the next batch once it is ready; None at the end.

        Raises:
            PluginDiffers: its process has other plug-ins, and did not begin it.
            ClusterUnusable: its process has other versions of gaplab or its libraries, and did not begin it.
            TaskLost: its process is gone.
        """

    def cancel(self) -> None:
        """End it at once."""


class Checks(Protocol):
    """The sensitivity checks of a supervisor."""

    def step(self) -> None:
        """Store the result of the check that has ended, or start a queued one."""

    def heartbeat(self) -> None:
        """Renew the claim on the running check."""

    def hand_back(self) -> None:
        """Hand back the unfinished check."""


class Tasks(Protocol):
    """What computes the claimed work of a supervisor.

    Attributes:
        versions: those of gaplab and its libraries that a process must have.
    """

    versions: Versions

    def start(self, claim: Claim, expected: Versions, checkpoint_s: float) -> Task:
        """Start to compute a claimed repetition, in a process with the expected versions."""

    def ready(self, tasks: Sequence[Any], longest_s: float) -> Sequence[Task]:
        """Return the tasks that have a batch, an end or an error; wait for one if none has."""

    def permit(self, keys: Sequence[Key], until: float) -> None:
        """Permit these measurements, and no others, to move hardware until a time of the monotonic clock."""

    def checks(self, store: "Store", owner: str, lease_s: float, patience: "Patience") -> Checks:
        """Return the sensitivity checks of a supervisor."""


CHECK_ROLLOUTS = 60
"""A sensitivity check may take as long as this many of the longest rollouts."""


@dataclass(frozen=True)
class Patience:
    """Longest durations of work, after which a task counts as hung.

    Attributes:
        rollout_s: most seconds of a rollout.
        step_s: most seconds of a step.
        start_s: most seconds until one of the workers begins; infinite where others may have the cores.
    """

    rollout_s: float = 60.0
    step_s: float = 604_800.0
    start_s: float = 120.0

    @property
    def idle_s(self) -> float:
        """Return the seconds that may pass before the next call of the simulators ends.

        A call has one controller while the duration of a rollout is unknown, in up to `BLOCK` simulators.
        """
        return self.rollout_s * BLOCK

    @property
    def check_s(self) -> float:
        """Return the seconds for a sensitivity check."""
        return self.rollout_s * CHECK_ROLLOUTS


def stuck(runs: Collection["Run"], longest_s: float) -> str:
    """Return a sentence if no worker has begun any of these runs, and one has waited for so long; else nothing."""
    waits_s = [monotonic() - run.heard_at for run in runs if not run.begun]
    if len(waits_s) < len(runs) or max(waits_s, default=0.0) <= longest_s:
        return ""
    return f"no worker has begun for {max(waits_s):.0f} s; the logs of Ray say why"


@dataclass(eq=False)
class Run:
    """A claimed repetition whose task was started.

    Attributes:
        claim: claim of the repetition.
        task: what computes it.
        hardware: whether it moves hardware, for which it needs permits.
        received: deliveries that are not stored yet.
        begun: true once the task has a core.
        asks: true once it has requested a measurement; the task then ends by itself.
        ended: true once the task has ended.
        failed: reason of a failure: an error of its code, or a limit of time.
        pulse: the last heartbeat, if no delivery has followed it.
        heard_at: time of the last delivery or heartbeat.
        measuring: the place in the log of the step whose measurement is in the database; None once it has ended.
        refused: reason why its process did not begin it.
        lost: reason why another worker must continue: the worker is gone, or the log refused a delivery.
    """

    claim: Claim
    task: Task
    hardware: bool = False
    received: list[Delivered] = field(default_factory=list)
    begun: bool = False
    asks: bool = False
    ended: bool = False
    failed: Failure | None = None
    refused: PluginDiffers | None = None
    lost: str | None = None
    pulse: Pulse | None = None
    heard_at: float = field(default_factory=monotonic)
    measuring: int | None = None

    def receive(self) -> None:
        """Take the next batch if the task has one, or its end, or its error."""
        try:
            batch = self.task.take()
        except PluginDiffers as error:
            self.refused = error
        except TaskLost as error:
            self.lost = str(error)
        else:
            self.ended = batch is None
            self.take(batch or ())

    def take(self, batch: Batch) -> None:
        """Take a delivery: steps and checkpoints to store, a heartbeat, or the reason of a failure."""
        self.begun, self.heard_at, self.pulse = True, monotonic(), None
        for item in batch:
            if isinstance(item, Pulse):
                self.pulse = item
            elif isinstance(item, Failure):
                self.failed = item
            else:
                self.received.append(item)
                if isinstance(item, TimedStep) and isinstance(item.step, Measured | Probed):
                    self.measuring = None
                self.asks = self.asks or isinstance(item, Requested)

    def cancel(self) -> None:
        """End the task at once; one that ends by itself is left alone, since its process may have begun another."""
        if not (self.ended or self.asks):
            self.task.cancel()

    def wait_for_end(self, tasks: Tasks, longest_s: float) -> None:
        """Wait until the task has ended, and take its last deliveries."""
        until = monotonic() + longest_s
        while not self.over and (left := until - monotonic()) > 0:
            if tasks.ready([self.task], left):
                self.receive()

    def overdue(self, patience: Patience) -> str | None:
        """Return why the task counts as hung; None if it does not. Measurements by hardware have no limit."""
        since_s, pulse = monotonic() - self.heard_at, self.pulse
        by_hardware = pulse is not None and pulse.measuring and self.hardware
        if not self.begun or by_hardware:
            return None
        idle_s, permitted_s = since_s + (pulse.idle_s if pulse else 0.0), patience.idle_s
        if idle_s > permitted_s:
            asked = "reality did not answer" if pulse and pulse.measuring else "no rollout ended"
            return f"{asked} for {idle_s:.0f} s; GAPLAB_ROLLOUT_LIMIT_S is {patience.rollout_s:g} s for each rollout"
        step_s = since_s + (pulse.step_s if pulse else 0.0)
        if step_s > patience.step_s:
            return f"a step took {step_s:.0f} s; GAPLAB_STEP_LIMIT_S is {patience.step_s:g} s"
        return None

    @property
    def over(self) -> bool:
        """Whether the task has ended, with or without an error."""
        return self.ended or any(reason is not None for reason in (self.failed, self.refused, self.lost))

    @property
    def place(self) -> dict[str, str | int]:
        """Experiment and number, for the log."""
        return {"experiment": self.claim.experiment_id, "repetition": self.claim.number}
