"""What a spec would cost, told before anything of it is stored."""

from pydantic import Field

from gaplab.schemas.base import EngineName, Frozen, PluginName


class EngineCost(Frozen):
    """What one rollout of the robot takes in an engine."""

    engine: EngineName
    seconds_per_rollout: float = Field(description="of one core", examples=[0.013])
    measured: bool = Field(description="by this service, on such experiments before; else the engine's usual")


class ExperimentCost(Frozen):
    """What one experiment of the study would take."""

    name: PluginName
    strategy: PluginName
    engine: EngineName = Field(description="that computes it; for the direct baseline, reality's")
    repetitions: int
    iterations: int = Field(description="real-world evaluations of a repetition; of the direct baseline, its points: 0")
    rollouts: int = Field(description="of all its repetitions, at most; what is sure to change nothing is saved")
    core_seconds: float = Field(examples=[166_400.0])


class EstimateRead(Frozen):
    """What a study would take: rollouts, and the time of this service's cores."""

    experiments: tuple[ExperimentCost, ...]
    engines: tuple[EngineCost, ...]
    rollouts: int
    core_seconds: float = Field(examples=[166_400.0])
    cores: int = Field(description="that would share it: `GAPLAB_WORKERS`, or those of the machine that answers")
    seconds: float = Field(description="expected until it has ended, if nothing else is waiting", examples=[10_400.0])
    supervisors: int = Field(description="that work on this database now; with none, nothing starts")
