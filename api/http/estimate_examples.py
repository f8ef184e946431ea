"""What `/docs` shows as an estimate."""

from typing import Final

from gaplab.schemas.estimates import EngineCost, EstimateRead, ExperimentCost

ESTIMATE: Final = EstimateRead(
    experiments=(
        ExperimentCost(
            name="simulated_fit",
            strategy="simulated_fit",
            engine="pybullet",
            repetitions=40,
            iterations=10,
            rollouts=12_800_000,
            core_seconds=166_400.0,
        ),
    ),
    engines=(EngineCost(engine="pybullet", seconds_per_rollout=0.013, measured=True),),
    rollouts=12_800_000,
    core_seconds=166_400.0,
    cores=16,
    seconds=10_400.0,
    supervisors=1,
)
