"""The plug-ins that a spec may name."""

from fastapi import APIRouter, Request, Response

from api import conditional
from api.problems import documented
from schemas.plugin import Catalogue
from services.catalogue import catalogue

router = APIRouter(tags=["catalogue"])


@router.get(
    "/catalogue",
    summary="List the plug-ins",
    response_model=Catalogue,
    responses={200: {"headers": conditional.HEADERS}, **conditional.NOT_MODIFIED, **documented()},
)
def read_catalogue(request: Request) -> Response:
    """Every strategy, robot, engine, tunable and optimizer, with its source and the JSON Schema of its options."""
    return conditional.tagged(request, catalogue())
