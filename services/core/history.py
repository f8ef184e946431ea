"""The result of the steps of a repetition so far, read from its log."""

from dataclasses import dataclass, replace

from gaplab.services.core.types import Measured, Probed, Sample, Simulator, Step, Transferred, Tuned


@dataclass(frozen=True, eq=False)
class History:
    """The result of the steps so far.

    Attributes:
        last: the latest step; None at the very start.
        samples: samples measured so far.
        simulators: simulators of the latest tuning, best first.
        transferred: the latest transferred controller.
        probed: its latest probe.
    """

    last: Step | None = None
    samples: tuple[Sample, ...] = ()
    simulators: tuple[Simulator, ...] = ()
    transferred: Transferred | None = None
    probed: Probed | None = None

    def after(self, step: Step) -> "History":
        """Return the history with one more step."""
        match step:
            case Measured(sample=sample):
                return replace(self, last=step, samples=(*self.samples, sample))
            case Tuned(simulators=simulators):
                return replace(self, last=step, simulators=simulators)
            case Transferred():
                return replace(self, last=step, transferred=step)
            case Probed():
                return replace(self, last=step, probed=step)
        return replace(self, last=step)
