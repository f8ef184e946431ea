"""The cost of a study or an experiment, before it is submitted."""

from typing import Annotated

from fastapi import APIRouter

from gaplab.api.http.dependencies import LimitsDep, StoreDep, of_app
from gaplab.api.http.problems import Responses, documented
from gaplab.api.routes.experiments import Experiment
from gaplab.api.routes.studies import Study
from gaplab.schemas.estimates import EstimateRead
from gaplab.services.experiments import estimates

_experiment = APIRouter(prefix="/experiments", tags=["experiments"])
_study = APIRouter(prefix="/studies", tags=["studies"])

CoresDep = Annotated[int, of_app("cores")]

_COST = "The expected cost"
_RESPONSES: Responses = documented(413, 415, 422)


@_study.post("/estimate", summary="Estimate a study", response_description=_COST, responses=_RESPONSES)
def estimate_study(spec: Study, store: StoreDep, limits: LimitsDep, cores: CoresDep) -> EstimateRead:
    """Check a study as on submission, and return its rollouts and the time they take here; nothing is stored.

    A reader's token suffices. The seconds per rollout are those that this service measured in its newest experiments
    with the same robot and engine.
    """
    return estimates.estimate(store, spec, limits=limits, cores=cores)


@_experiment.post("/estimate", summary="Estimate an experiment", response_description=_COST, responses=_RESPONSES)
def estimate_experiment(spec: Experiment, store: StoreDep, limits: LimitsDep, cores: CoresDep) -> EstimateRead:
    """Check an experiment as on submission, and return its rollouts and the time they take here; nothing is stored."""
    return estimates.estimate(store, spec, limits=limits, cores=cores)


router = APIRouter(routes=_study.routes + _experiment.routes)
