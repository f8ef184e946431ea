"""Specs of what was submitted, to submit it again."""

from fastapi import APIRouter

from gaplab.api.http.dependencies import CallerDep, Id, StoreDep
from gaplab.api.http.problems import Responses, documented
from gaplab.api.routes.studies import RevealingQuery
from gaplab.schemas.spec import SpecRead
from gaplab.services.experiments import reading

_experiment = APIRouter(prefix="/experiments/{id}", tags=["experiments"])
_study = APIRouter(prefix="/studies/{id}", tags=["studies"])

_AGAIN = "To submit it again"
_RESPONSES: Responses = documented(404, 422)


@_study.get("/spec", summary="Read a study's spec", response_description=_AGAIN, responses=_RESPONSES)
def read_study_spec(id: Id, store: StoreDep, caller: CallerDep, query: RevealingQuery) -> SpecRead:
    """Return the shortest spec that gives the same study, and the complete spec of each experiment."""
    return reading.read_spec(store, "study", id, reveal=query.permitted(caller))


@_experiment.get("/spec", summary="Read an experiment's spec", response_description=_AGAIN, responses=_RESPONSES)
def read_experiment_spec(id: Id, store: StoreDep, caller: CallerDep, query: RevealingQuery) -> SpecRead:
    """Return the shortest spec that gives the same experiment, and the complete one."""
    return reading.read_spec(store, "experiment", id, reveal=query.permitted(caller))


router = APIRouter(routes=_study.routes + _experiment.routes)
