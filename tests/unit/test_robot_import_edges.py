"""Imports at the edges: long names, rounded angles, contacts without friction, broken meshes, masses of the file."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gaplab.services.core.errors import InvalidRobot
from gaplab.services.robots.importing import ImportedFile, import_robot
from gaplab.services.robots.options import ImportOptions, Notes
from gaplab.services.world.robot_files import LONGEST_LINE

mujoco = pytest.importorskip("mujoco")

HUMANOID_NAMES = [f"left_hand_middle_{at:02d}_joint" for at in range(43)]
INERTIAL = "<inertial><mass value='1'/><inertia ixx='.1' iyy='.1' izz='.1' ixy='0' ixz='0' iyz='0'/></inertial>"


def humanoid(tmp_path: Path, file: str = "long.urdf", names: list[str] = HUMANOID_NAMES) -> ImportedFile:
    links = [f"<link name='{name}'>{INERTIAL}</link>" for name in ["base", *(f"l{at}" for at in range(len(names)))]]
    joints = [
        f"<joint name='{name}' type='revolute'><parent link='base'/><child link='l{at}'/><axis xyz='0 0 1'/>"
        "<limit lower='-1' upper='1' effort='10' velocity='5'/></joint>"
        for at, name in enumerate(names)
    ]
    (tmp_path / file).write_text(f"<robot name='g1'>{''.join(links + joints)}</robot>")
    return import_robot(tmp_path / file, ImportOptions(fixed=True))


def test_a_line_of_what_is_lost_has_as_many_names_as_a_robot_file_permits(tmp_path: Path) -> None:
    (line,) = [line for line in humanoid(tmp_path).robot.lost if line.startswith("each joint gets a motor")]
    names = line.partition(": ")[2].partition(" and ")[0].split(", ")

    assert names == HUMANOID_NAMES[: len(names)]
    assert line.endswith(f" and {len(HUMANOID_NAMES) - len(names)} more")
    assert len(line) <= LONGEST_LINE < len(line) + len(HUMANOID_NAMES[0]) + 2


def test_short_names_are_listed_up_to_forty_and_a_single_long_one_is_cut() -> None:
    notes = Notes()
    notes.lose("short: {}", *(f"j{at}" for at in range(50)))
    notes.lose("long: {}", "j" * 2 * LONGEST_LINE)

    short, long = notes.lost

    assert short == f"short: {', '.join(f'j{at}' for at in range(40))} and 10 more"
    assert long == f"long: {'j' * (LONGEST_LINE - 7)}…"


def test_a_file_that_no_robot_file_can_name_is_refused_without_a_traceback(tmp_path: Path) -> None:
    with pytest.raises(InvalidRobot, match="file must have at most 200 characters"):
        humanoid(tmp_path, f"{'n' * 210}.urdf", ["knee"])


LEG = """<mujoco><worldbody>{ground}<body name="base" pos="0 0 .3"><freejoint/><geom size=".1" mass="2" friction=".4"
 condim="{condim}"/><body name="leg" pos=".1 0 0"><joint name="knee" axis="0 1 0" range="-90 90"/>{leg}</body></body>
</worldbody><actuator><position joint="knee" kp="50" forcerange="-9 9"/></actuator>{more}</mujoco>"""
"""A ball with a leg."""

TIP = '<geom size=".02" mass=".1"/>'


def legged(tmp_path: Path, more: str = "", **options: Any) -> ImportedFile:
    ground, condim, leg = options.pop("ground", ""), options.pop("condim", 3), options.pop("leg", TIP)
    text = LEG.format(ground=ground, condim=condim, leg=leg, more=more)
    (tmp_path / "leg.xml").write_text(text)
    return import_robot(tmp_path / "leg.xml", ImportOptions(**options))


@pytest.mark.parametrize(("angle", "limit"), [(1.5708, np.pi / 2), (-1.5708, -np.pi / 2)])
def test_an_angle_that_is_rounded_at_a_limit_starts_at_the_limit(tmp_path: Path, angle: float, limit: float) -> None:
    key = f'<keyframe><key qpos="0 0 .3 1 0 0 0 {angle}"/></keyframe>'

    of_the_file, of_the_user = legged(tmp_path, key).robot, legged(tmp_path, start={"knee": angle}).robot

    assert of_the_file.world.joints[0].start == of_the_user.world.joints[0].start == pytest.approx(limit, abs=1e-12)
    assert not [line for line in of_the_file.lost if line.startswith("starts at")]
    with pytest.raises(InvalidRobot, match=r"knee cannot start at 1\.571: its limits are -1\.5708 to 1\.5708"):
        legged(tmp_path, start={"knee": 1.571})


@pytest.mark.parametrize("condim", [1, 3])
@pytest.mark.parametrize("ground", [None, 1, 3])
def test_friction_is_that_of_mujocos_contact(tmp_path: Path, condim: int, ground: int | None) -> None:
    plane = "" if ground is None else f'<geom type="plane" size="1 1 1" friction=".2" condim="{ground}"/>'
    world = legged(tmp_path, ground=plane, condim=condim, leg='<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>')
    floor = plane or f'<geom type="plane" size="1 1 1" friction="0" condim="{condim}"/>'
    model = mujoco.MjModel.from_xml_string(LEG.format(ground=floor, condim=condim, leg=TIP, more=""))
    data = mujoco.MjData(model)
    data.qpos[2] = 0.09
    mujoco.mj_forward(model, data)
    contact = data.contact[0]

    expected = contact.friction[0] if contact.dim > 1 else 0.0
    assert world.robot.world.material.static_friction == pytest.approx(expected)


POINTER = "version https://git-lfs.github.com/spec/v1\noid sha256:abc\nsize 123\n"
EMPTY = """<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1"><asset>
<unit name="meter" meter="1"/></asset><library_visual_scenes><visual_scene id="s"/></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene></COLLADA>"""


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (POINTER, r"foot\.dae is not a DAE that can be read: DaeMalformedError: .*line 1"),
        (EMPTY, r"foot\.dae has 0 faces, but 1 to 200000 are permitted$"),
    ],
)
def test_a_broken_dae_is_refused_by_its_name(tmp_path: Path, text: str, reason: str) -> None:
    pytest.importorskip("trimesh")
    pytest.importorskip("collada")
    (tmp_path / "foot.dae").write_text(text)
    mesh = "<collision><geometry><mesh filename='foot.dae'/></geometry></collision>"
    (tmp_path / "r.urdf").write_text(f"<robot name='r'><link name='base'>{INERTIAL}{mesh}</link></robot>")

    with pytest.raises(InvalidRobot, match=reason):
        import_robot(tmp_path / "r.urdf", ImportOptions())


def test_masses_of_an_mjcf_are_those_before_the_import_mends_them(tmp_path: Path) -> None:
    massless = '<inertial mass="0.0001" pos="0 0 0" diaginertia="0 0 0"/>'

    mended = legged(tmp_path, leg=massless, mend=True)
    (tmp_path / "held.xml").write_text((tmp_path / "leg.xml").read_text().replace('mass="2"', 'density="0"'))
    held = import_robot(tmp_path / "held.xml", ImportOptions(mend=True, fixed=True))

    assert [(row.before_kg, row.after_kg) for row in mended.masses] == [(2.0, 2.0), (0.0001, 0.001)]
    assert [(row.before_kg, row.after_kg) for row in held.masses] == [(0.0, 1.0), (0.0001, 0.001)]
    assert "leg: 0.0001 kg in the file, 0.001 kg imported" in mended.robot.lost


def test_a_locked_joint_of_an_mjcf_stays_at_its_reference_as_the_help_says(tmp_path: Path) -> None:
    finger = f'{TIP}<body name="f" pos="0 0 .2"><joint name="grip" type="slide" axis="0 0 1" ref=".04"/>{TIP}</body>'

    parts = legged(tmp_path, leg=finger, lock=("grip",)).robot.world.bodies[1].parts

    assert parts[-1].center_m == pytest.approx((0, 0, 0.2))
    assert "at zero in a URDF, at `ref` in an MJCF" in str(ImportOptions.__doc__)
