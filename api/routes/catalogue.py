"""The plug-ins that a spec may name, and the shapes of the robots among them."""

from typing import Annotated

from fastapi import APIRouter, Path, Request, Response

from gaplab.api.http import conditional
from gaplab.api.http.dependencies import StoreDep
from gaplab.api.http.problems import documented
from gaplab.schemas.plugin import Catalogue
from gaplab.schemas.replays import RobotShapes
from gaplab.services.experiments.stored_robots import catalogued, list_robots
from gaplab.services.plugins.catalogue import catalogue
from gaplab.services.replay.replays import robot_shapes

router = APIRouter(tags=["catalogue"])

RobotInPath = Annotated[str, Path(max_length=100, description="name of a robot", examples=["quadruped"])]


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
    "/catalogue/robots/{name}/shapes",
    summary="Read the shapes of a robot",
    response_model=RobotShapes,
    response_description="The robot as it stands at the start",
    responses=conditional.CACHED | documented(404, 422),
)
def read_robot_shapes(request: Request, name: RobotInPath, store: StoreDep) -> Response:
    """Return the shapes of a robot of the catalogue with its default options; a robot without bodies has none."""
    return conditional.tagged(request, robot_shapes(store, name))
