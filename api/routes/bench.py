"""Measurements of a robot on a bench: requests, takes, answers."""

from time import monotonic
from typing import Annotated, Literal

from anyio.to_thread import run_sync
from fastapi import APIRouter, Body, Query, Request, Response
from pydantic import Field

from gaplab.api.http.attachments import attachment
from gaplab.api.http.dependencies import (
    AdmissionDep,
    CallerDep,
    FeedDep,
    Id,
    Paging,
    Parameters,
    RolloutProcessDep,
    StoreDep,
    StreamsDep,
    created,
    once_answered,
)
from gaplab.api.http.problems import Responses, documented
from gaplab.schemas.events import EventKind
from gaplab.schemas.measurements import (
    AnswerRead,
    DoubtsRead,
    HolderSpec,
    MeasurementSpec,
    ReleaseSpec,
    RequestRead,
    TakeSpec,
)
from gaplab.schemas.records import Page
from gaplab.schemas.traces import TracesRead, TracesSpec
from gaplab.services import events
from gaplab.services.events import WantedEvents
from gaplab.services.measuring import answering, doubts, motion_files, taking
from gaplab.services.measuring.taking import RequestFilter
from gaplab.services.replay import traces
from gaplab.services.replay.traces import measured_by_traces
from gaplab.services.store.session import Store

router = APIRouter(prefix="/requests", tags=["bench"])

TakeBody = Annotated[TakeSpec, Body(openapi_examples=TakeSpec.EXAMPLES)]
Holder = Annotated[HolderSpec, Body(openapi_examples=HolderSpec.EXAMPLES)]
Release = Annotated[ReleaseSpec, Body(openapi_examples=ReleaseSpec.EXAMPLES)]
Measurement = Annotated[MeasurementSpec, Body(openapi_examples=MeasurementSpec.EXAMPLES)]
Traces = Annotated[TracesSpec, Body(openapi_examples=TracesSpec.EXAMPLES)]

_NEWS = frozenset(EventKind) - frozenset(
    {EventKind.SELECTED, EventKind.MEASURED, EventKind.TUNED, EventKind.TRANSFERRED, EventKind.PROBED}
)
"""What may add a request to a list, or be the end of its experiment: steps are neither."""

_MOTIONS = {"csv": ("text/csv", "csv"), "json": ("application/json", "json"), "ros2": ("application/yaml", "yaml")}

_MOTION: Responses = {
    200: {
        "content": {
            "text/csv": {"schema": {"type": "string"}, "example": "time_s,front_left_knee (rad)\n-1.0,0.0\n0.0,0.12\n"},
            "application/json": {
                "schema": {"type": "object"},
                "example": {
                    "start": {"front_left_knee": 0.0},
                    "actuators": ["front_left_knee"],
                    "units": ["rad"],
                    "times_s": [0.0],
                    "targets": [[0.12]],
                    "observe_s": [0.75],
                },
            },
            "application/yaml": {"schema": {"type": "string"}, "example": "joint_names: [front_left_knee]\n"},
        }
    }
}


class RequestQuery(Paging):
    """The requests to list."""

    experiment: Id | None = Field(default=None, description="only requests of this experiment")
    bench: str | None = Field(default=None, max_length=200, description="only requests of this bench")
    pending: bool = Field(
        default=True, description="only requests that are still needed; of a paused experiment, only one that is taken"
    )
    conflicts: bool = Field(default=False, description="only requests with an answer in conflict, to be decided")
    wait_s: float = Field(default=0.0, ge=0, le=60, description="seconds to wait for a request if there is none")


class MotionQuery(Parameters):
    """The format of a motion."""

    format: Literal["csv", "json", "ros2"] = Field(
        default="csv", description="ros2: a trajectory_msgs/JointTrajectory in YAML"
    )


@router.get("", summary="List the requests for measurements", responses=documented(404, 422, 429))
async def list_requests(
    query: Annotated[RequestQuery, Query()], store: StoreDep, feed: FeedDep, streams: StreamsDep, caller: CallerDep
) -> Page[RequestRead]:
    """List what experiments wait for, the oldest first.

    A waiting request counts as an open event stream.
    """
    until, which = monotonic() + query.wait_s, WantedEvents(study=query.experiment, kinds=_NEWS)
    page, latest = await run_sync(_look, store, query)
    if latest is not None:
        with streams.open(caller.token):
            while latest is not None and await feed.news(latest, which, until - monotonic()):
                page, latest = await run_sync(_look, store, query)
    return page


def _look(store: Store, query: RequestQuery) -> tuple[Page[RequestRead], int | None]:
    """Return the requests, and the latest event before them if there is reason to wait for another."""
    wanted = RequestFilter(query.experiment, query.bench, query.pending, query.conflicts)
    latest = events.latest(store)
    page = taking.list_requests(store, wanted, query.limit, query.cursor)
    waits = query.wait_s and not page.items and not taking.none_will_follow(store, wanted)
    return page, latest if waits else None


@router.get("/{id}", summary="Read a request", responses=documented(404))
def read_request(id: Id, store: StoreDep) -> RequestRead:
    """Return a request with its answers."""
    return taking.read_request(store, id)


@router.get(
    "/{id}/motion",
    summary="Read the motion to run",
    response_class=Response,
    responses={**_MOTION, **documented(404, 409, 422)},
)
def read_motion(id: Id, query: Annotated[MotionQuery, Query()], store: StoreDep) -> Response:
    """Return the targets of the actuators over time, with the unit of each, after a rest in the start pose.

    A controller that observes the robot while it acts, or of a robot without actuators, has none: 409.
    """
    media_type, ending = _MOTIONS[query.format]
    return attachment(motion_files.request_motion(store, id, query.format), media_type, f"motion-{id}.{ending}")


@router.post("/{id}/take", summary="Take a request", responses=documented(404, 409, 413, 415, 422))
def take_request(id: Id, spec: TakeBody, store: StoreDep, admitted: AdmissionDep, response: Response) -> RequestRead:
    """Take a request: nobody else can take it, or another of its bench, until the take ends or runs out."""
    return once_answered(taking.take(store, id, spec, admitted), response)


@router.post("/{id}/heartbeat", summary="Keep a request", responses=documented(404, 409, 413, 415, 422))
def keep_request(id: Id, holder: Holder, store: StoreDep) -> RequestRead:
    """Extend a take by its lease."""
    return taking.heartbeat(store, id, holder)


@router.post("/{id}/release", summary="Release a request", responses=documented(404, 409, 413, 415, 422))
def release_request(id: Id, spec: Release, store: StoreDep) -> RequestRead:
    """End a take without an answer; with `operator` and `reason` that of somebody else, whose phone is dead."""
    return taking.release(store, id, spec)


@router.post("/{id}/reopen", summary="Open a stuck request again", responses=documented(404, 409))
def reopen_request(id: Id, store: StoreDep) -> RequestRead:
    """Open a request again that was taken too often without an answer."""
    return taking.reopen(store, id)


@router.post(
    "/{id}/measurements",
    status_code=201,
    summary="Answer a request",
    response_description="Stored; its `state` says whether it counts",
    responses=documented(404, 409, 413, 415, 422, 429),
)
def answer_request(
    id: Id, spec: Measurement, store: StoreDep, admitted: AdmissionDep, request: Request, response: Response
) -> AnswerRead:
    """Store what was measured, or why nothing could be. An answer that is in conflict with another one is kept too.

    In place of values, an answer may name traces that are stored as attachments: see `POST /requests/{id}/traces`.
    """
    found = measured_by_traces(store, request.app.state.rollout_process, id, spec)
    done = answering.answer(store, id, spec, admitted, found)
    return created(done, response, request.app.url_path_for("read_request", id=done.answer.request))


@router.post("/{id}/doubts", summary="Check an answer", responses=documented(404, 413, 415, 422))
def check_answer(id: Id, spec: Measurement, store: StoreDep) -> DoubtsRead:
    """Say what is unlikely about an answer before it is given, and store nothing."""
    return doubts.read(store, id, spec)


@router.post("/{id}/traces", summary="Evaluate traces", responses=documented(404, 409, 413, 415, 422, 429))
def evaluate_traces(id: Id, spec: Traces, store: StoreDep, process: RolloutProcessDep) -> TracesRead:
    """Compute fitness and readings from the recorded motion of the base, and store nothing.

    A trace is a CSV file with the columns `time_s`, `x`, `y`, `z` (metres, z upwards from the ground) and `qx`, `qy`,
    `qz`, `qw`, stored as an attachment. It contains the whole motion; its clock, origin and heading do not matter. The
    clock is aligned by cross-correlation with the motion that the best simulator expects.
    """
    return traces.evaluate_traces(store, process, id, spec)
