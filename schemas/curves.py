"""Fitness against the number of real-world evaluations."""

from enum import StrEnum

from pydantic import Field

from gaplab.schemas.base import Id, Name, Read, Statistic, Unit
from gaplab.schemas.lifecycle import State


def from_before(*counts: int) -> str:
    """Return ` (and 12 from before)`, or ` (and 0–12 from before)`, of numbers of samples; "" without any."""
    span = "\N{EN DASH}".join(map(str, sorted({min(counts, default=0), max(counts, default=0)})))
    return "" if span == "0" else f" (and {span} from before)"


OF_UNTUNED = "× untuned"
"""Unit of what is recorded of a recorded reality: minus the error on held-out recordings, over the untuned one's."""


class Fitness(StrEnum):
    """Whose fitness in reality counts after each number of real-world evaluations.

    The paper's `recorded` is the larger of the transferred controller's and the best sample's, `transferred` that of
    the transferred controller alone, `equal_chances` the best of those so far: as many for every strategy.
    """

    RECORDED = "recorded"
    TRANSFERRED = "transferred"
    EQUAL_CHANCES = "equal_chances"

    @property
    def words(self) -> str:
        """What it is, as a heading begins with it."""
        return {
            Fitness.RECORDED: "Recorded fitness",
            Fitness.TRANSFERRED: "Fitness of transferred controllers alone",
            Fitness.EQUAL_CHANCES: "Best fitness of the controllers transferred so far",
        }[self]


class CurvePoint(Read):
    """Fitness at one number of real-world evaluations, over the repetitions that have reached it.

    A statistic is null if it has too few repetitions.
    """

    evaluations: int
    n: int
    mean: Statistic
    sd: Statistic = Field(description="sample standard deviation")
    lower: Statistic = Field(description="lower end of the 95 % interval of the mean, by Student's t")
    upper: Statistic = Field(description="upper end of that interval")
    values: tuple[Statistic, ...] = Field(description="fitness by repetition; null: not reached yet, or failed")


class Curve(Read):
    """The curve of one experiment.

    A strategy without samples has a single point, at 0, which is a level across the figure. The direct baseline is one:
    its controllers evolve in reality itself.
    """

    experiment: Id
    name: Name
    strategy: Name
    study_name: Name = ""
    state: State
    unit: Unit
    fitness: Fitness = Fitness.RECORDED
    direct: bool = Field(False, description="true for the direct baseline, which evolves in reality itself")
    level: bool = Field(False, description="true for a strategy without samples: a level across the figure")
    known: int = Field(0, description="samples from before the experiment, which no point counts")
    points: tuple[CurvePoint, ...]
    best_of: tuple[Statistic, ...] = Field(
        (),
        description="for the direct baseline, the expected largest fitness of 1, 2, 3 … of its repetitions, up to half "
        "of them; empty if it has fewer than 20. Recorded fitness after e samples is the largest of e + 1 controllers",
    )
