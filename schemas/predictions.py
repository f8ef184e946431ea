"""What simulators said of controllers before and after reality had its say."""

from pydantic import Field

from gaplab.schemas.base import Frozen, Id, Statistic, Unit


class Prediction(Frozen):
    """The fitness of one sample in the simulators around it; null where the physics failed."""

    repetition: int
    iteration: int = Field(description="in which it was measured, from 1")
    simulated_before: Statistic = Field(description="in the simulator that was the best before it was measured")
    simulated_after: Statistic = Field(description="in the best of those that were tuned on it and all before it")
    fitness: Statistic = Field(description="as reality measured it; null: the measurement failed")


class Predictions(Frozen):
    """The predictions of an experiment, by repetition and iteration, as far as they are computed.

    Computing goes on with each question: ask again while some are pending. Those that are left out never are.
    """

    experiment: Id
    unit: Unit
    items: tuple[Prediction, ...]
    pending: int = Field(description="samples that are not computed yet")
    left_out: int = Field(
        default=0, description="samples of the last repetitions, for which there is no room: they are never computed"
    )
