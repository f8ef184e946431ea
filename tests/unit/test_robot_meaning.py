"""What a robot file means, as ROS and MuJoCo read it: nothing is guessed unasked, and nothing is dropped in silence."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gaplab.services.core.errors import InvalidRobot
from gaplab.services.robots.importing import ImportedFile, import_robot
from gaplab.services.robots.options import ImportOptions

INERTIA = '<inertia ixx=".01" iyy=".01" izz=".01" ixy="0" ixz="0" iyz="0"/>'
SHAPE = '<collision><geometry><box size=".2 .1 .05"/></geometry></collision>'
BASE = f'<link name="base"><inertial><mass value="1"/>{INERTIA}</inertial>{SHAPE}</link>'
LEG = f'<link name="leg"><inertial><mass value="1"/>{INERTIA}</inertial>{SHAPE}</link>'
LIMIT = '<limit lower="-1" upper="1" effort="5" velocity="3"/>'
HIP = f'<joint name="hip" type="revolute"><parent link="base"/><child link="leg"/><axis xyz="0 1 0"/>{LIMIT}</joint>'
URDF = f'<?xml version="1.0"?>\n<robot name="small">\n{BASE}\n{LEG}\n{HIP}\n</robot>\n'
BARE = {f'<inertial><mass value="1"/>{INERTIA}</inertial>{SHAPE}': SHAPE}
FLOATING = '<link name="scene"/><joint name="float" type="floating"><parent link="scene"/><child link="base"/></joint>'

MJCF = """<mujoco model="small">{more}<worldbody><geom type="plane" size="9 9 .1"/><body name="base" pos="0 0 1">
<joint type="free" name="root" damping="{damping}"/><geom type="box" size=".1 .05 .02" mass="2"/><body name="leg">
<joint name="hip" axis="0 1 0" range="-60 60"/><geom name="foot" type="sphere" size=".05" mass="1" friction=".4"
priority="{priority}"/></body></body></worldbody><actuator><position joint="hip" kp="20" forcerange="-5 5"/></actuator>
</mujoco>"""


def imported(folder: Path, text: str = URDF, **changes: Any) -> ImportedFile:
    """A small robot whose text was changed."""
    options = changes.pop("options", {})
    for before, after in changes.pop("edits", {}).items():
        assert before in text
        text = text.replace(before, after)
    file = folder / "small.urdf"
    file.write_bytes(text.encode(changes.pop("encoding", "utf-8")))
    return import_robot(file, ImportOptions(**options))


def masses(found: ImportedFile) -> dict[str, tuple[float, float]]:
    """In the file and imported, by body."""
    return {row.body: (row.before_kg, round(row.after_kg, 6)) for row in found.masses}


def test_a_link_without_inertial_has_no_mass_unless_it_is_mended(tmp_path: Path) -> None:
    with pytest.raises(InvalidRobot, match=r"base moves, but has mass 0 kg .*; leg moves, but has mass 0 kg"):
        imported(tmp_path, edits=BARE)

    assert masses(imported(tmp_path, edits=BARE, options={"mend": True})) == {"base": (0, 1), "leg": (0, 1)}


def test_a_base_may_have_its_mass_in_a_link_that_is_fixed_to_it(tmp_path: Path) -> None:
    body = f'<link name="body"><inertial><mass value="10"/>{INERTIA}</inertial></link><joint name="of_it" type="fixed">'
    edits = {BASE: f'<link name="base">{SHAPE}</link>{body}<parent link="base"/><child link="body"/></joint>'}

    found = imported(tmp_path, edits=edits)

    assert masses(found) == {"base": (10, 10), "leg": (1, 1)}
    assert "without <inertial>, so without a mass of their own: base" in found.robot.lost


@pytest.mark.parametrize(
    ("inertial", "kg"), [('<mass value="0"/>' + INERTIA.replace(".01", "0"), (0, 1)),
                         ('<mass value="2"/>' + INERTIA.replace('izz=".01"', 'izz="0"'), (2, 2))],
)  # fmt: skip
def test_what_is_offered_to_be_mended_is(tmp_path: Path, inertial: str, kg: tuple[float, float]) -> None:
    edits = {BASE: BASE.replace(f'<mass value="1"/>{INERTIA}', inertial)}
    with pytest.raises(InvalidRobot, match="--mend replaces it"):
        imported(tmp_path, edits=edits)

    assert masses(imported(tmp_path, edits=edits, options={"mend": True}))["base"] == kg


@pytest.mark.parametrize(
    ("given", "limits"),
    [('upper="1.5"', (0.0, 1.5)), ('lower="-1.5"', (-1.5, 0.0)), ('lower="-1" upper="2"', (-1.0, 2.0))],
)
def test_a_missing_limit_is_0(tmp_path: Path, given: str, limits: tuple[float, float]) -> None:
    found = imported(tmp_path, edits={'lower="-1" upper="1"': given}).robot

    assert found.world.joints[0].limits == limits
    assert any("which is then 0: hip" in line for line in found.lost) == (0.0 in limits)


def test_the_root_says_whether_the_base_moves(tmp_path: Path) -> None:
    fixed = FLOATING.replace("scene", "world").replace("floating", "fixed")
    worlds = [imported(tmp_path, edits={BASE: BASE + more}).robot.world for more in ("", FLOATING, fixed)]

    assert not [line for line in imported(tmp_path, edits={BASE: BASE + fixed}).robot.lost if "<inertial>" in line]
    assert [(world.fixed, world.bodies[0].name, len(world.joints)) for world in worlds[:2]] == [(False, "base", 1)] * 2
    assert (worlds[2].fixed, len(worlds[2].joints)) == (True, 1)


@pytest.mark.parametrize(
    "macro", ['<xacro:if xmlns:xacro="http://www.ros.org/wiki/xacro" value="1"/>', '<xacro:if value="1"/>',
              '<link name="${side}_toe"/>'],
)  # fmt: skip
def test_macros_that_were_not_expanded_are_refused_by_that_word(tmp_path: Path, macro: str) -> None:
    with pytest.raises(InvalidRobot, match="line 6: the file is xacro"):
        imported(tmp_path, edits={"</robot>": f"{macro}</robot>"})


def test_a_comment_may_have_dashes(tmp_path: Path) -> None:
    assert imported(tmp_path, edits={LEG: f"<!--- a -- b --- c --->{LEG}"}).robot.world.joints


def test_a_prefix_need_not_be_declared(tmp_path: Path) -> None:
    found = imported(tmp_path, edits={"</robot>": "<gazebo><sensor:camera/></gazebo></robot>"}).robot

    assert "extensions for Gazebo are lost" in found.lost
    with pytest.raises(InvalidRobot):
        imported(tmp_path, edits={"</robot>": "<a:b></robot>"})


@pytest.mark.parametrize("encoding", ["utf-16", "utf-8-sig", "latin-1"])
def test_every_usual_encoding_is_read(tmp_path: Path, encoding: str) -> None:
    assert imported(tmp_path, encoding=encoding, edits={"small": "smäll"}).robot.world.bodies[0].name == "base"


def test_an_incomplete_inertial_is_named_by_its_line_and_link(tmp_path: Path) -> None:
    with pytest.raises(InvalidRobot, match="line 4: link leg: no <inertia>"):
        imported(tmp_path, edits={LEG: LEG.replace(INERTIA, "")})


def test_an_error_of_mujoco_has_the_line_of_the_file(tmp_path: Path) -> None:
    seen = '<visual>\n<geometry>\n<box size="1 1 1"/>\n</geometry></visual></link>'
    with pytest.raises(InvalidRobot, match="line 7"):
        imported(tmp_path, edits={BASE: BASE.replace("</link>", seen), LEG: LEG.replace("box size", "tube size")})


def test_a_robot_without_joints_is_thrown_and_refused_if_it_is_fixed(tmp_path: Path) -> None:
    file = tmp_path / "still.xml"
    file.write_text('<mujoco><worldbody><body><freejoint/><geom size=".1"/></body></worldbody></mujoco>')

    found = import_robot(file, ImportOptions()).robot

    assert (found.usual_controller.name, found.usual_task.name) == ("recorded", "recorded")
    with pytest.raises(InvalidRobot, match="no joint of the file moves"):
        import_robot(file, ImportOptions(fixed=True))


def test_numbers_that_no_robot_has_are_told_and_taken(tmp_path: Path) -> None:
    found = imported(tmp_path, edits={LIMIT: '<limit lower="-90" upper="90" effort="1000" velocity="3"/>'}).robot

    told = [line for line in found.lost if "not as degrees" in line or "robot's weight needs" in line]
    assert [line.rpartition(": ")[2] for line in told] == ["hip", "hip"]
    (hip,) = found.world.joints
    assert (hip.limits, hip.motor.max_torque_nm) == ((-90.0, 90.0), 1000.0)
    assert not [line for line in imported(tmp_path).robot.lost if "not as" in line or "weight" in line]
    far = imported(tmp_path, edits={'<axis xyz="0 1 0"/>': '<axis xyz="0 1 0"/><origin xyz="300 0 0"/>'}).robot
    assert any("lengths up to 300 m are taken as they are, not as millimetres" in line for line in far.lost)


@pytest.mark.parametrize("beside", [True, False])
def test_a_mesh_is_that_of_its_own_package(tmp_path: Path, *, beside: bool) -> None:
    for package, size in (("arm", 0.3), ("gripper", 0.1))[: 1 + beside]:
        (tmp_path / package / "meshes").mkdir(parents=True)
        (tmp_path / package / "package.xml").write_text(f"<package><name>{package}</name></package>")
        corners = [(x * size, y * size, z * size) for x in (0, 1) for y in (0, 1) for z in (0, 1)]
        faces = ("1 2 4 3", "5 7 8 6", "1 5 6 2", "3 4 8 7", "1 3 7 5", "2 6 8 4")
        lines = [*(f"v {x} {y} {z}" for x, y, z in corners), *(f"f {face}" for face in faces)]
        (tmp_path / package / "meshes" / "tool.obj").write_text("\n".join(lines))
    (tmp_path / "arm" / "urdf").mkdir()
    mesh = SHAPE.replace('<box size=".2 .1 .05"/>', '<mesh filename="package://gripper/meshes/tool.obj"/>')
    edits = {LEG: LEG.replace(SHAPE, mesh)}

    if not beside:
        with pytest.raises(InvalidRobot, match=r"gripper/meshes/tool\.obj' was not found"):
            imported(tmp_path / "arm" / "urdf", edits=edits)
        return
    _, leg = imported(tmp_path / "arm" / "urdf", edits=edits).robot.world.bodies
    assert np.ptp(np.array(leg.parts[0].shape.points_m), axis=0) == pytest.approx(0.1)  # type: ignore[union-attr]


@pytest.mark.parametrize(
    ("more", "damping", "priority", "friction", "gravity", "told"),
    [
        ("", 0, 0, 1.0, 9.81, ""),
        ('<option><flag gravity="disable"/></option>', 0, 0, 1.0, 0.0, ""),
        ('<option><flag frictionloss="disable"/></option>', 0, 0, 1.0, 9.81, "flags that disable a part of MuJoCo are"
         " lost: frictionloss"),
        ("", 5, 0, 1.0, 9.81, "damping 5 of the base's free joint is lost"),
        ("", 0, 1, 0.4, 9.81, ""),
        ("", 0, -1, 1.0, 9.81, ""),
    ],
)  # fmt: skip
def test_an_mjcf_is_as_mujoco_simulates_it_or_what_is_lost_is_told(
    tmp_path: Path, *, more: str, damping: float, priority: int, friction: float, gravity: float, told: str
) -> None:
    found = imported(tmp_path, MJCF.format(more=more, damping=damping, priority=priority)).robot
    plain = imported(tmp_path, MJCF.format(more="", damping=0, priority=0)).robot

    surfaces = dict(found.world.surfaces)
    leg = found.world.bodies[1]
    assert surfaces.get(leg.surface, found.world.material).static_friction == friction
    assert found.world.gravity_m_s2 == gravity
    assert [line for line in found.lost if line not in plain.lost] == [told] * bool(told)
