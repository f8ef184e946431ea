"""The plug-ins that a spec may name."""

from fastapi import APIRouter, Request, Response

from gaplab.api.http import conditional
from gaplab.api.http.problems import documented
from gaplab.schemas.plugin import Catalogue
from gaplab.services.plugins.catalogue import catalogue

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
