"""Robots from files."""

from typing import Annotated

from anyio.to_thread import run_sync
from fastapi import APIRouter, Path, Request, Response

from gaplab.api.http.dependencies import StoreDep
from gaplab.api.http.problems import Responses, documented
from gaplab.schemas.robots import RobotRead
from gaplab.services.experiments import stored_robots

router = APIRouter(prefix="/robots", tags=["catalogue"])

_JSON = {"application/json": {"schema": {"type": "object"}, "example": {"format_version": 1, "name": "a1", "…": "…"}}}

_FILE: Responses = {200: {"description": "the robot file", "content": _JSON}}


@router.post(
    "",
    status_code=201,
    summary="Add a robot",
    responses=documented(413, 422),
    openapi_extra={"requestBody": {"required": True, "content": _JSON}},
)
async def add_robot(request: Request, store: StoreDep) -> RobotRead:
    """Store a robot file under its hash. `gaplab robot import` writes such a file from URDF or MJCF.

    A file is data: its world, and the names of its usual controller and task. Specs name the robot by its name; of
    several with one name, the one that was added last is meant.
    """
    return await run_sync(stored_robots.add_robot, store, await request.body())


@router.get("", summary="List the stored robots", responses=documented())
def list_robots(store: StoreDep) -> tuple[RobotRead, ...]:
    """Return all robots from files, by name, the newest of a name first."""
    return stored_robots.list_robots(store)


@router.get("/{robot}", summary="Read a robot file", response_class=Response, responses={**_FILE, **documented(404)})
def read_robot(robot: Annotated[str, Path(description="hash or name of the robot")], store: StoreDep) -> Response:
    """Return the canonical text of a robot file."""
    return Response(stored_robots.robot_text(store, robot), media_type="application/json")
