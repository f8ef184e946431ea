"""A repetition on its way: what the supervisor knows of a Ray task."""

from dataclasses import dataclass, field

import ray
from ray import ObjectRefGenerator
from ray.exceptions import RayError, RayTaskError

from gaplab.services.core.errors import ClusterUnusable
from gaplab.services.running.execution import Claim, Delivered


@dataclass(eq=False)
class Run:
    """A claimed repetition on its way.

    Attributes:
        claim: the right to it.
        stream: batches of steps and checkpoints, as the task computes them.
        received: what is not yet stored of them.
        begun: the task does not wait for a core any more.
        ended: the task is over; nothing more will be received.
        failed: why its code raised.
        lost: why its worker is gone, or what it delivered has no place in its log: another is to go on from there.
    """

    claim: Claim
    stream: ObjectRefGenerator
    received: list[Delivered] = field(default_factory=list)
    begun: bool = False
    ended: bool = False
    failed: str | None = None
    lost: str | None = None

    def receive(self) -> None:
        """Take what the stream has ready: a batch, its end, or why there will be no end."""
        try:
            self.received += ray.get(next(self.stream))
            self.begun = True
        except StopIteration:
            self.ended = True
        except RayTaskError as error:
            if isinstance(error.cause, ClusterUnusable):
                raise error.cause from error
            self.failed = f"{type(error.cause).__name__}: {error.cause}"
        except RayError as error:
            self.lost = f"the worker was lost: {type(error).__name__}"

    def cancel(self) -> None:
        """End the task at once."""
        ray.cancel(self.stream, force=True)

    @property
    def over(self) -> bool:
        """Whether the stream has nothing more to give."""
        return self.ended or self.failed is not None or self.lost is not None

    @property
    def place(self) -> dict[str, str | int]:
        """The experiment and the number, for the log."""
        return {"experiment": self.claim.experiment_id, "repetition": self.claim.number}
