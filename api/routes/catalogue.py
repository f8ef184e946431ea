"""The plug-ins that a spec may name, and robots from files."""

import json
from typing import Annotated, Any

from fastapi import APIRouter, Body, Path, Request, Response

from gaplab.api.http.answers import CACHED, tagged
from gaplab.api.http.dependencies import StoreDep
from gaplab.api.http.documentation import sent
from gaplab.api.http.problems import documented
from gaplab.schemas.plugin import Catalogue
from gaplab.schemas.replays import RobotShapes
from gaplab.schemas.robots import EXAMPLE, PoolRead, RobotRead
from gaplab.services.experiments import stored_files
from gaplab.services.experiments.stored_files import catalogued
from gaplab.services.plugins.catalogue import catalogue
from gaplab.services.replay.replays import robot_shapes
from gaplab.services.world.pools import EXAMPLE as EXAMPLE_POOL

router = APIRouter(tags=["catalogue"])

_EXAMPLES: dict[str, Any] = {"hopper": {"summary": "A trunk on one leg", "value": EXAMPLE}}

_POOLS: dict[str, Any] = {"at rest": {"summary": "A robot that rests, twice", "value": EXAMPLE_POOL.content}}

RobotInPath = Annotated[str, Path(max_length=100, description="name of a robot", examples=["quadruped"])]
Named = Annotated[str, Path(description="hash or name of the robot", max_length=100)]


@router.get("/catalogue", summary="List the plug-ins", response_model=Catalogue, responses=CACHED)
def read_catalogue(request: Request, store: StoreDep) -> Response:
    """Return every plug-in and every stored robot, with its source and the schema of its options."""
    return tagged(request, catalogue(catalogued(stored_files.ROBOTS.all(store))))


@router.get(
    "/catalogue/robots/{name}/shapes",
    summary="Read the shapes of a robot",
    response_model=RobotShapes,
    response_description="The robot as it stands at the start",
    responses=CACHED | documented(404),
)
def read_robot_shapes(request: Request, name: RobotInPath, store: StoreDep) -> Response:
    """Return the shapes of a robot of the catalogue with its default options; a robot without bodies has none."""
    return tagged(request, robot_shapes(store, name))


@router.post("/robots", status_code=201, summary="Add a robot")
def add_robot(file: Annotated[dict[str, Any], Body(openapi_examples=_EXAMPLES)], store: StoreDep) -> RobotRead:
    """Store a robot file under its hash. `gaplab robot import` writes such a file from URDF or MJCF.

    A file is data: its world, and the names of its usual controller and task. Specs name the robot by its name; of
    several with one name, the one that was added last is meant.
    """
    return stored_files.ROBOTS.add(store, json.dumps(file, separators=(",", ":"), ensure_ascii=False))


@router.get("/robots", summary="List the stored robots")
def list_robots(store: StoreDep) -> tuple[RobotRead, ...]:
    """Return all robots from files, by name, the newest of a name first."""
    return stored_files.ROBOTS.all(store)


@router.get(
    "/robots/{robot}",
    summary="Read a robot file",
    response_class=Response,
    responses=sent({"application/json": EXAMPLE}, "the robot file") | documented(404),
)
def read_robot(robot: Named, store: StoreDep) -> Response:
    """Return the canonical text of a robot file."""
    return Response(stored_files.robot_text(store, robot), media_type="application/json")


@router.post("/pools", status_code=201, summary="Add a pool")
def add_pool(file: Annotated[dict[str, Any], Body(openapi_examples=_POOLS)], store: StoreDep) -> PoolRead:
    """Store a pool under its hash: recordings of what a robot did. `gaplab pool import` writes it from tables.

    Specs name it by its name, as `{"reality": {"kind": "recorded", "pool": "tosses"}}`; of several with one name, the
    one that was added last is meant.
    """
    return stored_files.POOLS.add(store, json.dumps(file, separators=(",", ":"), ensure_ascii=False))


@router.get("/pools", summary="List the stored pools")
def list_pools(store: StoreDep) -> tuple[PoolRead, ...]:
    """Return all pools, by name, the newest of a name first."""
    return stored_files.POOLS.all(store)
