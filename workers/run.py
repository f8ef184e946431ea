"""A claimed repetition in Ray: its task and its deliveries."""

from collections.abc import Collection
from dataclasses import dataclass, field
from time import monotonic

import ray
from ray import ObjectRefGenerator
from ray.exceptions import RayError, RayTaskError

from gaplab.services.core.errors import ClusterUnusable, PluginDiffers
from gaplab.services.core.types import Measured, Probed
from gaplab.services.store.lease import Claim, Delivered, Failure, Pulse, Requested, TimedStep
from gaplab.workers.patience import Patience
from gaplab.workers.permits import Handle
from gaplab.workers.task import Batch, told


def stuck(runs: Collection["Run"], longest_s: float) -> str:
    """Return a sentence if no worker has begun any of these runs, and one has waited for so long; else nothing."""
    waits_s = [monotonic() - run.heard_at for run in runs if not run.begun]
    if len(waits_s) < len(runs) or max(waits_s, default=0.0) <= longest_s:
        return ""
    return f"no worker has begun for {max(waits_s):.0f} s; the logs of Ray say why"


@dataclass(eq=False)
class Run:
    """A claimed repetition that was submitted to Ray.

    Attributes:
        claim: claim of the repetition.
        stream: batches of steps and checkpoints from the task.
        permits: actor that gives the permit to move hardware; None if reality is only computed.
        received: deliveries that are not stored yet.
        begun: true once the task has a core.
        asks: true once it has requested a measurement; the task then ends by itself.
        ended: true once the task has ended.
        failed: reason of a failure: an error of its code, or a limit of time.
        pulse: the last sign of life, if no delivery has followed it.
        heard_at: time of the last delivery or sign of life.
        measuring: the place in the log of the step whose measurement the database knows of; None once it has ended.
        refused: reason why its process did not begin it.
        lost: reason why another worker must continue: the worker is gone, or the log refused a delivery.
    """

    claim: Claim
    stream: ObjectRefGenerator
    permits: Handle | None = None
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
        """Take the next batch if the stream has one, or its end, or its error."""
        try:
            self.take(ray.get(next(self.stream)))
        except StopIteration:
            self.ended = True
        except RayTaskError as error:
            if isinstance(error.cause, ClusterUnusable):
                raise error.cause from error
            if isinstance(error.cause, PluginDiffers):
                self.refused = error.cause
            else:
                self.failed = Failure(told(error))
        except RayError as error:
            self.lost = f"the worker was lost: {type(error).__name__}"

    def take(self, batch: Batch) -> None:
        """Take a delivery: steps and checkpoints to store, a sign of life, or the reason of a failure."""
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
            ray.cancel(self.stream, force=True)

    def wait_for_end(self, longest_s: float) -> None:
        """Wait until the task has ended, and take its last deliveries."""
        until = monotonic() + longest_s
        while not self.over and (left := until - monotonic()) > 0:
            if ray.wait([self.stream], timeout=left)[0]:
                self.receive()

    def overdue(self, patience: Patience) -> str | None:
        """Return why the task counts as hung; None if it does not. Measurements by hardware have no limit."""
        since_s, pulse = monotonic() - self.heard_at, self.pulse
        by_hardware = pulse is not None and pulse.measuring and self.permits is not None
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
        """Whether the stream has ended, with or without an error."""
        return self.ended or any(reason is not None for reason in (self.failed, self.refused, self.lost))

    @property
    def place(self) -> dict[str, str | int]:
        """Experiment and number, for the log."""
        return {"experiment": self.claim.experiment_id, "repetition": self.claim.number}
