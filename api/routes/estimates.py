"""The cost of a study or an experiment, before it is submitted."""

from typing import Annotated

from fastapi import APIRouter, Body, Request

from gaplab.api.http.dependencies import StoreDep
from gaplab.api.http.problems import documented
from gaplab.schemas.estimates import EstimateRead
from gaplab.schemas.spec import ExperimentSpec, StudySpec
from gaplab.services.experiments import estimates

router = APIRouter()


@router.post(
    "/studies/estimate",
    tags=["studies"],
    summary="Estimate a study",
    response_description="The expected cost",
    responses=documented(413, 415, 422),
)
def estimate_study(
    spec: Annotated[StudySpec, Body(openapi_examples=StudySpec.EXAMPLES)], store: StoreDep, request: Request
) -> EstimateRead:
    """Check a study as on submission, and return its rollouts and the time they take here; nothing is stored.

    A reader's token suffices. The seconds per rollout are those that this service measured in its newest experiments
    with the same robot and engine.
    """
    state = request.app.state
    return estimates.estimate(store, spec, limits=state.limits, cores=state.cores)


@router.post(
    "/experiments/estimate",
    tags=["experiments"],
    summary="Estimate an experiment",
    response_description="The expected cost",
    responses=documented(413, 415, 422),
)
def estimate_experiment(
    spec: Annotated[ExperimentSpec, Body(openapi_examples=ExperimentSpec.EXAMPLES)], store: StoreDep, request: Request
) -> EstimateRead:
    """Check an experiment as on submission, and return its rollouts and the time they take here; nothing is stored."""
    state = request.app.state
    return estimates.estimate(store, spec, limits=state.limits, cores=state.cores)
