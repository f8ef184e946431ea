"""Predictions: simulated fitness of samples, before and after tuning on them."""

from pydantic import Field

from gaplab.schemas.base import Frozen, Id, Statistic, Unit


class Prediction(Frozen):
    """Fitness of one sample in the simulators before and after it; null where the physics failed."""

    repetition: int
    iteration: int = Field(description="iteration in which the sample was measured, from 1")
    simulated_before: Statistic = Field(description="fitness in the best simulator before the measurement")
    simulated_after: Statistic = Field(
        description="fitness in the best simulator tuned on this sample and all before it"
    )
    fitness: Statistic = Field(description="fitness in reality; null: the measurement failed")


class Predictions(Frozen):
    """Predictions of an experiment by repetition and iteration, as far as they are computed.

    Each request computes more: repeat it while some are pending. Held-out samples, which no tuning sees, have none.
    """

    experiment: Id
    unit: Unit
    items: tuple[Prediction, ...]
    pending: int = Field(description="number of samples whose predictions are not computed yet")
    left_out: int = Field(
        default=0,
        description="number of samples of the last repetitions that are never predicted, because the memory is limited",
    )
