"""Recordings as tables: read from CSV, Parquet, LeRobot data sets and MCAP, and mapped to the joints of a robot.

They are read here, so that the service parses CSV alone.
"""

import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from itertools import chain, groupby
from operator import itemgetter
from pathlib import Path
from types import SimpleNamespace
from typing import Any, TypedDict, Unpack

from gaplab.api.clients.errors import library
from gaplab.schemas.traces import TRACE_COLUMNS, heading_parts, how_parts, said_of
from gaplab.services.csv_tables import Table, read_csv

COLUMNS = {
    "observation.state": "angle",
    "observation.velocity": "speed",
    "observation.effort": "torque",
    "action": "command",
}
"""What the columns of a LeRobot data set say."""

ALL = "*"
"""In place of a joint in a mapping: all of which nothing else says how they count."""

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


class Chosen(TypedDict, total=False):
    """What of a recording is its trace."""

    topic: str | None
    body: str | None
    episode: int | None


def trace_csv(file: str | Path, columns: Mapping[str, str] | None = None, **chosen: Unpack[Chosen]) -> bytes:
    """Return a recording as CSV; see `Bench.attach_trace`."""
    path = Path(file)
    if path.is_file() and path.suffix.lower() not in {".mcap", ".parquet"} and not columns:
        return path.read_bytes()
    table = recording(path, **chosen)
    return (mapped(table, columns) if columns else table).csv().encode()


def recording(path: Path, **chosen: Unpack[Chosen]) -> Table:
    """Return the table of a recording, in whatever format it is; see `Bench.attach_trace`."""
    suffix = path.suffix.lower()
    if suffix == ".mcap":
        return mcap_table(path, chosen.get("topic"), chosen.get("body"))
    if suffix == ".parquet" and _root(path) is None:
        table = _parquet(path)
        return Table.of(table.column_names, [*zip(*(each.to_pylist() for each in table.columns), strict=True)])
    if suffix != ".parquet" and not path.is_dir():
        return read_csv(path.read_text("utf-8", "replace"))
    found = lerobot_tables(path, chosen.get("episode"))
    if len(found) > 1:
        raise ValueError(f"{path.name} has {len(found)} episodes; permitted: {min(found)} to {max(found)}")
    return found.popitem()[1]


def mapped(table: Table, columns: Mapping[str, str]) -> Table:
    """Return a table whose headings name the joints of a robot.

    Args:
        table: the table.
        columns: by joint, its name in the table, and in brackets how its columns count; by `*`, how all others count:
            `{"elbow": "Elbow [-deg @ 90]", "command elbow": "goal", "*": "[deg]"}`.

    Raises:
        ValueError: the table has no such column.
    """
    met, there = set[str](), table.header.cells
    said = {joint: heading_parts(column) for joint, column in columns.items()}
    _, usual = said.pop(ALL, ("", ""))
    named = {name: (joint, how) for joint, (name, how) in said.items()}
    headings = list[str]()
    for heading in there:
        name, how = heading_parts(heading)
        quantity, rest = said_of(name)
        key = name if name in named else rest
        met.add(key)
        if name and name not in TRACE_COLUMNS and (key in named or usual):
            joint, wanted = named.get(key, (rest, ""))
            what, joint = said_of(joint)
            counted = _counted(wanted or how or usual, what or quantity)
            called = f"{what or quantity or 'angle'} {joint}" if key in named else name  # a column may be of no joint
            heading = f"{called}{f' [{counted}]' if counted else ''}"
        headings.append(heading)
    for name in named.keys() - met:
        found = ", ".join(filter(None, there))[:500]
        raise ValueError(f"the recording has no column of {name!r} for {named[name][0]}; it has {found}")
    return table._replace(header=table.header._replace(cells=headings))


def _counted(how: str, quantity: str) -> str:
    """Return how a quantity counts, given how the angle of its joint does."""
    sign, unit, _ = how_parts(how)
    if quantity == "torque":
        return sign
    return f"{sign}{unit}{'/s' if unit and not unit.endswith('/s') else ''}" if quantity == "speed" else how


def _root(path: Path) -> Path | None:
    """Return the folder of the LeRobot data set that something is in."""
    return next((each for each in (path, *path.parents) if (each / "meta" / "info.json").is_file()), None)


def lerobot_tables(path: Path, episode: int | None = None) -> dict[int, Table]:
    """Return the episodes of a LeRobot data set by their numbers, of version 2.1 or 3.

    Args:
        path: its folder, which has `meta/info.json`, or one of the Parquet files in it.
        episode: number of the only one that is read; None: all.

    Raises:
        ExtraMissing: pyarrow is not installed.
        ValueError: it is not such a data set, or does not have this episode.
    """
    if (root := _root(path)) is None:
        raise ValueError(f"{path.name} is not of a LeRobot data set: there is no meta/info.json at or above it")
    info = json.loads((root / "meta" / "info.json").read_text("utf-8"))
    rows = _frames([path] if path.is_file() else sorted((root / "data").rglob("*.parquet")), episode)
    if not rows:
        found = "0 episodes" if episode is None else f"no episode {episode}"
        raise ValueError(f"{path.name} has {found}; permitted: 0 to {info['total_episodes'] - 1}")
    rows.sort(key=itemgetter("episode_index", "frame_index"))
    try:
        names = {column: _names(info["features"][column]) for column in COLUMNS if column in rows[0]}
        times_s = [row["timestamp"] if "timestamp" in row else row["frame_index"] / info["fps"] for row in rows]
    except KeyError as error:
        raise ValueError(f"meta/info.json of {path.name} lacks {error}") from error
    for column, joints in names.items():
        if len(rows[0][column]) != len(joints):
            raise ValueError(f"{column} has {len(rows[0][column])} numbers, and its names are {', '.join(joints)}")
    headings = ["time_s", *(f"{COLUMNS[column]} {joint}" for column, joints in names.items() for joint in joints)]
    return {
        number: Table.of(headings, [[time_s, *chain(*(row[column] for column in names))] for time_s, row in some])
        for number, some in groupby(zip(times_s, rows, strict=True), key=lambda each: each[1]["episode_index"])
    }


def _frames(files: Sequence[Path], episode: int | None) -> list[dict[str, Any]]:
    """Return the frames of an episode, or of all."""
    chosen = None if episode is None else [("episode_index", "=", episode)]
    columns = ("episode_index", "frame_index", "timestamp", *COLUMNS)
    return [row for file in files for row in _parquet(file, columns, chosen).to_pylist()]


def _parquet(file: Path, columns: Sequence[str] | None = None, chosen: Any = None) -> Any:  # noqa: ANN401 - of pyarrow
    """Return the table of a file: of its columns, those that are wanted; of its rows, the chosen ones."""
    parquet, arrow = library("pyarrow.parquet", "lerobot"), library("pyarrow", "lerobot")
    try:
        wanted = columns and [each for each in columns if each in parquet.read_schema(file).names]
        return parquet.read_table(file, columns=wanted, filters=chosen)
    except (arrow.ArrowException, OSError) as error:
        raise ValueError(f"{file.name} cannot be read: {error}") from error


def _names(feature: Mapping[str, Any]) -> list[str]:
    """Return the names of a feature's numbers: a list, or lists by kind; `shoulder_pan.pos` is `shoulder_pan`."""
    names = feature["names"]
    every = names if isinstance(names, list) else [name for group in names.values() for name in group]
    return [name.removesuffix(".pos") for name in every]


def mcap_table(file: Path, topic: str | None = None, body: str | None = None) -> Table:
    """Return the trace of an MCAP file as a table; see `Bench.attach_trace`."""
    mcap, ros = library("mcap.reader", "mcap"), library("mcap_ros2.decoder", "mcap")
    with file.open("rb") as stream:
        factories: list[Any] = [ros.DecoderFactory(), _Json()]
        with _readable(file):
            reader = mcap.make_reader(stream, decoder_factories=factories)
            summary = reader.get_summary()
        chosen, schema = _chosen(summary, topic, file)
        poses: dict[str, list[list[float]]] = {}
        with _readable(file):
            messages = reader.iter_decoded_messages(topics=[chosen])
            if schema == JOINTS:
                return _joints((_time_s(decoded, message.log_time), decoded) for _, _, message, decoded in messages)
            for _, _, message, decoded in messages:
                name = getattr(decoded, "child_frame_id", "")
                poses.setdefault(name, []).append(_pose(decoded, message.log_time))
    return Table.of(TRACE_COLUMNS, _of_body(poses, body, f"{file.name} has {{}} on {chosen!r}"))


@contextmanager
def _readable(file: Path) -> Iterator[None]:
    try:
        yield
    except Exception as error:  # mcap and its decoders raise anything for a broken file
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
        quantities = ("angle", "position"), ("speed", "velocity"), ("torque", "effort")  # JSON may leave some out
        told = ((what, getattr(message, name, ())) for what, name in quantities)
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
    while (deeper := next(_fields(inner, _NESTED), None)) is not None:
        inner = deeper
    time_s = _time_s(message, log_time_ns)
    place, turn = (next(_fields(inner, names), None) for names in (_PLACES, _TURNS))
    if place is None or turn is None:
        raise ValueError(f"the pose at {time_s:.10g} s has no {' or '.join(_PLACES if place is None else _TURNS)}")
    return [time_s, place.x, place.y, place.z, turn.x, turn.y, turn.z, turn.w]


def _time_s(message: Any, log_time_ns: int) -> float:  # noqa: ANN401 - of any schema
    """Return the time of a message's stamp, or else that of the recording."""
    stamp = next(_fields(getattr(message, "header", message), _STAMPS), None)
    nanoseconds = 0 if stamp is None else round(stamp.sec * 10**9 + next(_fields(stamp, _NANOSECONDS), 0))
    return (nanoseconds or log_time_ns) / 1e9


def _fields(message: Any, names: tuple[str, ...]) -> Iterator[Any]:  # noqa: ANN401 - of any schema
    yield from (getattr(message, name) for name in names if hasattr(message, name))
