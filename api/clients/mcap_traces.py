"""Traces in MCAP, as ROS 2 and Foxglove record them: poses of a base, or states of joints."""

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from gaplab.api.clients.errors import library
from gaplab.schemas.traces import TRACE_COLUMNS
from gaplab.services.csv_tables import Table

POSES = {
    "geometry_msgs/msg/PoseStamped",
    "geometry_msgs/msg/PoseWithCovarianceStamped",
    "geometry_msgs/msg/TransformStamped",
    "nav_msgs/msg/Odometry",
    "foxglove.PoseInFrame",
}
"""Messages that have the pose of one frame: in ROS 2's encoding, or as JSON."""

JOINTS = "sensor_msgs/msg/JointState"
"""Messages that have angles, and perhaps speeds and torques, of joints by name."""

_NESTED = ("pose", "transform")
_PLACES, _TURNS = ("position", "translation"), ("orientation", "rotation")
_STAMPS, _NANOSECONDS = ("timestamp", "stamp"), ("nsec", "nanosec")


def mcap_table(file: Path, topic: str | None = None, body: str | None = None) -> Table:
    """Return the trace of an MCAP file as a table; see `Bench.attach_trace`."""
    mcap, ros = library("mcap.reader", "mcap"), library("mcap_ros2.decoder", "mcap")
    errors = library("mcap.exceptions", "mcap")
    try:
        with file.open("rb") as stream:
            factories: list[Any] = [ros.DecoderFactory(), _Json()]
            reader = mcap.make_reader(stream, decoder_factories=factories)
            chosen, schema = _chosen(reader.get_summary(), topic, file)
            messages = reader.iter_decoded_messages(topics=[chosen])
            if schema == JOINTS:
                return _joints((_time_s(decoded, message.log_time), decoded) for _, _, message, decoded in messages)
            poses: dict[str, list[list[float]]] = {}
            for _, _, message, decoded in messages:
                name = getattr(decoded, "child_frame_id", "")
                poses.setdefault(name, []).append(_pose(decoded, message.log_time))
            return Table.of(TRACE_COLUMNS, _of_body(poses, body, f"{file.name} has {{}} on {chosen!r}"))
    except errors.McapError as error:
        raise ValueError(f"{file.name} is not an MCAP file that can be read: {error}") from error


class _Json:
    """Decodes messages in JSON."""

    def decoder_for(self, message_encoding: str, schema: Any) -> Any:  # noqa: ANN401, ARG002 - mcap's interface
        """Return the decoder of JSON, or None for another encoding."""
        if message_encoding != "json":
            return None
        return lambda data: json.loads(data, object_hook=lambda fields: SimpleNamespace(**fields))


def _chosen(summary: Any, topic: str | None, file: Path) -> tuple[str, str]:  # noqa: ANN401 - of mcap
    """Return a topic and its schema: the given one; or the only one that has poses, or without any, joints."""
    if summary is None:
        raise ValueError(f"{file.name} has no summary, perhaps because its recording was cut off; repair it first")
    schemas = {id_: schema.name for id_, schema in summary.schemas.items()}
    every = {each.topic: schemas.get(each.schema_id, "") for each in summary.channels.values()}
    poses = [name for name, schema in every.items() if schema in POSES]
    joints = [name for name, schema in every.items() if schema == JOINTS]
    found = poses or joints if topic is None else [*poses, *joints]
    if topic in found or (topic is None and len(found) == 1):
        name = topic or found[0]
        return name, every[name]
    what = "joints" if joints and not poses else "poses"
    wrong = f"topics of {what}" if topic is None else f"{what} on {topic!r}"
    permitted = ", ".join(sorted(found)) or f"none: no topic has one of {', '.join(sorted({*POSES, JOINTS}))}"
    raise ValueError(
        f"{file.name} has {'several' if topic is None and found else 'no'} {wrong}; permitted: {permitted}"
    )


def _joints(messages: Iterator[tuple[float, Any]]) -> Table:
    """Return the trace of states of joints, whose order may change from one message to the next."""
    rows = []
    for time_s, message in messages:
        told = (("angle", message.position), ("speed", message.velocity), ("torque", message.effort))
        said = ((f"{what} {name}", value) for what, values in told for name, value in zip(message.name, values))  # noqa: B905 - lists may be empty
        rows.append({"time_s": time_s, **dict(said)})
    headings = list(dict.fromkeys(name for row in rows for name in row)) or ["time_s"]
    return Table.of(headings, [[row.get(name) for name in headings] for row in rows])


def _of_body(poses: Mapping[str, list[list[float]]], body: str | None, problem: str) -> list[list[float]]:
    """Return the poses of the named body, or of the only one."""
    if body is None and len(poses) < 2:
        return next(iter(poses.values()), [])
    if body is None or body not in poses:
        what = "several bodies" if body is None else f"no body {body!r}"
        raise ValueError(f"{problem.format(what)}; choose one by its child_frame_id: {', '.join(sorted(poses))}")
    return poses[body]


def _pose(message: Any, log_time_ns: int) -> list[float]:  # noqa: ANN401 - of any schema
    """Return the row of a message."""
    inner = message
    while (deeper := next(_parts(inner, _NESTED), None)) is not None:
        inner = deeper
    place, turn = next(_parts(inner, _PLACES)), next(_parts(inner, _TURNS))
    return [_time_s(message, log_time_ns), place.x, place.y, place.z, turn.x, turn.y, turn.z, turn.w]


def _time_s(message: Any, log_time_ns: int) -> float:  # noqa: ANN401 - of any schema
    """Return the time of a message's stamp, or else that of the recording."""
    stamp = next(_parts(getattr(message, "header", message), _STAMPS), None)
    nanoseconds = 0 if stamp is None else round(stamp.sec * 10**9 + next(_parts(stamp, _NANOSECONDS), 0))
    return (nanoseconds or log_time_ns) / 1e9


def _parts(message: Any, names: tuple[str, ...]) -> Iterator[Any]:  # noqa: ANN401 - of any schema
    yield from (getattr(message, name) for name in names if hasattr(message, name))
