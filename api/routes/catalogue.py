"""The plug-ins that a spec may name."""

from fastapi import APIRouter, Request, Response

from gaplab.api.http import conditional
from gaplab.api.http.dependencies import StoreDep
from gaplab.api.http.problems import documented
from gaplab.schemas.plugin import Catalogue
from gaplab.services.experiments.stored_robots import catalogued, list_robots
from gaplab.services.plugins.catalogue import catalogue

router = APIRouter(tags=["catalogue"])


@router.get(
    "/catalogue",
    summary="List the plug-ins",
    response_model=Catalogue,
    responses=conditional.CACHED | documented(),
)
def read_catalogue(request: Request, store: StoreDep) -> Response:
    """Return every plug-in and every stored robot, with its source and the schema of its options."""
    return conditional.tagged(request, catalogue(catalogued(list_robots(store))))
