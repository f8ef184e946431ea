"""Sensitivity checks: what each tunable does to fitness."""

from typing import Annotated

from fastapi import APIRouter, Body, Request, Response

from gaplab.api.http import examples, links
from gaplab.api.http.dependencies import AdmissionDep, Id, StoreDep, created
from gaplab.api.http.problems import documented
from gaplab.schemas.sensitivity import SensitivityRead, SensitivitySpec
from gaplab.services.experiments import checks

router = APIRouter(prefix="/sensitivity", tags=["sensitivity"])


@router.post(
    "",
    status_code=202,
    summary="Check what tunables do",
    responses={
        202: examples.shown(examples.SENSITIVITY, "It is queued or known, and exists at `Location`")
        | links.leading_to(*links.FROM_CHECK),
        **documented(413, 415, 422),
    },
)
def submit_sensitivity(
    spec: Annotated[SensitivitySpec, Body(openapi_examples=examples.SENSITIVITY_SPECS)],
    store: StoreDep,
    admitted: AdmissionDep,
    request: Request,
    response: Response,
) -> SensitivityRead:
    """Queue a check of these settings: whether each tunable changes fitness, how much, and how smoothly.

    Only robot, engine and tunables matter to it, and what was checked once is not checked again. Every experiment has
    such a check queued with it.
    """
    done = checks.admit(store, spec, admitted)
    return created(done, response, request.app.url_path_for("read_sensitivity", id=done.answer.id))


@router.get(
    "/{id}",
    summary="Look at a sensitivity check",
    responses={
        200: examples.shown(examples.SENSITIVITY, "With what it found, once it is COMPLETED"),
        **documented(404),
    },
)
def read_sensitivity(id: Id, store: StoreDep) -> SensitivityRead:  # noqa: A002 - the address says {id}
    """The check, with the profile of each tunable once it is COMPLETED."""
    return checks.read(store, id)
