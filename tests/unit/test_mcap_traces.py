"""Recordings in MCAP as traces."""

import json
import sys
from itertools import product
from pathlib import Path
from typing import Any

import pytest
from mcap.writer import Writer
from mcap_ros2.writer import Writer as RosWriter

from gaplab import ExtraMissing
from gaplab.api.clients.trace_files import mcap_table
from gaplab.services.world.logs import read_trace
from gaplab.services.world.world import World

POSE = """std_msgs/Header header
geometry_msgs/Pose pose
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
================================================================================
MSG: geometry_msgs/Pose
geometry_msgs/Point position
geometry_msgs/Quaternion orientation
================================================================================
MSG: geometry_msgs/Point
float64 x
float64 y
float64 z
================================================================================
MSG: geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w
"""


def pose(x: float) -> dict[str, Any]:
    return {"position": {"x": x, "y": 2.0, "z": 3.0}, "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}}


def ros(file: Path, *, stamped: bool = True) -> Path:
    with file.open("wb") as stream, RosWriter(stream) as writer:
        schema = writer.register_msgdef("geometry_msgs/msg/PoseStamped", POSE)
        for second in range(3):
            stamp = {"sec": 1_700_000_000 + second, "nanosec": 500_000_000} if stamped else {"sec": 0, "nanosec": 0}
            message = {"header": {"stamp": stamp, "frame_id": "map"}, "pose": pose(float(second))}
            writer.write_message("/base", schema, message, log_time=second * 10**9, publish_time=0)
    return file


def foxglove(
    file: Path,
    *topics: str,
    schema: str = "foxglove.PoseInFrame",
    bodies: tuple[str | None, ...] = (None,),
    parts: tuple[str, ...] = ("position", "orientation"),
) -> Path:
    with file.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        kind = writer.register_schema(schema, "jsonschema", b"{}")
        for topic in topics:
            channel = writer.register_channel(topic, "json", kind)
            for second, (place, name) in product(range(2), enumerate(bodies)):
                told = {part: pose(1.0 * place)[part] for part in parts}
                body = {"timestamp": {"sec": second, "nsec": 250_000_000}, "frame_id": "map", "pose": told}
                body |= {"child_frame_id": name} if name else {}
                writer.add_message(channel, log_time=1, data=json.dumps(body).encode(), publish_time=0)
        writer.finish()
    return file


def test_poses_of_ros_2_are_a_trace(tmp_path: Path) -> None:
    trace = read_trace(mcap_table(ros(tmp_path / "run.mcap")), "/traces/0", World())

    assert trace.times_s.tolist() == [1_700_000_000.5, 1_700_000_001.5, 1_700_000_002.5]
    assert trace.positions_m.tolist() == [[0, 2, 3], [1, 2, 3], [2, 2, 3]]
    assert trace.orientations.tolist() == [[0, 0, 0, 1]] * 3
    without = read_trace(mcap_table(ros(tmp_path / "bare.mcap", stamped=False)), "/traces/0", World())
    assert without.times_s.tolist() == [0, 1, 2]


def test_poses_of_foxglove_are_a_trace_of_the_named_topic(tmp_path: Path) -> None:
    file = foxglove(tmp_path / "run.mcap", "/base", "/camera")

    assert read_trace(mcap_table(file, "/base"), "/traces/0", World()).times_s.tolist() == [0.25, 1.25]
    with pytest.raises(ValueError, match="has several topics of poses; permitted: /base, /camera"):
        mcap_table(file)
    with pytest.raises(ValueError, match="has no poses on '/bse'; permitted: /base, /camera"):
        mcap_table(file, "/bse")


def test_of_several_bodies_on_a_topic_one_is_chosen(tmp_path: Path) -> None:
    file = foxglove(tmp_path / "run.mcap", "/mocap", bodies=("wand", "base"))

    assert read_trace(mcap_table(file, body="base"), "/traces/0", World()).positions_m[:, 0].tolist() == [1.0, 1.0]
    with pytest.raises(ValueError, match=r"several bodies on '/mocap'; choose one by its child_frame_id: base, wand"):
        mcap_table(file)
    with pytest.raises(ValueError, match=r"no body 'bse' on '/mocap'; choose one by its child_frame_id: base, wand"):
        mcap_table(file, body="bse")


def test_what_has_no_poses_is_told(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="has no topics of poses"):
        mcap_table(foxglove(tmp_path / "log.mcap", "/log", schema="foxglove.Log"))
    (tmp_path / "no.mcap").write_bytes(b"time_s,x\n0,0\n" * 20)
    with pytest.raises(ValueError, match=r"no\.mcap is not an MCAP file that can be read"):
        mcap_table(tmp_path / "no.mcap")


def test_what_is_cut_or_lacks_a_part_is_told_with_its_file(tmp_path: Path) -> None:
    whole, cut = ros(tmp_path / "run.mcap").read_bytes(), tmp_path / "cut.mcap"
    for length in range(0, len(whole), 7):
        cut.write_bytes(whole[:length])
        with pytest.raises(ValueError, match=r"^cut\.mcap "):
            mcap_table(cut)
    with pytest.raises(ValueError, match=r"^part\.mcap .*: the pose at 0\.25 s has no orientation or rotation"):
        mcap_table(foxglove(tmp_path / "part.mcap", "/base", parts=("position",)))


def test_without_the_extra_its_command_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "mcap.reader", None)
    with pytest.raises(ExtraMissing, match=r"pip install 'gaplab\[mcap\]'"):
        mcap_table(ros(tmp_path / "run.mcap"))
