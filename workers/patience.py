"""Limits of time, after which a worker without progress counts as hung."""

from dataclasses import dataclass

from gaplab.schemas.resolved import ResolvedSpec

LEAST_ROLLOUTS = 20
"""Rollouts of a call at least, since the time of one is unknown at first."""

CHECK_ROLLOUTS = 60
"""A sensitivity check may take as long as this many of the longest rollouts."""


@dataclass(frozen=True)
class Patience:
    """Longest durations of work.

    Attributes:
        rollout_s: most seconds of a rollout.
        step_s: most seconds of a step.
    """

    rollout_s: float = 60.0
    step_s: float = 604_800.0

    def idle_s(self, spec: ResolvedSpec) -> float:
        """Return the seconds that may pass before the next call of the simulators ends: it may have many rollouts."""
        simulators = spec.strategy.options.get("simulators")
        ensemble = simulators if isinstance(simulators, int) else 1
        return self.rollout_s * max(LEAST_ROLLOUTS, ensemble, spec.iterations)

    @property
    def check_s(self) -> float:
        """Return the seconds for a sensitivity check."""
        return self.rollout_s * CHECK_ROLLOUTS
