"""The plug-ins that a spec may name, and pictures of the robots among them."""

from typing import Annotated, Literal

from fastapi import APIRouter, Path, Query, Request, Response
from pydantic import Field

from gaplab.api.http import conditional
from gaplab.api.http.dependencies import DrawingProcessDep, Parameters, StoreDep
from gaplab.api.http.problems import documented
from gaplab.schemas.plugin import Catalogue
from gaplab.services.experiments.stored_robots import catalogued, list_robots
from gaplab.services.plugins.catalogue import catalogue
from gaplab.services.replay.portraits import robot_picture

router = APIRouter(tags=["catalogue"])

RobotInPath = Annotated[str, Path(max_length=100, description="name of a robot", examples=["quadruped"])]
_PNG = {"image/png": {"schema": {"type": "string", "format": "binary"}, "example": "…"}}


class PictureQuery(Parameters):
    """How a robot is drawn."""

    theme: Literal["light", "dark"] = Field(default="light", description="colours of the page")
    width: int = Field(default=320, ge=80, le=1_280, description="width in pixels; the height is three quarters of it")


@router.get(
    "/catalogue",
    summary="List the plug-ins",
    response_model=Catalogue,
    responses=conditional.CACHED | documented(),
)
def read_catalogue(request: Request, store: StoreDep) -> Response:
    """Return every plug-in and every stored robot, with its source and the schema of its options."""
    return conditional.tagged(request, catalogue(catalogued(list_robots(store))))


@router.get(
    "/catalogue/robots/{name}/picture",
    summary="Draw a robot",
    response_class=Response,
    response_description="The robot as it stands at the start, as PNG",
    responses=conditional.CACHED | {200: conditional.TAGGED[200] | {"content": _PNG}} | documented(404, 422, 429),
)
def draw_robot(
    request: Request,
    name: RobotInPath,
    drawing: DrawingProcessDep,
    store: StoreDep,
    query: Annotated[PictureQuery, Query()],
) -> Response:
    """Draw a robot of the catalogue with its default options, on its ground; a robot without bodies has no picture."""
    drawn = robot_picture(drawing, store, name, dark=query.theme == "dark", width_px=query.width)
    return conditional.tagged_response(request, Response(drawn, media_type="image/png"))
