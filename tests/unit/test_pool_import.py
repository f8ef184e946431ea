"""Tables and folders of recordings become pools, checked at the door line by line."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gaplab.api.library import pools
from gaplab.api.library.pools import PoolOptions, import_pool
from gaplab.services.core.errors import InvalidSpec
from gaplab.services.world.pools import Pool
from tests.drawn_arm import imported

pytest.importorskip("mujoco")

HEADER = (
    "motion,time_s,command_shoulder,command_elbow,position_shoulder,position_elbow,velocity_shoulder,velocity_elbow"
)
OPTIONS = PoolOptions(recording="motion", every_s=0.1)
CONFIRMED = replace(OPTIONS, confirmed=True)


def row(motion: str, tick: int) -> str:
    angle = 0.3 * np.sin(tick / 10)
    numbers = [100 + tick * 0.02, 0.1 if tick < 10 else 0.3, -0.2, angle, -angle, 0.5, -0.5]
    return ",".join([motion, *(f"{each:.6f}" for each in numbers)])


LINES = [HEADER, *(row("wave", tick) for tick in range(51)), *(row("nod", tick) for tick in range(26))]


@pytest.fixture
def read(tmp_path: Path) -> Callable[..., Pool]:
    arm = imported(tmp_path)

    def imported_from(lines: list[str], options: PoolOptions = OPTIONS) -> Pool:
        table = tmp_path / "motions.csv"
        table.write_text("\n".join(lines) + "\n", encoding="utf-8")
        return import_pool(table, str(arm), "motions", options)

    return imported_from


def test_a_table_becomes_recordings_with_their_starts_commands_and_readings(read: Callable[..., Pool]) -> None:
    pool = read(LINES)

    wave, nod = pool.recordings
    assert (wave.name, nod.name) == ("wave", "nod")
    assert pool.times_s == tuple(round(0.1 * k, 6) for k in range(1, 11))
    assert [each.name for each in pool.sensors] == ["angle shoulder", "angle elbow"]
    assert (wave.start.angles_rad, wave.start.speeds_rad_s) == ((0.0, 0.0), (0.5, -0.5))
    assert wave.times_s == (0.0, 0.2)  # commands are stored where they change
    assert wave.commands == ((0.1, -0.2), (0.3, -0.2))
    assert wave.readings[0] == pytest.approx((0.143828, -0.143828), abs=1e-6)
    assert len(nod.readings) == 5  # it is shorter
    assert Pool.read(pool.text) == pool


def test_a_gap_is_told_and_nothing_is_read_in_it(read: Callable[..., Pool]) -> None:
    pool = read([line for number, line in enumerate(LINES) if not 10 <= number < 25], CONFIRMED)

    assert pool.lost == ("wave: nothing for 0.32 s after 0.16 s",)
    assert pool.recordings[0].readings[2] == (None, None)
    assert None not in pool.recordings[0].readings[0]


def changed(place: int, old: str, new: str) -> list[str]:
    return [*LINES[:place], LINES[place].replace(old, new), *LINES[place + 1 :]]


def with_angles(lines: list[str], angle: Callable[[int], str]) -> list[str]:
    """The table with other angles of the shoulder."""
    rows = [each.split(",") for each in lines[1:]]
    return [lines[0], *(",".join([*cells[:4], angle(k), *cells[5:]]) for k, cells in enumerate(rows))]


COLUMN = "line 1: the trace needs one column each of angle elbow"
NAN = "line 61, command_elbow: 'nan' is not a finite number"
BEYOND = "line 21: 2.5 is outside the limits of shoulder, -1.6 to 1.6"
MORE = [f"{HEADER},angle wrist", *(f"{each},0" for each in LINES[1:])]


def in_degrees(line: str) -> str:
    motion, time_s, *numbers = line.split(",")
    return ",".join([motion, time_s, *(str(float(np.rad2deg(float(each)))) for each in numbers)])


WRONG: dict[str, tuple[list[str], str]] = {
    "a column too few": ([line.rsplit(",", 3)[0] for line in LINES], COLUMN),
    "a clock that runs backwards": (changed(6, "100.100000", "99.000000"), "line 7: time_s must ascend"),
    "nan": (changed(7, "-0.200000", "nan"), "line 8, command_elbow: 'nan' is not a finite number"),
    "nan in a later recording": (changed(60, "-0.200000", "nan"), NAN),
    "a joint that the robot lacks": (MORE, "no joint 'wrist'"),
    "degrees for radians": (with_angles(LINES, lambda k: "5.73" if k % 51 < 10 else "17.19"), "is it `[deg]`?"),
    "degrees of angles and of commands": ([HEADER, *map(in_degrees, LINES[1:])], "is it `[deg]`?"),
    "outside limits": (with_angles(LINES, lambda k: "2.5" if k == 19 else "0"), BEYOND),
    "two motions of one name": ([*LINES, row("wave", 0), row("wave", 1)], "two motions are named wave"),
    "shorter than a time step": ([*LINES, row("tap", 0), row("tap", 0).replace("100.00", "100.001")], "a time step"),
    "shorter than the interval": ([*LINES, row("tap", 0), row("tap", 2)], "it lasts 0.04 s"),
    "one line": ([*LINES, row("tap", 0)], "at least 2 are needed"),
    "a recording without a name": (
        [*LINES, *(row("", tick) for tick in range(26))],
        "line 79: the name of a recording",
    ),
    "a header alone": ([HEADER], "motions.csv has no recording"),
    "no column of recordings": ([line.partition(",")[2] for line in LINES], "no column 'motion' names the recordings"),
}


@pytest.mark.parametrize("case", WRONG)
def test_what_is_wrong_is_told_with_its_line(case: str, read: Callable[..., Pool]) -> None:
    lines, words = WRONG[case]

    with pytest.raises(InvalidSpec) as refused:
        read(lines)

    assert words in str(refused.value)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"every_s": -1.0}, "/every_s: must be a number above 0, not -1"),
        ({"seconds": float("nan")}, "/seconds: must be a number above 0, not nan"),
        ({"noises": {"angle": 0}}, "/noises/angle: must be a number above 0, not 0"),
        ({"noises": {"speed": "fast"}}, "/noises/speed: must be a number above 0, not fast"),
        ({"noises": {"angles": 0.1}}, "unknown 'angles'; permitted: place, direction, angle, speed, torque"),
        ({"sensors": ("angle", "torque")}, "no column says the torque; there are columns of angle, speed"),
        ({"sensors": ("base", "angles")}, "unknown 'angles'; permitted: base, place, direction, angle, speed, torque"),
    ],
)
def test_options_that_cannot_be_are_refused(options: Any, words: str, read: Callable[..., Pool]) -> None:
    with pytest.raises(InvalidSpec, match=words):
        read(LINES, replace(OPTIONS, **options))


def test_a_recording_shorter_than_the_interval_of_the_first_is_refused(read: Callable[..., Pool]) -> None:
    short = [row("tap", 0), row("tap", 0).replace("100.00", "100.01")]

    with pytest.raises(InvalidSpec, match=r"/tap: it lasts 0.01 s, and the interval of readings, 0.02 s, is longer"):
        read([*LINES, *short], replace(OPTIONS, every_s=None))


def test_what_no_file_may_be_is_refused_in_the_words_of_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    arm, table, empty = imported(tmp_path), tmp_path / "motions.csv", tmp_path / "empty"
    table.write_text("\n".join(LINES), encoding="utf-8")
    empty.mkdir()

    with pytest.raises(InvalidSpec, match=r'/name: name must match .* not "My Pool"'):
        import_pool(table, str(arm), "My Pool", OPTIONS)
    with pytest.raises(InvalidSpec, match="empty has no recording: it needs a CSV or MCAP file for each"):
        import_pool(empty, str(arm), "empty", OPTIONS)
    monkeypatch.setattr(Pool, "most_bytes", 500)
    with pytest.raises(InvalidSpec, match=r"the pool has .* bytes, but at most 500 are permitted"):
        import_pool(table, str(arm), "motions", OPTIONS)


def test_of_many_gaps_the_first_are_told(read: Callable[..., Pool], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pools, "MOST_LOSSES", 2)
    gaps = {*range(5, 12), *range(15, 22), *range(25, 32)}

    pool = read([line for number, line in enumerate(LINES) if number not in gaps], CONFIRMED)

    assert pool.lost == ("wave: nothing for 0.16 s after 0.06 s", "and 2 more")


def test_a_joint_without_a_column_of_torque_has_no_sensor_of_it(read: Callable[..., Pool]) -> None:
    lines = [f"{HEADER},effort_elbow", *(f"{each},0.1" for each in LINES[1:])]

    pool = read(lines, replace(OPTIONS, sensors=("angle", "torque")))

    assert [each.name for each in pool.sensors] == ["angle shoulder", "angle elbow", "torque elbow"]


def test_a_wrong_recording_may_be_left_out_and_is_told(read: Callable[..., Pool]) -> None:
    pool = read(WRONG["nan"][0], replace(OPTIONS, skip=True))

    assert [each.name for each in pool.recordings] == ["nod"]
    assert "wave is left out: line 8, command_elbow" in pool.lost[0]


def test_a_folder_has_a_file_for_each_recording(tmp_path: Path) -> None:
    arm, folder = imported(tmp_path), tmp_path / "runs"
    folder.mkdir()
    for name, lines in (("a", LINES[1:52]), ("b", LINES[52:])):
        text = "\n".join(line.partition(",")[2] for line in [HEADER, *lines])
        (folder / f"{name}.csv").write_text(text, encoding="utf-8")

    pool = import_pool(folder, str(arm), "runs", PoolOptions(every_s=0.1))

    assert [each.name for each in pool.recordings] == ["a", "b"]
    assert pool.actuators == ("shoulder", "elbow")


def test_a_file_with_other_columns_than_the_first_is_refused(tmp_path: Path) -> None:
    arm, folder = imported(tmp_path), tmp_path / "runs"
    folder.mkdir()
    for name, last in (("a", 8), ("b", 6)):
        text = "\n".join(",".join(line.split(",")[1:last]) for line in LINES[:52])
        (folder / f"{name}.csv").write_text(text, encoding="utf-8")

    with pytest.raises(InvalidSpec, match="its columns are not those of a: speed elbow, speed shoulder"):
        import_pool(folder, str(arm), "runs", PoolOptions(every_s=0.1))


def cube_of(folder: Path) -> str:
    cube = folder / "cube.urdf"
    inertia = '<inertia ixx="1e-3" ixy="0" ixz="0" iyy="1e-3" iyz="0" izz="1e-3"/>'
    cube.write_text(
        f'<robot name="cube"><link name="cube"><inertial><mass value="0.37"/>{inertia}</inertial>'
        '<collision><geometry><box size=".1 .1 .1"/></geometry></collision></link></robot>'
    )
    return str(cube)


POSE = "toss,time_s,x_m,y_m,z_m,qx,qy,qz,qw"
VELOCITIES = {
    "vx,vy,vz": "1,0,0.5",
    "vx [m/s],vy [m/s],vz [m/s]": "1,0,0.5",
    "vx [mm/s],vy (cm/s),vz_m_s": "1000,0,0.5",
    "vx_mm_s,vy_mm_s,vz_mm_s": "1000,0,500",
}
NO_VELOCITIES = {
    "vx,vz": ("1,0.5", "/3: vy has no column, beside others of vx, vy, vz"),
    "vx,vy,vz": ("nan,0,0.5", "/3: line 2, vx: 'nan' is not a finite number"),
    "vx [km/h],vy,vz": ("1,0,0.5", "/3: vx: the unit 'km/h' is not known; permitted: m/s, cm/s, mm/s"),
    "wx [deg/s],wy,wz [m/s]": ("1,0,0.5", "/3: wz: the unit 'm/s' is not known; permitted: rad/s, deg/s, °/s"),
}
TOSS = PoolOptions(recording="toss", every_s=0.1)


def tossed(folder: Path, header: str, cells: str) -> Path:
    table = folder / "tosses.csv"
    table.write_text("\n".join([f"{POSE},{header}", *(f"3,{k * 0.01},0,0,0.3,0,0,0,1,{cells}" for k in range(21))]))
    return table


@pytest.mark.parametrize("header", VELOCITIES)
def test_velocities_are_read_in_their_units(header: str, tmp_path: Path) -> None:
    pool = import_pool(tossed(tmp_path, header, VELOCITIES[header]), cube_of(tmp_path), "tosses", TOSS)

    assert pool.recordings[0].start.velocity_m_s == (1.0, 0.0, 0.5)
    assert pool.recordings[0].start.turning_rad_s is None


@pytest.mark.parametrize("header", NO_VELOCITIES)
def test_a_velocity_that_is_incomplete_is_refused(header: str, tmp_path: Path) -> None:
    cells, words = NO_VELOCITIES[header]

    with pytest.raises(InvalidSpec) as refused:
        import_pool(tossed(tmp_path, header, cells), cube_of(tmp_path), "tosses", TOSS)

    assert str(refused.value) == words


def test_what_a_table_says_of_a_base_that_never_moves_is_not_read(read: Callable[..., Pool]) -> None:
    header = "x [mm],y,z,qx,qy,qz,qw,vx [km/h],vz"

    pool = read([f"{HEADER},{header}", *(f"{each},0,0,0,0,0,0,1,nan,3" for each in LINES[1:])])

    assert pool == read(LINES)


def test_a_thrown_body_begins_moving_and_its_directions_are_read(tmp_path: Path) -> None:
    cube = cube_of(tmp_path)
    table = tmp_path / "tosses.csv"
    names = "toss,time_s,x_m,y_m,z_m,qw,qx,qy,qz,vx_m_s,vy_m_s,vz_m_s,wx_rad_s,wy_rad_s,wz_rad_s"
    half = 0.5**0.5
    rows = [f"3,{k * 0.01},{k * 0.01},0,0.3,{half},0,0,{half},1,0,0.5,0,0,2" for k in range(21)]
    table.write_text("\n".join([names, *rows]))

    pool = import_pool(table, cube, "tosses", PoolOptions(recording="toss", every_s=0.1, noises={"place": 0.001}))

    (toss,) = pool.recordings
    assert (toss.start.position_m, toss.start.velocity_m_s) == ((0.0, 0.0, 0.3), (1.0, 0.0, 0.5))
    assert toss.start.turning_rad_s == (0.0, 0.0, 2.0)
    assert toss.readings[0] == pytest.approx((0.1, 0, 0.3, 0, 1, 0, -1, 0, 0), abs=1e-6)  # a quarter turn about z
    assert [each.noise for each in pool.sensors[:4]] == [0.001, 0.001, 0.001, 0.02]
    places = import_pool(table, cube, "tosses", PoolOptions(recording="toss", every_s=0.1, sensors=["place"]))
    assert [each.name for each in places.sensors] == ["x", "y", "z"]
