"""Specs of what was submitted, to submit it again."""

from typing import Annotated

from fastapi import APIRouter, Query

from gaplab.api.http.dependencies import CallerDep, Id, Revealing, StoreDep
from gaplab.api.http.problems import documented
from gaplab.schemas.submitted import SpecRead
from gaplab.services.experiments import reading

router = APIRouter()


@router.get(
    "/studies/{id}/spec",
    tags=["studies"],
    summary="Read a study's spec",
    response_description="To submit it again",
    responses=documented(404, 422),
)
def read_study_spec(id: Id, store: StoreDep, caller: CallerDep, query: Annotated[Revealing, Query()]) -> SpecRead:
    """Return the shortest spec that gives the same study, and the complete spec of each experiment."""
    return reading.read_study_spec(store, id, reveal=query.permitted(caller))


@router.get(
    "/experiments/{id}/spec",
    tags=["experiments"],
    summary="Read an experiment's spec",
    response_description="To submit it again",
    responses=documented(404, 422),
)
def read_experiment_spec(id: Id, store: StoreDep, caller: CallerDep, query: Annotated[Revealing, Query()]) -> SpecRead:
    """Return the shortest spec that gives the same experiment, and the complete one."""
    return reading.read_experiment_spec(store, id, reveal=query.permitted(caller))
