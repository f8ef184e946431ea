"""Limits of time, after which a worker without progress counts as hung."""

from dataclasses import dataclass

from gaplab.services.core.answers import BLOCK

CHECK_ROLLOUTS = 60
"""A sensitivity check may take as long as this many of the longest rollouts."""


@dataclass(frozen=True)
class Patience:
    """Longest durations of work.

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
