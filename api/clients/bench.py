"""Measurements of a robot on a bench: requests, answers, corrections, and the loop of a driver."""

import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, TypedDict, Unpack

from gaplab.api.clients.bodies import json_of, numbers_of, readings_of
from gaplab.api.clients.connection import Connected, Connection, Of, Rows, id_of, segment
from gaplab.api.clients.driving import Driving, TakenRequest
from gaplab.api.clients.journal import Journal
from gaplab.api.clients.studies import Studies
from gaplab.api.clients.trace_files import Chosen, trace_csv
from gaplab.schemas.corrections import BranchRead, Consequences
from gaplab.schemas.measurements import AnswerRead, AttachmentRead, DoubtsRead, RequestRead
from gaplab.schemas.records import Page
from gaplab.schemas.samples import SamplesRead
from gaplab.schemas.traces import TracesRead

PAGE = 500
"""Requests for measurements of one list: the most that the service permits."""


class Details(TypedDict, total=False):
    """Optional parts of an answer or a correction."""

    failed: str
    readings: Sequence[Any]
    unit: str
    operator: str
    note: str
    attachments: Sequence[Of]
    traces: Sequence[Of]
    lags_s: Sequence[float | None]
    take: int
    confirmed: bool


class Requests(Studies):
    """The loop of a driver."""

    def requests(
        self,
        experiment: Of | None = None,
        *,
        bench: str | None = None,
        operator: str | None = None,
        lease_s: float = 60.0,
        journal: str | Path | None = None,
    ) -> Iterator[TakenRequest]:
        """Yield the requests one after the other, each taken, until the experiment has ended.

            for request in client.requests(experiment, journal="journal.jsonl"):
                request.tell(run(request.motion))

        A request that is neither told nor failed is released. Heartbeats keep it while its turn lasts; answers are sent
        again until the service has them.

        Args:
            experiment: the experiment; left out: all of them, without end.
            bench: only requests of this bench.
            operator: name of the driver; left out: this machine's name.
            lease_s: seconds without a heartbeat after which others may take a request.
            journal: file that keeps each answer until the service has it; answers of an earlier run are sent first.
        """
        with Journal(journal) as kept:
            driving = Driving(self._connection, self, kept, lease_s, operator)
            yield from driving.tasks(experiment, bench)


class Bench(Connected):
    """A robot on a bench: what is to be measured, and what was.

    A request, an answer or a stored file may be given in place of its id.
    """

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def pending(
        self, experiment: Of | None = None, *, bench: str | None = None, wait_s: float = 0.0
    ) -> tuple[RequestRead, ...]:
        """Return the requests that are still needed, the oldest first; wait up to `wait_s` if there is none."""
        parameters: dict[str, Any] = {"experiment": experiment, "bench": bench, "wait_s": wait_s, "limit": PAGE}
        return Rows(self._connection.items(Page[RequestRead], "/requests", **parameters))

    def history(self, experiment: Of | None = None, *, bench: str | None = None) -> tuple[RequestRead, ...]:
        """Return all requests, also those that are measured, failed or withdrawn, the oldest first."""
        parameters: dict[str, Any] = {"experiment": experiment, "bench": bench, "pending": "false", "limit": PAGE}
        return Rows(self._connection.items(Page[RequestRead], "/requests", **parameters))

    def request(self, id: Of) -> RequestRead:
        """Return a request with its answers."""
        return self._connection.get(RequestRead, f"/requests/{segment(id)}")

    def motion(self, id: Of, form: Literal["csv", "json", "ros2"] = "csv") -> str:
        """Return the motion that a request asks for: CSV, JSON, or a ROS 2 JointTrajectory in YAML."""
        return self._connection.get_bytes(f"/requests/{segment(id)}/motion", format=form).decode()

    def answer(self, id: Of, values: Sequence[float] | None = None, **details: Unpack[Details]) -> AnswerRead:
        """Answer a request by hand: with the values of all repeats, or the reason why it `failed`.

        Args:
            id: id of the request.
            values: fitness of each repeat; None if it failed, or has `traces`.
            details: `failed`, `readings`, `unit`, `operator`, `note`, `attachments` (hashes) and `take`; in place of
                values, `traces` (hashes, one for each repeat) and perhaps their `lags_s`. `confirmed` says that
                unlikely values are right; without it, the `doubts` of the returned answer name them.
        """
        return self._connection.post(AnswerRead, f"/requests/{segment(id)}/measurements", _body(values, details))

    def doubts(self, id: Of, values: Sequence[float] | None = None, **details: Unpack[Details]) -> tuple[str, ...]:
        """Return what is unlikely about an answer that was not given yet, each as a sentence; see `answer`."""
        return self._connection.post(DoubtsRead, f"/requests/{segment(id)}/doubts", _body(values, details)).doubts

    def correct(
        self,
        answer: Of,
        values: Sequence[float] | None = None,
        *,
        reason: str,
        dry_run: bool = False,
        **details: Unpack[Details],
    ) -> Consequences:
        """Replace the values of an answer that counts; with `dry_run` only return what would follow.

        Permitted details are `failed` (why there are no values), `readings`, `unit` and `operator`.
        """
        return self._after(answer, "corrections", _body(values, details) | {"reason": reason}, dry_run=dry_run)

    def void(self, answer: Of, *, reason: str, operator: str | None = None, dry_run: bool = False) -> Consequences:
        """Void an answer, whose controller is then requested again; with `dry_run` only return what would follow."""
        return self._after(answer, "void", {"reason": reason, "operator": operator}, dry_run=dry_run)

    def decide(
        self,
        answer: Of,
        counts: Literal["this", "other"],
        *,
        reason: str,
        operator: str | None = None,
        dry_run: bool = False,
    ) -> Consequences:
        """Let an answer in conflict count, or the other one; with `dry_run` only return what would follow."""
        body = {"counts": counts, "reason": reason, "operator": operator}
        return self._after(answer, "decision", body, dry_run=dry_run)

    def reopen(self, id: Of, *, reason: str | None = None, operator: str | None = None) -> RequestRead:
        """Open a request again that was taken too often without an answer.

        With a `reason`, like "her phone is dead", the `operator` ends the take of somebody else, who still has it.
        """
        path = f"/requests/{segment(id)}"
        if reason is None:
            return self._connection.change(RequestRead, "POST", f"{path}/reopen")
        body = {"take": self.request(id).takes, "reason": reason, "operator": operator}
        return self._connection.change(RequestRead, "POST", f"{path}/release", json=body)

    def attach(self, file: str | Path, media_type: str = "application/octet-stream") -> AttachmentRead:
        """Store a file, and return its hash, by which answers name it."""
        path = Path(file)
        return self._attach(path.name, path.read_bytes(), media_type)

    def attach_trace(
        self, file: str | Path, columns: Mapping[str, str] | None = None, **chosen: Unpack[Chosen]
    ) -> AttachmentRead:
        """Store a recording as a trace in CSV, and return its hash.

        Args:
            file: CSV; MCAP, for the extra `gaplab[mcap]`; Parquet or the folder of a LeRobot data set, for
                `gaplab[lerobot]`.
            columns: what each joint is called there, and in brackets how it counts: sign, unit, and what is read where
                the joint is at zero; by `*`, how all others count: `{"elbow": "Elbow [-deg @ 90]", "*": "[deg]"}`.
            chosen: `topic` of the base's pose or the joints' states in MCAP, if there are several; `body`: its
                `child_frame_id`, if the topic has several; `episode` of a LeRobot data set.

        Raises:
            ExtraMissing: the libraries for this format are not installed.
            ValueError: the recording cannot be read, or has no such topic, body, episode or column, or several.
        """
        name = Path(file).with_suffix(".csv").name
        return self._attach(name, trace_csv(file, columns, **chosen), "text/csv")

    def traces(self, id: Of, traces: Sequence[Of], lags_s: Sequence[float | None] | None = None) -> TracesRead:
        """Return fitness and readings that traces of a request say, and how their clocks were aligned.

        Args:
            id: id of the request.
            traces: hashes of attachments, one for each repeat, as of `attach_trace`.
            lags_s: when the motion began on the clock of each trace; None: found by cross-correlation.
        """
        body = _without_none({"traces": list(map(id_of, traces)), "lags_s": lags_s})
        return self._connection.post(TracesRead, f"/requests/{segment(id)}/traces", body)

    def check_samples(
        self,
        file: str | Path,
        robot: str,
        options: Mapping[str, Any] | None = None,
        controller: str | Mapping[str, Any] | None = None,
        task: str | Mapping[str, Any] | None = None,
    ) -> list[dict[str, Any]]:
        """Return the samples of a CSV file, for `reality.samples` of a spec.

        Args:
            file: table with the columns `gene_0`, `gene_1` and so on, and `value`, or `value_1`, `value_2` and so on.
            robot: name of the robot that was measured.
            options: its options; left out: their defaults.
            controller: its controller, as in a spec; left out: its own.
            task: its task, likewise.

        Raises:
            InvalidSamples: the file has errors; all are named.
        """
        given = {"options": dict(options or {}), "controller": controller, "task": task}
        query = "".join(
            f"&{name}={segment(json.dumps(json_of(value)))}" for name, value in given.items() if value is not None
        )
        path, content = f"/samples/check?robot={segment(robot)}{query}", [Path(file).read_bytes()]
        return self._connection.upload(SamplesRead, path, content, "text/csv").checked(Path(file))

    def branches(self, experiment: Of) -> tuple[BranchRead, ...]:
        """Return the steps that corrections closed."""
        return self._connection.get(tuple[BranchRead, ...], f"/experiments/{segment(experiment)}/branches")

    def _attach(self, name: str, content: bytes, media_type: str) -> AttachmentRead:
        return self._connection.upload(AttachmentRead, f"/attachments?name={segment(name)}", [content], media_type)

    def _after(self, answer: Of, what: str, body: dict[str, Any], *, dry_run: bool) -> Consequences:
        path = f"/measurements/{segment(answer)}/{what}{'?dry_run=true' if dry_run else ''}"
        return self._connection.post(Consequences, path, _without_none(body))


def _body(values: Sequence[float] | None, details: Details) -> dict[str, Any]:
    body = _without_none({"values": None if values is None else numbers_of(values, "/values")} | details)
    body |= {name: list(map(id_of, body[name])) for name in ("attachments", "traces") if name in body}
    return body | {"readings": readings_of(body["readings"])} if "readings" in body else body


def _without_none(body: Mapping[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in body.items() if value is not None}
