"""Health checks and metrics, for whatever keeps the service alive and watches it."""

from typing import Literal

import anyio
from anyio.to_thread import run_sync
from fastapi import APIRouter, Request, Response
from prometheus_client import CONTENT_TYPE_LATEST, generate_latest
from pydantic import Field

from gaplab.api.http.dependencies import WRITERS
from gaplab.api.http.documentation import sent
from gaplab.schemas.base import Frozen
from gaplab.services import health
from gaplab.services.core.errors import GaplabError
from gaplab.services.store.database_errors import StoreUnavailable

router = APIRouter(tags=["health"])

SILENT_S = 30.0
"""Seconds without a heartbeat after which a supervisor counts as lost, where no setting says otherwise."""

ANSWER_S = 3.0
"""Longest wait for the database; docker-compose.yml waits for longer."""


class SupervisorUnavailable(GaplabError):
    """Experiments do not run; the message says why."""

    kind, title = "supervisor-unavailable", "Experiments do not run"


class Alive(Frozen):
    """The answer of a process that lives."""

    status: Literal["ok"] = Field(examples=["ok"])


class Health(Frozen):
    """The answer of a service that serves requests; any other service answers with a problem.

    Attributes:
        status: `degraded` if requests are served but experiments may not run, or not be stored.
        warnings: why, a sentence each; left out if all is well.
    """

    status: Literal["ok", "degraded"] = Field(examples=["ok"])
    warnings: tuple[str, ...] = ()


@router.get("/livez", summary="Check that the process lives")
async def live() -> Alive:
    """Answer as long as the process lives, with or without a database; no other request delays it."""
    return Alive(status="ok")


@router.get(
    "/readyz", summary="Check that requests are served and experiments run", response_model_exclude_defaults=True
)
async def ready(request: Request) -> Health:
    """Answer if the database can be used, has the schema of this version, and the supervisor of `gaplab serve` runs.

    Supervisors that other processes keep are only warned about, and so are writes that failed or wait: other requests
    are served.
    """
    state = request.app.state
    kept = getattr(state, "supervisor", None)
    if kept and (trouble := kept.trouble):
        raise SupervisorUnavailable(trouble)
    lost_s = getattr(state, "lease_s", SILENT_S)
    try:
        with anyio.fail_after(ANSWER_S):
            found = await run_sync(health.warnings, state.store, lost_s, abandon_on_cancel=True)
    except TimeoutError as error:
        raise StoreUnavailable(f"the database has not answered for {ANSWER_S:g} s") from error
    if kept and kept.warning:
        found = (kept.warning, *found)
    if state.writers.locked():
        found = (*found, f"{WRITERS} requests are writing, and others wait")
    return Health(status="degraded" if found else "ok", warnings=found)


_EXAMPLE = '# TYPE gaplab_repetitions gauge\ngaplab_repetitions{state="RUNNING"} 2.0\n'


@router.get(
    "/metrics",
    summary="Read metrics",
    response_class=Response,
    response_description="In the text format of Prometheus",
    responses=sent({"text/plain": _EXAMPLE}),
)
def read_metrics(request: Request) -> Response:
    """Return request counts and latency, stored experiments by state, open streams, and the supervisors' heartbeats."""
    return Response(generate_latest(request.app.state.metrics.registry), media_type=CONTENT_TYPE_LATEST)
