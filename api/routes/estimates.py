"""What a study would cost, before it is submitted."""

from typing import Annotated

from fastapi import APIRouter, Body, Request

from gaplab.api.http import estimate_examples, examples
from gaplab.api.http.dependencies import StoreDep
from gaplab.api.http.problems import documented
from gaplab.schemas.estimates import EstimateRead
from gaplab.schemas.spec import StudySpec
from gaplab.services.experiments import estimates

router = APIRouter(tags=["studies"])


@router.post(
    "/studies/estimate",
    summary="Estimate a study",
    responses={
        200: examples.shown(estimate_examples.ESTIMATE, "What it would take"),
        **documented(413, 415, 422),
    },
)
def estimate_study(
    spec: Annotated[StudySpec, Body(openapi_examples=examples.STUDY_SPECS)], store: StoreDep, request: Request
) -> EstimateRead:
    """Check a study as if it were submitted, and tell its rollouts and the time they take here; nothing is stored.

    A reader may ask it. Seconds a rollout are those that this service measured on its newest experiments with the same
    robot and engine.
    """
    state = request.app.state
    return estimates.estimate(store, spec, limits=state.limits, cores=state.cores)
