"""Health checks, for whatever keeps the service alive."""

from fastapi import APIRouter
from pydantic import Field

from gaplab.api.http.dependencies import StoreDep
from gaplab.api.http.problems import documented
from gaplab.schemas.base import Frozen

router = APIRouter(tags=["health"])


class Health(Frozen):
    """The answer of a healthy service; a service that is not healthy answers with a problem."""

    status: str = Field(examples=["ok"])


@router.get("/livez", summary="Check that the process lives")
def live() -> Health:
    """Answer as long as the process lives, with or without a database."""
    return Health(status="ok")


@router.get("/readyz", summary="Check that requests are served", responses=documented())
def ready(store: StoreDep) -> Health:  # noqa: ARG001 - the dependency is the check
    """Answer if the database answers and has the schema of this version."""
    return Health(status="ok")
