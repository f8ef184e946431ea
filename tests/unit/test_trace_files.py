"""Recordings that are no CSV: data sets of LeRobot, and states of joints in MCAP."""

import json
import sys
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from mcap.writer import Writer

from gaplab import ExtraMissing
from gaplab.api.clients.trace_files import trace_csv
from gaplab.api.library.pools import PoolOptions, import_pool
from gaplab.services.core.errors import InvalidSpec
from tests.drawn_arm import imported

NAMES = ["shoulder_pan.pos", "gripper.pos"]


def data_set(folder: Path, *, version: str, names: Any = None) -> Path:
    """Two episodes of two and three frames, at 30 Hz; version 3 has them in one file, 2.1 in one each."""
    features = {name: {"names": names or NAMES} for name in ("observation.state", "action")}
    info = {"codebase_version": version, "fps": 30, "total_episodes": 2, "features": features}
    (folder / "meta").mkdir(parents=True)
    (folder / "meta" / "info.json").write_text(json.dumps(info))
    data = folder / "data" / "chunk-000"
    data.mkdir(parents=True)
    table = pa.table(
        {
            "observation.state": [[1.0, 50.0], [2.0, 51.0], [3.0, 52.0], [4.0, 53.0], [5.0, 54.0]],
            "action": [[1.5, 50.0]] * 5,
            "frame_index": [0, 1, 0, 1, 2],
            "episode_index": [0, 0, 1, 1, 1],
        }
    )
    if version == "v3.0":
        table = table.append_column("timestamp", pa.array([0.0, 0.25, 0.0, 0.25, 0.5], pa.float32()))
        pq.write_table(table, data / "file-000.parquet")
    else:
        for episode, rows in enumerate((table.slice(0, 2), table.slice(2))):
            pq.write_table(rows, data / f"episode_{episode:06d}.parquet")
    return folder


HEAD = "time_s,angle shoulder_pan,angle gripper,command shoulder_pan,command gripper"


def test_an_episode_of_a_lerobot_data_set_is_a_trace(tmp_path: Path) -> None:
    new, old = data_set(tmp_path / "new", version="v3.0"), data_set(tmp_path / "old", version="v2.1")

    assert trace_csv(new, episode=0).decode().splitlines() == [HEAD, "0.0,1.0,50.0,1.5,50.0", "0.25,2.0,51.0,1.5,50.0"]
    assert [line.split(",")[1] for line in trace_csv(old, episode=1).decode().splitlines()[1:]] == ["3.0", "4.0", "5.0"]
    (alone,) = (old / "data").rglob("*000001.parquet")
    assert trace_csv(alone) == trace_csv(old, episode=1)
    by_kind = data_set(tmp_path / "motors", version="v3.0", names={"motors": NAMES})
    text = trace_csv(by_kind, {"*": "[deg]", "gripper": "gripper [%]"}, episode=0).decode()
    assert text.splitlines()[0] == (
        "time_s,angle shoulder_pan [deg],angle gripper [%],command shoulder_pan [deg],command gripper [%]"
    )


def test_what_is_no_episode_of_a_data_set_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = data_set(tmp_path / "set", version="v3.0")
    with pytest.raises(ValueError, match="set has 2 episodes; permitted: 0 to 1"):
        trace_csv(folder)
    with pytest.raises(ValueError, match="set has no episode 7; permitted: 0 to 1"):
        trace_csv(folder, episode=7)
    with pytest.raises(ValueError, match=r"there is no meta/info\.json at or above it"):
        trace_csv(tmp_path)
    few = data_set(tmp_path / "few", version="v3.0", names=NAMES[:1])
    with pytest.raises(ValueError, match=r"observation\.state has 2 numbers, and its names are shoulder_pan"):
        trace_csv(few, episode=0)
    (folder / "meta" / "info.json").write_text("{}")
    with pytest.raises(ValueError, match=r"meta/info\.json of set lacks 'features'"):
        trace_csv(folder, episode=0)
    (tmp_path / "few" / "data" / "chunk-000" / "file-000.parquet").write_bytes(b"PAR1")
    with pytest.raises(ValueError, match=r"file-000\.parquet cannot be read"):
        trace_csv(few, episode=0)
    monkeypatch.setitem(sys.modules, "pyarrow.parquet", None)
    with pytest.raises(ExtraMissing, match=r"pip install 'gaplab\[lerobot\]'"):
        trace_csv(few, episode=0)


def states(file: Path, *topics: str) -> Path:
    with file.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        kind = writer.register_schema("sensor_msgs/msg/JointState", "jsonschema", b"{}")
        for topic in topics:
            channel = writer.register_channel(topic, "json", kind)
            for second, names in enumerate((["pan", "elbow"], ["elbow", "pan"])):
                stamp = {"sec": second, "nanosec": 500_000_000}
                body = {"header": {"stamp": stamp}, "name": names, "position": [1.0, 2.0], "effort": []}
                if topic == "/all":
                    body |= {"velocity": [3.0, 4.0], "effort": [5.0, 6.0]}
                writer.add_message(channel, log_time=1, data=json.dumps(body).encode(), publish_time=0)
        writer.finish()
    return file


def test_states_of_joints_are_a_trace_whatever_their_order(tmp_path: Path) -> None:
    file = states(tmp_path / "run.mcap", "/joints")

    assert trace_csv(file).decode().splitlines() == ["time_s,angle pan,angle elbow", "0.5,1.0,2.0", "1.5,2.0,1.0"]
    both = states(tmp_path / "both.mcap", "/joints", "/all")
    with pytest.raises(ValueError, match="several topics of joints; permitted: /all, /joints"):
        trace_csv(both)
    head = trace_csv(both, topic="/all").decode().splitlines()[0]
    assert head == "time_s,angle pan,angle elbow,speed pan,speed elbow,torque pan,torque elbow"


@pytest.mark.parametrize(("version", "every_s", "last"), [("v2.1", 0.03, [4.8, 53.8]), ("v3.0", 0.25, [5.0, 54.0])])
def test_episodes_of_a_lerobot_data_set_are_the_recordings_of_a_pool(
    tmp_path: Path, version: str, every_s: float, last: list[float]
) -> None:
    arm = imported(tmp_path, shoulder="shoulder_pan", elbow="gripper")
    folder = data_set(tmp_path / "set", version=version)

    pool = import_pool(folder, str(arm), "episodes", PoolOptions(columns={"*": "[deg]"}, every_s=every_s))

    first, second = pool.recordings
    assert (first.name, second.name) == ("episode 0", "episode 1")
    assert pool.actuators == pool.joints == ("shoulder_pan", "gripper")
    assert (len(first.readings), len(second.readings)) == (1, 2)
    assert second.start.angles_rad == pytest.approx(np.deg2rad([3.0, 52.0]), abs=1e-6)
    assert second.commands == (pytest.approx(np.deg2rad([1.5, 50.0]), abs=1e-6),)
    assert second.readings[1] == pytest.approx(np.deg2rad(last), abs=1e-6)


def test_files_of_mcap_in_a_folder_are_the_recordings_of_a_pool(tmp_path: Path) -> None:
    arm, folder = imported(tmp_path, shoulder="pan"), tmp_path / "runs"
    folder.mkdir()
    for name in ("b", "a"):
        states(folder / f"{name}.mcap", "/joints")

    pool = import_pool(folder, str(arm), "runs", PoolOptions(confirmed=True))

    assert [each.name for each in pool.recordings] == ["a", "b"]
    assert (pool.joints, pool.actuators) == (("pan", "elbow"), ())
    assert pool.recordings[0].start.angles_rad == (1.0, 2.0)
    assert pool.recordings[0].readings == ((2.0, 1.0),)


def test_a_plain_table_in_parquet_is_a_pool_whose_errors_have_lines_as_in_csv(tmp_path: Path) -> None:
    arm, file = imported(tmp_path), tmp_path / "runs.parquet"
    columns = {"recording": [3, 3, 4, 4], "time_s": [0.0, 0.1, 0.0, 0.1], "shoulder": [0.0, 0.1, 0.2, 0.3]}
    pq.write_table(pa.table(columns | {"elbow": [0.0, 0.1, 0.2, None]}), file)

    with pytest.raises(InvalidSpec, match="/4: line 5, elbow: '' is not a finite number"):
        import_pool(file, str(arm), "runs")
    for cell, said in ((datetime(2024, 1, 1, tzinfo=UTC), "'2024-01-01 00:00:00"), ([0.0, 0.1], r"'\[0.0, 0.1\]")):
        pq.write_table(pa.table(columns | {"elbow": [cell] * 4}), tmp_path / "odd.parquet")
        with pytest.raises(InvalidSpec, match=f"/3: line 2, elbow: {said}.* is not a finite number"):
            import_pool(tmp_path / "odd.parquet", str(arm), "runs")

    (tmp_path / "odd.parquet").write_bytes(b"PAR1")
    with pytest.raises(ValueError, match=r"odd\.parquet cannot be read"):
        import_pool(tmp_path / "odd.parquet", str(arm), "runs")

    pool = import_pool(file, str(arm), "runs", PoolOptions(skip=True))
    assert [each.name for each in pool.recordings] == ["3"]
