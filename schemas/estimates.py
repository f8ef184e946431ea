"""The cost of a spec, estimated before submission."""

from typing import Any

from pydantic import Field

from gaplab.schemas.base import EngineName, Frozen, Name, Read


class EngineCost(Frozen):
    """Cost of one rollout of the robot in an engine."""

    engine: EngineName
    seconds_per_rollout: float = Field(description="seconds of one core", examples=[0.013])
    measured: bool = Field(
        description="true: measured by this service on earlier experiments; false: usual for the engine"
    )


class ExperimentCost(Frozen):
    """Cost of one experiment of the study."""

    name: Name
    strategy: Name
    engine: EngineName = Field(description="engine of the simulators; for the direct baseline, the engine of reality")
    repetitions: int
    iterations: int = Field(description="real-world evaluations of a repetition; 0 for a strategy without samples")
    rollouts: int = Field(
        description="upper bound over all repetitions; rollouts that cannot change a number are saved"
    )
    runs: int = Field(0, description="runs of the physical robot, with probes and repeats; 0: it is simulated")
    core_seconds: float = Field(examples=[166_400.0])


class EstimateRead(Read):
    """Cost of a study or an experiment: rollouts, and time on the cores of this service."""

    experiments: tuple[ExperimentCost, ...]
    engines: tuple[EngineCost, ...]
    rollouts: int
    core_seconds: float = Field(examples=[166_400.0])
    cores: int = Field(
        description="cores that would share the work: `GAPLAB_WORKERS`, or all cores of the API's machine"
    )
    seconds: float = Field(description="expected duration if nothing else is waiting", examples=[10_400.0])
    supervisors: int = Field(description="supervisors that run now; with 0, nothing starts")
    specs: tuple[dict[str, Any], ...] = Field(
        (), description="spec of each experiment with every field, as it would be stored"
    )
