"""The paper's Fig. 3: a function of one gene, its approximations, and the samples."""

from pydantic import Field

from gaplab.schemas.base import Frozen

Values = tuple[float | None, ...]


class ToySample(Frozen):
    """A gene that was measured in reality."""

    iteration: int
    gene: float
    fitness: float | None = Field(description="null: the measurement failed")


class ToyTransfer(Frozen):
    """The fittest gene in the best simulator, with its fitness in simulation and reality."""

    gene: float
    simulated: float | None
    real: float | None = Field(description="null: not measured yet, or failed")


class ToyIteration(Frozen):
    """The toy function in one iteration of one repetition."""

    experiment: str
    name: str
    repetition: int
    iteration: int
    unit: str = Field(description="unit of fitness")
    genes: tuple[float, ...] = Field(description="genes at which the functions are evaluated")
    truth: Values | None = Field(description="the true function; null while it is hidden")
    approximations: tuple[Values, ...] = Field(description="the simulators of the iteration, best first")
    squared_error: float | None = Field(description="what tuning minimised, of the best simulator; null: no samples")
    squares: bool = Field(description="whether that is a sum of squares")
    error: float | None = Field(description="error per sample that tuning saw, of the best simulator; null: none")
    samples: tuple[ToySample, ...] = Field(description="samples up to this iteration")
    transfer: ToyTransfer | None
    limits: tuple[float, float] = Field(
        description="range of all fitnesses of the repetition, for the axis of a figure"
    )
