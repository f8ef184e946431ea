"""Robots from files."""

import json
from typing import Annotated, Any

from fastapi import APIRouter, Body, Path, Response

from gaplab.api.http.dependencies import StoreDep
from gaplab.api.http.problems import Responses, documented
from gaplab.schemas.robots import EXAMPLE, RobotRead
from gaplab.services.experiments import stored_robots

router = APIRouter(prefix="/robots", tags=["catalogue"])

_EXAMPLES: dict[str, Any] = {"hopper": {"summary": "A trunk on one leg", "value": EXAMPLE}}

_CONTENT = {"application/json": {"schema": {"type": "object"}, "example": EXAMPLE}}
_FILE: Responses = {200: {"description": "the robot file", "content": _CONTENT}}

Named = Annotated[str, Path(description="hash or name of the robot", max_length=100)]


@router.post("", status_code=201, summary="Add a robot", responses=documented(413, 415, 422))
def add_robot(file: Annotated[dict[str, Any], Body(openapi_examples=_EXAMPLES)], store: StoreDep) -> RobotRead:
    """Store a robot file under its hash. `gaplab robot import` writes such a file from URDF or MJCF.

    A file is data: its world, and the names of its usual controller and task. Specs name the robot by its name; of
    several with one name, the one that was added last is meant.
    """
    return stored_robots.add_robot(store, json.dumps(file, separators=(",", ":"), ensure_ascii=False))


@router.get("", summary="List the stored robots", responses=documented())
def list_robots(store: StoreDep) -> tuple[RobotRead, ...]:
    """Return all robots from files, by name, the newest of a name first."""
    return stored_robots.list_robots(store)


@router.get("/{robot}", summary="Read a robot file", response_class=Response, responses={**_FILE, **documented(404)})
def read_robot(robot: Named, store: StoreDep) -> Response:
    """Return the canonical text of a robot file."""
    return Response(stored_robots.robot_text(store, robot), media_type="application/json")
