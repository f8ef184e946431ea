"""Tables of samples that were measured before an experiment."""

from typing import Annotated

from fastapi import APIRouter, Query, Request
from fastapi.concurrency import run_in_threadpool
from pydantic import Field, Json

from gaplab.api.http.dependencies import Parameters, StoreDep
from gaplab.api.http.problems import documented
from gaplab.schemas.plugin import PluginRef
from gaplab.schemas.samples import SamplesRead
from gaplab.services.experiments import stored_robots
from gaplab.services.specs.robots import Driven

router = APIRouter(prefix="/samples", tags=["bench"])

_TABLE = {"text/csv": {"schema": {"type": "string"}, "example": "gene_0,value_1,value_2\n0.25,0.41,0.44\n"}}


class SamplesQuery(Parameters):
    """The robot of a table, and what drives it and rates it."""

    robot: str = Field(min_length=1, max_length=200, description="name of the robot that was measured")
    options: Json[dict[str, object]] = Field(default={}, description="its options, as JSON")
    controller: Json[PluginRef] | None = Field(default=None, description="its controller, as JSON; default: its own")
    task: Json[PluginRef] | None = Field(default=None, description="its task, as JSON; default: its own")


@router.post(
    "/check",
    summary="Check a table of samples",
    response_description="The samples for `reality.samples` of a spec, or everything that is wrong",
    responses=documented(413, 422),
    openapi_extra={"requestBody": {"required": True, "content": _TABLE}},
)
async def check_samples(query: Annotated[SamplesQuery, Query()], request: Request, store: StoreDep) -> SamplesRead:
    """Read a CSV table line by line, and store nothing. Errors have the line, the column and what is permitted.

    Columns are `gene_0`, `gene_1` and so on; `value`, or `value_1`, `value_2` and so on for repeats; and optionally
    readings like `roll@0.75`, or `roll@0.75#2` of repeat 2. An empty reading means that the sensor failed.
    """
    text = (await request.body()).decode("utf-8", "replace")
    robot = Driven(PluginRef(name=query.robot, options=query.options), query.controller, query.task)
    return await run_in_threadpool(stored_robots.check_samples, store, text, robot)
