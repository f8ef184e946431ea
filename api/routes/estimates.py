"""The cost of a study or an experiment, before it is submitted."""

from collections.abc import Callable
from functools import partial
from typing import Annotated, TypeAlias

from fastapi import APIRouter, Body, Depends, Request

from gaplab.api.http.dependencies import StoreDep
from gaplab.api.http.problems import Responses, documented
from gaplab.schemas.estimates import EstimateRead
from gaplab.schemas.spec import ExperimentSpec, StudySpec
from gaplab.services.experiments import estimates

_experiment = APIRouter(prefix="/experiments", tags=["experiments"])
_study = APIRouter(prefix="/studies", tags=["studies"])

Estimate: TypeAlias = Callable[[StudySpec | ExperimentSpec], EstimateRead]

_COST = "The expected cost"
_RESPONSES: Responses = documented(413, 415, 422)


def _estimate(store: StoreDep, request: Request) -> Estimate:
    state = request.app.state
    return partial(estimates.estimate, store, limits=state.limits, cores=state.cores)


EstimateDep = Annotated[Estimate, Depends(_estimate)]


@_study.post("/estimate", summary="Estimate a study", response_description=_COST, responses=_RESPONSES)
def estimate_study(
    spec: Annotated[StudySpec, Body(openapi_examples=StudySpec.EXAMPLES)], estimate: EstimateDep
) -> EstimateRead:
    """Check a study as on submission, and return its rollouts and the time they take here; nothing is stored.

    A reader's token suffices. The seconds per rollout are those that this service measured in its newest experiments
    with the same robot and engine.
    """
    return estimate(spec)


@_experiment.post("/estimate", summary="Estimate an experiment", response_description=_COST, responses=_RESPONSES)
def estimate_experiment(
    spec: Annotated[ExperimentSpec, Body(openapi_examples=ExperimentSpec.EXAMPLES)], estimate: EstimateDep
) -> EstimateRead:
    """Check an experiment as on submission, and return its rollouts and the time they take here; nothing is stored."""
    return estimate(spec)


router = APIRouter()
router.include_router(_study)
router.include_router(_experiment)
