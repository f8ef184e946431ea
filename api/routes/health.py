"""Health, for whoever keeps the service alive."""

from fastapi import APIRouter
from pydantic import Field

from gaplab.api.http.dependencies import StoreDep
from gaplab.api.http.problems import documented
from gaplab.schemas.base import Frozen

router = APIRouter(tags=["health"])


class Health(Frozen):
    """That all is well; what is not well is a problem."""

    status: str = Field(examples=["ok"])


@router.get("/livez", summary="Ask whether the process lives")
def live() -> Health:
    """Answers as long as the process does; it needs no database."""
    return Health(status="ok")


@router.get("/readyz", summary="Ask whether requests are served", responses=documented())
def ready(store: StoreDep) -> Health:  # noqa: ARG001 - that there is a store is the question
    """Whether the database answers and has the schema of this version."""
    return Health(status="ok")
