"""Measurements of a robot on a bench: requests, takes, answers, corrections, attachments, and tables of samples."""

from time import monotonic
from typing import Literal

from anyio.to_thread import run_sync
from fastapi import APIRouter, Request, Response
from fastapi.concurrency import run_in_threadpool
from pydantic import Field, Json

from gaplab.api.http.answers import attachment, created, once_answered, saved_as
from gaplab.api.http.dependencies import (
    AdmissionDep,
    Asked,
    CallerDep,
    FeedDep,
    Id,
    LimitsDep,
    Paging,
    Parameters,
    RolloutProcessDep,
    StoreDep,
    StreamsDep,
)
from gaplab.api.http.documentation import sent, taken
from gaplab.api.http.problems import documented
from gaplab.schemas.corrections import BranchRead, ConflictSpec, Consequences, CorrectionSpec, VoidSpec
from gaplab.schemas.events import EventKind
from gaplab.schemas.measurements import (
    AnswerRead,
    AttachmentRead,
    DoubtsRead,
    HolderSpec,
    MeasurementSpec,
    ReleaseSpec,
    RequestRead,
    TakeSpec,
)
from gaplab.schemas.plugin import PluginRef
from gaplab.schemas.records import Page
from gaplab.schemas.samples import SamplesRead
from gaplab.schemas.traces import TracesRead, TracesSpec
from gaplab.services import events
from gaplab.services.events import WantedEvents
from gaplab.services.experiments import stored_files
from gaplab.services.measuring import answering, attachments, corrections, doubts, motion_files, rewriting, taking
from gaplab.services.measuring.taking import RequestFilter
from gaplab.services.replay import traces
from gaplab.services.replay.traces import measured_by_traces
from gaplab.services.specs.robots import Driven
from gaplab.services.store.session import Store

router = APIRouter(tags=["bench"])

_NEWS = frozenset(EventKind) - frozenset(
    {EventKind.SELECTED, EventKind.MEASURED, EventKind.TUNED, EventKind.TRANSFERRED, EventKind.PROBED}
)
"""What may add a request to a list, or be the end of its experiment: steps are neither."""

_MOTIONS = {"csv": ("text/csv", "csv"), "json": ("application/json", "json"), "ros2": ("application/yaml", "yaml")}

_MOTION = {
    "text/csv": "time_s,front_left_knee (rad)\n-1.0,0.0\n0.0,0.12\n",
    "application/json": {
        "start": {"front_left_knee": 0.0},
        "actuators": ["front_left_knee"],
        "units": ["rad"],
        "times_s": [0.0],
        "targets": [[0.12]],
        "observe_s": [0.75],
    },
    "application/yaml": "joint_names: [front_left_knee]\n",
}


class RequestQuery(Paging):
    """The requests to list."""

    experiment: Id | None = Field(None, description="only requests of this experiment")
    bench: str | None = Field(None, max_length=200, description="only requests of this bench")
    pending: bool = Field(
        True, description="only requests that are still needed; of a paused experiment, only one that is taken"
    )
    conflicts: bool = Field(False, description="only requests with an answer in conflict, to be decided")
    wait_s: float = Field(0.0, ge=0, le=60, description="seconds to wait for a request if there is none")


class MotionQuery(Parameters):
    """The format of a motion."""

    format: Literal["csv", "json", "ros2"] = Field("csv", description="ros2: a trajectory_msgs/JointTrajectory in YAML")


@router.get("/requests", summary="List the requests for measurements", responses=documented(429))
async def list_requests(
    query: Asked[RequestQuery], store: StoreDep, feed: FeedDep, streams: StreamsDep, caller: CallerDep
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


@router.get("/requests/{id}", summary="Read a request")
def read_request(id: Id, store: StoreDep) -> RequestRead:
    """Return a request with its answers."""
    return taking.read_request(store, id)


@router.get(
    "/requests/{id}/motion",
    summary="Read the motion to run",
    response_class=Response,
    responses=sent(_MOTION) | documented(409),
)
def read_motion(id: Id, query: Asked[MotionQuery], store: StoreDep) -> Response:
    """Return the targets of the actuators over time, with the unit of each, after a rest in the start pose.

    A controller that observes the robot while it acts, or of a robot without actuators, has none: 409.
    """
    media_type, ending = _MOTIONS[query.format]
    return attachment(motion_files.request_motion(store, id, query.format), media_type, f"motion-{id}.{ending}")


@router.post("/requests/{id}/take", summary="Take a request", responses=documented(409))
def take_request(id: Id, spec: TakeSpec, store: StoreDep, admitted: AdmissionDep, response: Response) -> RequestRead:
    """Take a request: nobody else can take it, or another of its bench, until the take ends or runs out."""
    return once_answered(taking.take(store, id, spec, admitted), response)


@router.post("/requests/{id}/heartbeat", summary="Keep a request", responses=documented(409))
def keep_request(id: Id, holder: HolderSpec, store: StoreDep) -> RequestRead:
    """Extend a take by its lease."""
    return taking.heartbeat(store, id, holder)


@router.post("/requests/{id}/release", summary="Release a request", responses=documented(409))
def release_request(id: Id, spec: ReleaseSpec, store: StoreDep) -> RequestRead:
    """End a take without an answer; with `operator` and `reason` that of somebody else, whose phone is dead."""
    return taking.release(store, id, spec)


@router.post("/requests/{id}/reopen", summary="Open a stuck request again", responses=documented(409))
def reopen_request(id: Id, store: StoreDep) -> RequestRead:
    """Open a request again that was taken too often without an answer."""
    return taking.reopen(store, id)


@router.post(
    "/requests/{id}/measurements",
    status_code=201,
    summary="Answer a request",
    response_description="Stored; its `state` says whether it counts",
    responses=documented(409, 429),
)
def answer_request(
    id: Id,
    spec: MeasurementSpec,
    store: StoreDep,
    process: RolloutProcessDep,
    admitted: AdmissionDep,
    response: Response,
) -> AnswerRead:
    """Store what was measured, or why nothing could be. An answer that is in conflict with another one is kept too.

    In place of values, an answer may name traces that are stored as attachments: see `POST /requests/{id}/traces`.
    """
    found = measured_by_traces(store, process, id, spec)
    done = answering.answer(store, id, spec, admitted, found)
    return created(done, response, f"/requests/{done.answer.request}")


@router.post("/requests/{id}/doubts", summary="Check an answer")
def check_answer(id: Id, spec: MeasurementSpec, store: StoreDep) -> DoubtsRead:
    """Say what is unlikely about an answer before it is given, and store nothing."""
    return doubts.read(store, id, spec)


@router.post("/requests/{id}/traces", summary="Evaluate traces", responses=documented(409, 429))
def evaluate_traces(id: Id, spec: TracesSpec, store: StoreDep, process: RolloutProcessDep) -> TracesRead:
    """Compute fitness and readings from recorded motions, and store nothing.

    A trace is a CSV file with the column `time_s`, and the pose of the base or the joints, stored as an attachment. The
    pose is `x`, `y`, `z` (metres, z upwards from the ground) and `qx`, `qy`, `qz`, `qw`. Joints are `angle JOINT`, and
    perhaps `speed JOINT`, `torque JOINT` and `command JOINT`, in the units of the heading: `angle elbow [-deg @ 90]`
    counts against the joint, in degrees, from 90. It contains the whole motion; clock, origin and heading do not
    matter. The clock is aligned by cross-correlation of the commands, or else with the motion that the best simulator
    expects.
    """
    return traces.evaluate_traces(store, process, id, spec)


class Rehearsal(Parameters):
    """Whether to store the correction, or only to answer what would follow from it."""

    dry_run: bool = Field(False, description="only answer what would follow; store nothing")


@router.post("/measurements/{id}/corrections", summary="Correct a measurement", responses=documented(409))
def correct_measurement(
    id: Id, spec: CorrectionSpec, query: Asked[Rehearsal], store: StoreDep, admitted: AdmissionDep, response: Response
) -> Consequences:
    """Replace the values that count. What was computed from them is computed again; the old steps stay readable."""
    return once_answered(corrections.correct(store, id, spec, admitted, dry_run=query.dry_run), response)


@router.post("/measurements/{id}/void", summary="Void a measurement", responses=documented(409))
def void_measurement(
    id: Id, spec: VoidSpec, query: Asked[Rehearsal], store: StoreDep, admitted: AdmissionDep, response: Response
) -> Consequences:
    """Declare the values invalid, and request the controller again."""
    return once_answered(corrections.void(store, id, spec, admitted, dry_run=query.dry_run), response)


@router.post("/measurements/{id}/decision", summary="Decide about a conflict", responses=documented(409))
def decide_measurement(
    id: Id, spec: ConflictSpec, query: Asked[Rehearsal], store: StoreDep, admitted: AdmissionDep, response: Response
) -> Consequences:
    """Let an answer in conflict count in place of the other, or dismiss it."""
    return once_answered(corrections.decide(store, id, spec, admitted, dry_run=query.dry_run), response)


@router.get("/experiments/{id}/branches", summary="List the closed branches")
def list_branches(id: Id, store: StoreDep) -> tuple[BranchRead, ...]:
    """List the steps that corrections closed; they count nowhere."""
    return rewriting.list_branches(store, id)


class AttachmentQuery(Parameters):
    """The name of a file."""

    name: str = Field(min_length=1, max_length=200, description="name of the file")


@router.post(
    "/attachments",
    status_code=201,
    summary="Store an attachment",
    responses=documented(429),
    openapi_extra=taken("application/octet-stream"),
)
def store_attachment(
    query: Asked[AttachmentQuery], request: Request, store: StoreDep, limits: LimitsDep
) -> AttachmentRead:
    """Store a file, sent as the body, under the hash of its content; answers name it by that."""
    content, media_type = request.state.body.read(), request.headers.get("content-type", "application/octet-stream")
    most = limits.unnamed_attachment_bytes
    return attachments.store_attachment(store, content, query.name, media_type[:100], most)


@router.get(
    "/attachments/{id}",
    summary="Read an attachment",
    response_class=Response,
    responses=sent({"application/octet-stream": "…"}, "the file"),
)
def read_attachment(id: Id, store: StoreDep) -> Response:
    """Return a stored file, to be saved: a browser must not run what somebody sent."""
    found, content = attachments.read_attachment(store, id)
    headers = {"Content-Disposition": saved_as(found.name)}
    return Response(content, media_type="application/octet-stream", headers=headers)


class SamplesQuery(Parameters):
    """The robot of a table, and what drives it and rates it."""

    robot: str = Field(min_length=1, max_length=200, description="name of the robot that was measured")
    options: Json[dict[str, object]] = Field({}, description="its options, as JSON")
    controller: Json[PluginRef] | None = Field(None, description="its controller, as JSON; default: its own")
    task: Json[PluginRef] | None = Field(None, description="its task, as JSON; default: its own")


@router.post(
    "/samples/check",
    summary="Check a table of samples",
    response_description="The samples for `reality.samples` of a spec, or everything that is wrong",
    openapi_extra=taken("text/csv", "gene_0,value_1,value_2\n0.25,0.41,0.44\n"),
)
async def check_samples(query: Asked[SamplesQuery], request: Request, store: StoreDep) -> SamplesRead:
    """Read a CSV table line by line, and store nothing. Errors have the line, the column and what is permitted.

    Columns are `gene_0`, `gene_1` and so on; `value`, or `value_1`, `value_2` and so on for repeats; and optionally
    readings like `roll@0.75`, or `roll@0.75#2` of repeat 2. An empty reading means that the sensor failed.
    """
    text = (await request.body()).decode("utf-8", "replace")
    robot = Driven(PluginRef(name=query.robot, options=query.options), query.controller, query.task)
    return await run_in_threadpool(stored_files.check_samples, store, text, robot)
