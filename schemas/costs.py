"""The model of what experiments cost: of a question about their results, or of a spec that is to stay within it."""

from typing import Literal

from pydantic import Field, model_validator

from gaplab.schemas.base import Frozen

HOUR_S = 3600.0


class CostModel(Frozen):
    """What fitness is drawn or compared against: real-world evaluations, or the rollouts, time or cost that they took.

    Time is machine time, rollouts × seconds ÷ cores, and the time of real-world evaluations. Cost has a price for an
    hour of each, and for the wear of the robot, all in one unit of the reader's.
    """

    x: Literal["evaluations", "rollouts", "time", "cost"] = Field(
        "evaluations", description="real-world evaluations, or the rollouts, the time or the cost that they took"
    )
    cost_s: float = Field(0.0, ge=0, le=1e9, description="seconds per real-world evaluation, if x is time or cost")
    rollout_s: float | None = Field(
        None, ge=0, le=1e9, description="seconds of a rollout on a core; left out: the time of simulation as measured"
    )
    cores: float = Field(1.0, gt=0, le=1e9, description="cores that share the rollouts, if `rollout_s` is given")
    machine: float = Field(1.0, ge=0, le=1e9, description="if x is cost: price of an hour of the machine")
    attention: float = Field(
        1.0, ge=0, le=1e9, description="price of an hour of real-world evaluations, which a person attends to"
    )
    wear: float = Field(0.0, ge=0, le=1e9, description="price of what one real-world evaluation wears off the robot")

    @property
    def measures(self) -> bool:
        """Whether the measured time of simulation counts."""
        return self.rollout_s is None and self.x in {"time", "cost"}

    def of(self, evaluations: int, rollouts: float, measured_s: float) -> float:
        """Return what this many evaluations and rollouts took: rollouts, seconds, or cost in the unit of the prices.

        Args:
            evaluations: real-world evaluations.
            rollouts: rollouts in simulation.
            measured_s: seconds in which they were simulated.
        """
        if self.x == "rollouts":
            return rollouts
        machine_s = measured_s if self.rollout_s is None else rollouts * self.rollout_s / self.cores
        if self.x == "time":
            return evaluations * self.cost_s + machine_s
        hourly = evaluations * self.cost_s * self.attention + machine_s * self.machine
        return hourly / HOUR_S + evaluations * self.wear

    @property
    def note(self) -> str:
        """What counts, as a sentence."""
        if self.x == "rollouts":
            return "Rollouts: all so far, to select, tune and transfer; mean over repetitions."
        simulation = "simulation as measured"
        if self.rollout_s is not None:
            simulation = f"rollouts at {self.rollout_s:g}\N{NO-BREAK SPACE}s on {self.cores:g} cores"
        evaluations = f"real-world evaluations at {self.cost_s:g}\N{NO-BREAK SPACE}s each"
        if self.x == "time":
            return f"Time: {f'{evaluations} and ' if self.cost_s else ''}{simulation}, mean over repetitions."
        attended = f"{self.attention:g} an hour of {evaluations}, {self.wear:g} for the wear of each"
        return f"Cost: {attended}, and {self.machine:g} an hour of {simulation}, mean over repetitions."


class Stop(CostModel):
    """What a repetition may take: its iterations are as many as are expected to stay within it."""

    x: Literal["rollouts", "time", "cost"] = Field("cost", description="what may not be exceeded")
    at: float = Field(gt=0, le=1e12, description="the most: rollouts, seconds, or a cost in the unit of the prices")

    @model_validator(mode="after")
    def _check_the_seconds(self) -> "Stop":
        if self.measures:
            raise ValueError(f"rollout_s, the seconds of a rollout, is needed where {self.x} may not be exceeded")
        return self


OF_EVALUATIONS = CostModel()
"""Real-world evaluations are what counts, and nothing that they took."""
