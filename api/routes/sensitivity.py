"""Sensitivity checks: what each tunable does to fitness."""

from typing import Annotated

from fastapi import APIRouter, Body, Request, Response

from gaplab.api.http import links
from gaplab.api.http.dependencies import AdmissionDep, Id, StoreDep, created
from gaplab.api.http.problems import documented
from gaplab.schemas.sensitivity import SensitivityRead, SensitivitySpec
from gaplab.services.experiments import checks

router = APIRouter(prefix="/sensitivity", tags=["sensitivity"])

Check = Annotated[SensitivitySpec, Body(openapi_examples=SensitivitySpec.EXAMPLES)]


@router.post(
    "",
    status_code=202,
    summary="Check what tunables do",
    response_description="Queued or already known; its address is in `Location`",
    responses={202: links.leading_to(*links.FROM_CHECK), **documented(413, 415, 422)},
)
def submit_sensitivity(
    spec: Check, store: StoreDep, admitted: AdmissionDep, request: Request, response: Response
) -> SensitivityRead:
    """Queue a check of whether each tunable changes fitness, how much, and how smoothly.

    It depends on robot, engine and tunables alone, and the same check is computed once. Every submitted experiment
    queues its check.
    """
    done = checks.admit(store, spec, admitted)
    return created(done, response, request.app.url_path_for("read_sensitivity", id=done.answer.id))


@router.get(
    "/{id}",
    summary="Read a sensitivity check",
    response_description="With its results, once it is COMPLETED",
    responses=documented(404),
)
def read_sensitivity(id: Id, store: StoreDep) -> SensitivityRead:
    """Return the check, with the profile of each tunable once it is COMPLETED."""
    return checks.read(store, id)
