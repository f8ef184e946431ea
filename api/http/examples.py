"""What `/docs` shows as examples. Each answer is built from its own schema, so that it cannot be wrong."""

from datetime import UTC, datetime, timedelta
from typing import Any

from pydantic import BaseModel

from gaplab.schemas.curves import Comparison, Curve, CurvePoint, Test
from gaplab.schemas.lifecycle import Ending, State
from gaplab.schemas.misfit import Distribution, MisfitPoint, MisfitRead, TunableDistribution
from gaplab.schemas.records import (
    AttemptRead,
    ExperimentRead,
    MeasurementKind,
    Page,
    Progress,
    RepetitionRead,
    SampleRead,
    SimulatorRead,
    StudyRead,
)
from gaplab.schemas.sensitivity import Checked, Sensitivity, SensitivityRead, Verdict
from gaplab.schemas.spec import ExperimentSpec

EXPERIMENT_SPECS: dict[str, Any] = {
    "the least": {
        "summary": "One strategy at the paper's protocol; every default is the paper's",
        "value": {"strategy": "simulated_fit", "iterations": 10, "repetitions": 40},
    },
    "quick": {
        "summary": "Seconds: the toy function of the paper's Fig. 3",
        "value": {"strategy": "simulated_fit_and_informative", "robot": "toy_function", "budget": "smoke"},
    },
    "in detail": {
        "summary": "Options, bounds, another reality, a budget of one's own",
        "value": {
            "name": "half the weight on information",
            "strategy": {"name": "simulated_fit_and_informative", "options": {"informative_weight": 0.5}},
            "iterations": 5,
            "repetitions": 20,
            "tunables": ["static_friction", {"name": "dynamic_friction", "lower": 0.2, "upper": 1.2}],
            "reality": {"parameters": {"static_friction": 0.9, "dynamic_friction": 0.6}},
            "budget": {"preset": "desk", "simulator_evaluations": 800},
            "seed": 2012,
        },
    },
}

STUDY_SPECS: dict[str, Any] = {
    "Fig. 4": {
        "summary": "The paper's whole Fig. 4: six strategies and the direct baseline; 1 500 core-hours",
        "value": {"name": "Fig. 4", "direct_repetitions": 100},
    },
    "quick": {
        "summary": "The same on the toy function; seconds",
        "value": {"name": "toy", "robot": "toy_function", "budget": "smoke"},
    },
}

EDITS: dict[str, Any] = {
    "another name": {"summary": "What it is called from now on", "value": {"name": "half the weight"}},
    "notes": {
        "summary": "What people should know about it",
        "value": {"notes": "stopped early: the bounds were wrong"},
    },
}

SENSITIVITY_SPECS: dict[str, Any] = {
    "the least": {
        "summary": "The quadruped and its three coefficients, as the paper has them; about 800 rollouts",
        "value": {},
    },
    "finer": {
        "summary": "One coefficient between bounds of one's own, at more values",
        "value": {"tunables": [{"name": "restitution", "lower": 0.0, "upper": 0.3}], "points": 33},
    },
}

_CREATED = datetime(2012, 11, 5, 9, 0, tzinfo=UTC)
_ID = "01f2e3d4c5b6"
_STUDY = "0a1b2c3d4e5f"
_GENOME = (0.12, 0.55, 0.83, 0.31)

_SPEC = ExperimentSpec.model_validate(EXPERIMENT_SPECS["the least"]["value"]).model_dump(mode="json")

PROGRESS = Progress(
    repetitions=40,
    completed=12,
    failed=0,
    iterations=440,
    iterations_done=150,
    rollouts=12_800_000,
    rollouts_done=4_363_000,
    rollouts_saved=1_204_000,
    rollouts_failed=17,
    seconds_left=3120.0,
)

EXPERIMENT = ExperimentRead(
    id=_ID,
    study=_STUDY,
    name="simulated_fit",
    strategy="simulated_fit",
    state=State.RUNNING,
    spec=_SPEC | {"reality": {"engine": {"name": "pybullet", "options": {}}, "parameters": {"restitution": None}}},
    progress=PROGRESS,
    created_at=_CREATED,
    started_at=_CREATED + timedelta(seconds=2),
)

STUDY = StudyRead(
    id=_STUDY,
    name="Fig. 4",
    state=State.RUNNING,
    experiments=(EXPERIMENT,),
    progress=PROGRESS,
    created_at=_CREATED,
)

REPETITION = RepetitionRead(
    number=0, state=State.RUNNING, iterations_done=4, rollouts_done=116_000, attempts=1, started_at=_CREATED
)

ATTEMPT = AttemptRead(
    number=1,
    owner="lab-3:4711:9f2c61d0",
    started_at=_CREATED,
    ended_at=_CREATED + timedelta(minutes=3),
    ending=Ending.LOST,
    reason="its worker was not heard of for 30 s",
)

SAMPLE = SampleRead(
    repetition=0,
    iteration=1,
    kind=MeasurementKind.SAMPLE,
    genome=_GENOME,
    fitness=0.93,
    measured_by="pybullet",
    measured_at=_CREATED + timedelta(minutes=7),
)

SIMULATOR = SimulatorRead(
    repetition=0,
    iteration=1,
    rank=0,
    parameters={"static_friction": 1.04, "dynamic_friction": 0.81, "restitution": 0.02},
    squared_error=0.0007,
)


def _point(evaluations: int, mean: float, sd: float) -> CurvePoint:
    return CurvePoint(
        evaluations=evaluations, n=2, mean=mean, sd=sd, lower=mean - sd, upper=mean + sd, values=(mean, mean)
    )


SENSITIVITY = SensitivityRead(
    id="3f0c52d1a9be7764",
    state=State.COMPLETED,
    spec=Checked.model_validate(
        {"robot": "quadruped", "engine": "pybullet", "tunables": [{"name": "restitution", "lower": 0, "upper": 0.6}]}
    ),
    rollouts=536,
    unit="m/s",
    tunables=(
        Sensitivity(
            name="restitution",
            effect=0.031,
            relative_effect=0.29,
            roughness=0.41,
            failures=0,
            verdict=Verdict.SMOOTH,
            values=(0.0, 0.3, 0.6),
            fitness=((0.31, 0.33, 0.28), (0.11, 0.12, 0.09)),
        ),
    ),
    created_at=_CREATED,
    started_at=_CREATED + timedelta(seconds=1),
    ended_at=_CREATED + timedelta(seconds=9),
)

MISFIT = MisfitRead(
    experiment=_ID,
    unit="m/s",
    points=(
        MisfitPoint(
            iteration=5,
            error=Distribution(n=8, mean=0.021, sd=0.008, least=0.004, greatest=0.034),
            gap=Distribution(n=8, mean=0.06, sd=0.03, least=0.01, greatest=0.12),
            tunables=(
                TunableDistribution(
                    name="restitution",
                    lower=0.0,
                    upper=0.6,
                    at_lower=0.625,
                    at_upper=0.0,
                    n=8,
                    mean=0.04,
                    sd=0.05,
                    least=0.0,
                    greatest=0.13,
                ),
            ),
        ),
    ),
    remarks=("restitution is at its lower bound, 0, in 62 % of 8 repetitions",),
)

CURVE = Curve(
    experiment=_ID,
    name="simulated_fit",
    strategy="simulated_fit",
    state=State.RUNNING,
    unit="m/s",
    points=(_point(0, 0.9, 0.3), _point(1, 1.2, 0.2)),
)

COMPARISON = Comparison(
    first=_ID,
    second="11f2e3d4c5b6",
    from_evaluations=1,
    to_evaluations=1,
    n_first=40,
    n_second=40,
    difference=0.21,
    effect_size=0.9,
    student=Test(statistic=4.0, p=0.0001, p_holm=0.0003, degrees_of_freedom=78),
    welch=Test(statistic=4.0, p=0.0002, p_holm=0.0005, degrees_of_freedom=61.5),
    mann_whitney=Test(statistic=1204.0, p=0.0001, p_holm=0.0003),
)

CSV = f"""experiment,name,strategy,repetition,evaluations,fitness
{_ID},simulated_fit,simulated_fit,0,0,0.9
"""


def page(*items: BaseModel) -> BaseModel:
    """A page of a list with these items and no other after it."""
    return Page[Any](items=items)


def shown(value: BaseModel | list[BaseModel], description: str, *, csv: str | None = None) -> dict[str, Any]:
    """A documented answer: what it is, this example as JSON, and what it looks like as CSV where there is that."""
    values = value if isinstance(value, list) else [value]
    plain = [each.model_dump(mode="json") for each in values]
    content: dict[str, Any] = {"application/json": {"example": plain if isinstance(value, list) else plain[0]}}
    if csv is not None:
        content["text/csv"] = {"schema": {"type": "string"}, "example": csv}
    return {"description": description, "content": content}
