"""What the paper's Fig. 3 shows: a function of one gene, its approximations, and what was tried of it."""

from pydantic import Field

from gaplab.schemas.base import Frozen

Values = tuple[float | None, ...]


class ToySample(Frozen):
    """A gene that was tried in reality."""

    iteration: int
    gene: float
    fitness: float | None = Field(description="null: the measurement failed")


class ToyTransfer(Frozen):
    """The fittest gene in the best simulator, and what it is worth."""

    gene: float
    simulated: float | None
    real: float | None = Field(description="null: not looked at yet, or failed")


class ToyIteration(Frozen):
    """One iteration of one repetition."""

    experiment: str
    name: str
    repetition: int
    iteration: int
    unit: str = Field(description="of fitness")
    genes: tuple[float, ...] = Field(description="at which the functions are given")
    truth: Values | None = Field(description="reality; null as long as it may not be shown")
    approximations: tuple[Values, ...] = Field(description="the simulators of the iteration, the best first")
    squared_error: float | None = Field(description="of the best over the samples; null: there is none")
    samples: tuple[ToySample, ...] = Field(description="up to the iteration")
    transfer: ToyTransfer | None
    limits: tuple[float, float] = Field(description="of all fitnesses of the repetition: what a figure of any shows")
