"""Corrections of measurements of a robot on a bench, and the branches that they closed."""

from typing import Annotated

from fastapi import APIRouter, Body, Query, Response
from pydantic import Field

from gaplab.api.http.dependencies import AdmissionDep, Id, Parameters, StoreDep, once_answered
from gaplab.api.http.problems import documented
from gaplab.schemas.measurements import BranchRead, ConflictSpec, Consequences, CorrectionSpec, VoidSpec
from gaplab.services.measuring import corrections, rewriting

router = APIRouter(tags=["bench"])


class Rehearsal(Parameters):
    """Whether to store the correction, or only to answer what would follow from it."""

    dry_run: bool = Field(default=False, description="only answer what would follow; store nothing")


Rehearsing = Annotated[Rehearsal, Query()]
Correction = Annotated[CorrectionSpec, Body(openapi_examples=CorrectionSpec.EXAMPLES)]
Void = Annotated[VoidSpec, Body(openapi_examples=VoidSpec.EXAMPLES)]
Decision = Annotated[ConflictSpec, Body(openapi_examples=ConflictSpec.EXAMPLES)]


@router.post(
    "/measurements/{id}/corrections", summary="Correct a measurement", responses=documented(404, 409, 413, 415, 422)
)
def correct_measurement(
    id: Id, spec: Correction, query: Rehearsing, store: StoreDep, admitted: AdmissionDep, response: Response
) -> Consequences:
    """Replace the values that count. What was computed from them is computed again; the old steps stay readable."""
    return once_answered(corrections.correct(store, id, spec, admitted, dry_run=query.dry_run), response)


@router.post("/measurements/{id}/void", summary="Void a measurement", responses=documented(404, 409, 413, 415, 422))
def void_measurement(
    id: Id, spec: Void, query: Rehearsing, store: StoreDep, admitted: AdmissionDep, response: Response
) -> Consequences:
    """Declare the values invalid, and request the controller again."""
    return once_answered(corrections.void(store, id, spec, admitted, dry_run=query.dry_run), response)


@router.post(
    "/measurements/{id}/decision", summary="Decide about a conflict", responses=documented(404, 409, 413, 415, 422)
)
def decide_measurement(
    id: Id, spec: Decision, query: Rehearsing, store: StoreDep, admitted: AdmissionDep, response: Response
) -> Consequences:
    """Let an answer in conflict count in place of the other, or dismiss it."""
    return once_answered(corrections.decide(store, id, spec, admitted, dry_run=query.dry_run), response)


@router.get("/experiments/{id}/branches", summary="List the closed branches", responses=documented(404))
def list_branches(id: Id, store: StoreDep) -> tuple[BranchRead, ...]:
    """List the steps that corrections closed; they count nowhere."""
    return rewriting.list_branches(store, id)
