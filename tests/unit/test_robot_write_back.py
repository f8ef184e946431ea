"""Tuned values in URDF, MJCF and robot files: written, imported again and compared."""

import xml.etree.ElementTree as ET
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gaplab.schemas.plugin import PluginRef
from gaplab.services.core.errors import InvalidRobot
from gaplab.services.engines.base import Engine
from gaplab.services.robots.comparing import changes, check_rollouts
from gaplab.services.robots.importing import import_robot
from gaplab.services.robots.options import ImportOptions
from gaplab.services.robots.writing import Tuning, WrittenFile, write_json, write_plain, write_xml
from gaplab.services.world.motions import Trajectory
from gaplab.services.world.robot_files import RobotFile
from gaplab.services.world.tunables.labels import tunable_of
from gaplab.services.world.world import Body, Inertia, Joint, World
from tests.robot_texts import MJCF
from tests.unit.test_robot_import import FILES, path_of

mujoco = pytest.importorskip("mujoco")
COMMENTS = ("Tuned by gaplab: experiment abc.", "mass = 5 kg, 95 % interval 4 to 6 -- roughly")


def fine(_: World) -> None:
    """Accept every world."""


def with_body(world: World, name: str, **changed: Any) -> World:
    return replace(world, bodies=tuple(replace(b, **changed) if b.name == name else b for b in world.bodies))


def with_joint(world: World, name: str, *, motor: dict[str, Any] | None = None, **changed: Any) -> World:
    def edited(joint: Joint) -> Joint:
        driven = replace(joint.motor, **motor) if motor else joint.motor
        return replace(joint, motor=driven, **changed)

    return replace(world, joints=tuple(edited(each) if each.name == name else each for each in world.joints))


def heavier(world: World, name: str, factor: float) -> World:
    body = next(each for each in world.bodies if each.name == name)
    x, y, z = (factor * each for each in body.inertia.moments_kg_m2)
    return with_body(world, name, mass_kg=factor * body.mass_kg, inertia=Inertia((x, y, z), body.inertia.turn))


def body_of(world: World, name: str) -> Body:
    return next(each for each in world.bodies if each.name == name)


def moved(world: World, name: str, by: Sequence[float]) -> World:
    x, y, z = np.array(body_of(world, name).center_m) + by
    return with_body(world, name, center_m=(x, y, z))


RELEASE = [pytest.param(name, marks=pytest.mark.release) for name in ("laikago", "mini_cheetah")]


@pytest.fixture(params=["a1", "franka_panda", *RELEASE])
def urdf(request: pytest.FixtureRequest) -> tuple[RobotFile, Path]:
    file, options = FILES[request.param]
    return import_robot(path_of(file), ImportOptions(**options)).robot, path_of(file)


def test_a_urdf_has_masses_centres_damping_friction_and_efforts(urdf: tuple[RobotFile, Path], tmp_path: Path) -> None:
    """A body with fixed links too: the toe of a leg, the hand of an arm."""
    robot, original = urdf
    last, joint = robot.world.bodies[-1].name, robot.world.joints[-1].name
    tuned = moved(heavier(robot.world, last, 1.3), last, [0.01, -0.02, 0.005])
    tuned = with_joint(tuned, joint, damping=0.7, dry_friction=0.2, motor={"max_torque_nm": 11.0})
    output = tmp_path / "tuned.urdf"

    written = write_xml(Tuning(robot, tuned, COMMENTS), original, output, fine)
    again = import_robot(output, ImportOptions.model_validate(robot.source.options)).robot.world

    assert {change.place[2] for change in written.changes} == {
        *("mass_kg", "inertia", "center_m", "damping", "dry_friction", "motor.max_torque_nm")
    }
    assert not written.left_out
    assert body_of(again, last).mass_kg == pytest.approx(1.3 * body_of(robot.world, last).mass_kg, rel=1e-12)
    assert body_of(again, last).center_m == pytest.approx(body_of(tuned, last).center_m, abs=1e-9)
    assert not changes(tuned, written.world)
    assert again.bodies[0] == robot.world.bodies[0]
    assert again.joints[-1].motor.max_torque_nm == 11.0
    assert COMMENTS[0] in output.read_text()
    assert "4 to 6 — roughly" in output.read_text()  # two hyphens would end a comment of XML
    assert [each.name for each in tmp_path.iterdir()] == ["tuned.urdf"]


def test_a_urdf_keeps_everything_else_of_its_text(tmp_path: Path) -> None:
    original = path_of("quadruped/minitaur.urdf")
    robot = import_robot(original, ImportOptions()).robot
    tuned = with_joint(robot.world, "motor_front_leftL_joint", damping=0.25)

    write_xml(Tuning(robot, tuned, COMMENTS), original, tmp_path / "tuned.urdf", fine)
    text = (tmp_path / "tuned.urdf").read_text()

    assert "Copyright (c) 2017, Erwin Coumans" in text
    assert text.count("<link") == original.read_text().count("<link")
    assert text.count("<visual") == original.read_text().count("<visual")
    assert 'damping="0.25"' in text


def test_a_urdf_keeps_its_namespaces_its_ends_of_lines_and_what_is_after_its_root(tmp_path: Path) -> None:
    text = path_of("a1/a1.urdf").read_text().replace("<robot ", '<robot xmlns:other="http://other.example" ', 1)
    text = f"<!-- first -->\n<!DOCTYPE robot>\n{text[text.index('<robot ') :].rstrip()}\n<!-- last -->\n"
    original = tmp_path / "crlf.urdf"
    original.write_bytes(text.replace("\n", "\r\n").encode())
    robot = import_robot(original, ImportOptions()).robot
    tuned = with_joint(robot.world, "FR_hip_joint", damping=0.25)

    write_xml(Tuning(robot, tuned, ()), original, tmp_path / "tuned.urdf", fine)
    written = (tmp_path / "tuned.urdf").read_bytes()

    assert b'xmlns:other="http://other.example"' in written
    assert written.startswith(b"<!-- first -->\r\n<!DOCTYPE robot>\r\n<robot")
    assert written.endswith(b"</robot>\r\n<!-- last -->\r\n")
    assert written.count(b"\n") == written.count(b"\r\n")
    changed = set(written.decode().split()) ^ set(text.split())
    assert 'damping="0.25"' in changed
    assert len(changed) < 6


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"armature": 0.01}, "FR_hip_joint: armature 0 → 0.01: the URDF has no place for it"),
        ({"motor": {"kp": 30.0}}, "FR_hip_joint: motor.kp 57.1429 → 30: the URDF has no place for it"),
        ({"motor": {"delay_s": 0.01}}, "FR_hip_joint: motor.delay_s 0 → 0.01: the URDF has no place for it"),
    ],
)
def test_what_a_urdf_has_no_place_for_is_refused_or_left_out_as_a_comment(
    change: dict[str, Any], message: str, tmp_path: Path
) -> None:
    original, output = path_of("a1/a1.urdf"), tmp_path / "tuned.urdf"
    robot = import_robot(original, ImportOptions()).robot
    tuned = with_joint(robot.world, "FR_hip_joint", damping=0.4, **change)
    with pytest.raises(InvalidRobot, match=message):
        write_xml(Tuning(robot, tuned, COMMENTS), original, output, fine)
    assert not list(tmp_path.iterdir())

    written = write_xml(Tuning(robot, tuned, COMMENTS, partial=True), original, output, fine)

    assert [str(each) for each in written.left_out] == [message.partition(": the URDF")[0]]
    assert f"not in this file: {written.left_out[0]}" in output.read_text()
    assert import_robot(output, ImportOptions()).robot.world.joints[0].damping == 0.4
    assert not changes(tuned, written.world)


def test_friction_and_slope_have_no_place_in_a_urdf(tmp_path: Path) -> None:
    original = path_of("a1/a1.urdf")
    robot = import_robot(original, ImportOptions()).robot
    world = replace(robot.world, slope_rad=0.1, material=replace(robot.world.material, static_friction=0.5))

    with pytest.raises(InvalidRobot, match=r"material.static_friction 1 → 0.5.*slope_rad 0 → 0.1.*--partial"):
        write_xml(Tuning(robot, world, ()), original, tmp_path / "tuned.urdf", fine)


def test_an_mjcf_whose_inertia_is_of_its_shapes_has_stated_ones_after(tmp_path: Path) -> None:
    original, output = path_of("ant.xml"), tmp_path / "tuned.xml"
    robot = import_robot(original, ImportOptions()).robot
    tuned = moved(heavier(robot.world, "aux_2", 1.5), "torso", [0.02, 0.0, -0.01])
    tuned = with_joint(tuned, "hip_2", armature=0.3, damping=0.6, limits=(-0.4, 0.45), motor={"max_torque_nm": 90.0})
    tuned = tunable_of("friction").edit(replace(tuned, time_step_s=0.005, gravity_m_s2=9.7), 0.6)

    written = write_xml(Tuning(robot, tuned, COMMENTS), original, output, fine)
    model = mujoco.MjModel.from_xml_path(str(output))

    assert model.body("aux_2").mass[0] == pytest.approx(1.5 * body_of(robot.world, "aux_2").mass_kg, rel=1e-9)
    assert model.joint("hip_2").armature[0] == 0.3
    assert model.joint("hip_2").range == pytest.approx([-0.4, 0.45], rel=1e-12)
    assert model.opt.timestep == 0.005
    assert model.opt.gravity[2] == -9.7
    assert model.geom("left_leg_geom").friction[0] == 0.6
    assert not changes(tuned, written.world)
    assert "motor.max_torque_nm" in {each.place[2] for each in written.changes}


def small(folder: Path) -> tuple[RobotFile, Path]:
    (folder / "parts").mkdir()
    text = MJCF.format("")
    start, end = text.index("<actuator>"), text.index("</mujoco>")
    (folder / "parts" / "motors.xml").write_text(f"<mujoco>{text[start:end]}</mujoco>")
    (folder / "m.xml").write_text(f'{text[:start]}<include file="parts/motors.xml"/></mujoco>')
    return import_robot(folder / "m.xml", ImportOptions(static_friction=1.0, lock=("jc",))).robot, folder / "m.xml"


def test_gains_of_an_mjcf_that_includes_files_keep_their_gears(tmp_path: Path) -> None:
    robot, original = small(tmp_path)
    tuned = with_joint(robot.world, "ja", motor={"kp": 300.0, "kd": 9.0, "max_torque_nm": 6.0}, dry_friction=0.3)
    tuned = heavier(with_joint(tuned, "jb", motor={"kd": 4.0}), "b", 0.5)
    output = tmp_path / "elsewhere"
    output.mkdir()

    written = write_xml(Tuning(robot, tuned, COMMENTS), original, output / "tuned.xml", fine)
    model = mujoco.MjModel.from_xml_path(str(output / "tuned.xml"))

    assert model.actuator("pa").gainprm[0] == pytest.approx(300 / 9)
    assert model.actuator("pa").forcerange.tolist() == [-2, 2]
    assert model.actuator("vb").gainprm[0] == 4
    assert not changes(tuned, written.world)


def test_a_file_has_no_place_for_clocks_encoders_the_frame_of_the_sensors_and_joints_that_stick(tmp_path: Path) -> None:
    original = path_of("a1/a1.urdf")
    robot = import_robot(original, ImportOptions()).robot
    sticking = with_joint(robot.world, "FR_hip_joint", static_friction=0.2, stribeck_speed=0.3)
    clocks = replace(sticking, time_offset_s=0.02, biases=(("angle FR_hip_joint", 0.03),))
    tuning = Tuning(robot, replace(clocks, ground_m=0.005, gravity_tilt_rad=(0.0, 0.01)), ())
    of_mujoco = {"gravity_tilt_rad", "ground_m"}

    for form, kept, suffix in (("URDF", set[str](), ".urdf"), ("MJCF of MuJoCo alone", of_mujoco, ".xml")):
        output = tmp_path / f"tuned{suffix}"
        with pytest.raises(InvalidRobot) as refused:
            write_xml(tuning, original, output, fine) if suffix == ".urdf" else write_plain(tuning, output)
        lost = [each for each in refused.value.reasons if f"the {form} has no place for it" in each]
        names = {"time_offset_s", "biases", "static_friction", "stribeck_speed"} | (of_mujoco - kept)
        assert {name for name in names if any(name in each for each in lost)} == names
        assert len(lost) == len(names)
    write_json(tuning, tmp_path / "tuned.json", fine)
    assert not changes(tuning.world, RobotFile.read((tmp_path / "tuned.json").read_bytes()).world)


def test_an_inertia_that_does_not_grow_with_the_mass_is_possible_for_a_single_body(tmp_path: Path) -> None:
    original = path_of("a1/a1.urdf")
    robot = import_robot(original, ImportOptions()).robot
    alone, fused = with_body(robot.world, "FR_upper", mass_kg=2.0), with_body(robot.world, "FR_lower", mass_kg=2.0)

    written = write_xml(Tuning(robot, alone, ()), original, tmp_path / "alone.urdf", fine)

    assert not changes(alone, written.world)
    with pytest.raises(InvalidRobot, match=r"FR_lower: mass_kg 0.226 → 2: the URDF has no place"):
        write_xml(Tuning(robot, fused, ()), original, tmp_path / "fused.urdf", fine)


def test_another_file_and_another_suffix_are_refused(tmp_path: Path) -> None:
    robot, original = small(tmp_path)
    tuning = Tuning(robot, robot.world, ())
    with pytest.raises(InvalidRobot, match=r"tuned.urdf must end in .xml"):
        write_xml(tuning, original, tmp_path / "tuned.urdf", fine)
    original.write_text(original.read_text() + "\n")
    with pytest.raises(InvalidRobot, match="is not the file that m was imported from, or has changed since"):
        write_xml(tuning, original, tmp_path / "tuned.xml", fine)


def test_the_original_is_not_overwritten(tmp_path: Path) -> None:
    robot, original = small(tmp_path)
    before = original.read_bytes()

    with pytest.raises(InvalidRobot, match="is the original, which a later import or write-back needs"):
        write_xml(Tuning(robot, robot.world, ()), original, original, fine)

    assert original.read_bytes() == before


def test_a_file_in_latin_1_with_a_robot_in_its_first_comment_is_written_back(tmp_path: Path) -> None:
    text = path_of("a1/a1.urdf").read_text().replace("<robot ", "<!-- before <robot>: für alle -->\n<robot ", 1)
    original = tmp_path / "latin.urdf"
    original.write_bytes(text.encode("latin-1"))
    robot = import_robot(original, ImportOptions()).robot
    tuned = with_joint(robot.world, "FR_hip_joint", damping=0.25)

    write_xml(Tuning(robot, tuned, COMMENTS), original, tmp_path / "tuned.urdf", fine)

    assert "<!-- before <robot>: für alle -->" in (tmp_path / "tuned.urdf").read_text(encoding="utf-8")
    assert 'damping="0.25"' in (tmp_path / "tuned.urdf").read_text(encoding="utf-8")


def test_a_robot_file_holds_all_and_its_intervals(tmp_path: Path) -> None:
    robot, _ = small(tmp_path)
    assert robot.sha256  # of the file before; the tuned one has its own
    tuned = with_joint(robot.world, "ja", armature=0.5, motor={"delay_s": 0.02})
    tuned = replace(tuned, slope_rad=0.1).edited("slope", slope_rad=0.2)

    written = write_json(Tuning(robot, tuned, COMMENTS), tmp_path / "tuned.json", fine)
    again = RobotFile.read((tmp_path / "tuned.json").read_bytes())

    assert again.world == tuned == written.world
    assert again.name == f"{robot.name}_tuned"
    assert again.comments == COMMENTS
    assert again.sha256 != robot.sha256
    assert len(written.changes) == 3


class Sliding(Engine):
    """An engine whose base moves by the mass of the first body, in the direction of the first targets."""

    honours = frozenset()

    @classmethod
    def runs(cls, world: World) -> bool:
        return True

    def rollout(self, world: World, motion: Any) -> Trajectory:
        path = np.outer(motion.observe_s, motion.targets[0, :3]) * world.bodies[0].mass_kg
        return Trajectory(motion.observe_s, path, np.zeros((len(path), 4)))

    def record(self, world: World, motion: Any, times_s: Any) -> Any:
        raise NotImplementedError


PULSES, WALK = PluginRef(name="square_pulses"), PluginRef(name="walk")


def test_rollouts_tell_worlds_apart() -> None:
    world = import_robot(path_of("a1/a1.urdf"), ImportOptions()).robot.world
    nearly = heavier(world, "trunk", 1 + 1e-12)

    assert check_rollouts(world, world, Sliding(), PULSES, WALK) == 0.0
    assert 0 < check_rollouts(world, nearly, Sliding(), PULSES, WALK) < 1e-9
    with pytest.raises(InvalidRobot, match=r"up to .* m from those in the tuned one; permitted: at most 1e-06 m"):
        check_rollouts(world, heavier(world, "trunk", 1.01), Sliding(), PULSES, WALK)


def test_a_file_whose_rollouts_differ_is_not_written(tmp_path: Path) -> None:
    robot, original = small(tmp_path)

    def refuse(_: World) -> None:
        raise InvalidRobot(["rollouts differ"])

    def write(output: str) -> WrittenFile:
        tuning = Tuning(robot, with_joint(robot.world, "ja", damping=0.9), ())
        if output.endswith("json"):
            return write_json(tuning, tmp_path / output, refuse)
        return write_xml(tuning, original, tmp_path / output, refuse)

    before = set(tmp_path.iterdir())
    for output in ("tuned.xml", "tuned.json"):
        with pytest.raises(InvalidRobot, match="rollouts differ"):
            write(output)
    assert set(tmp_path.iterdir()) == before


def test_a_file_that_declares_another_encoding_declares_the_one_that_it_is_written_in(tmp_path: Path) -> None:
    text = path_of("quadruped/minitaur.urdf").read_text().replace("motor_front_leftL_joint", "Größe")
    text = f"<?xml version='1.0' encoding='ISO-8859-1' ?>\n{text[text.index('<robot') :]}"
    original, output = tmp_path / "latin.urdf", tmp_path / "tuned.urdf"
    original.write_bytes(text.encode("latin-1"))
    robot = import_robot(original, ImportOptions()).robot

    write_xml(Tuning(robot, with_joint(robot.world, "Größe", damping=0.25), COMMENTS), original, output, fine)

    joints = [joint.get("name") for joint in ET.parse(output).getroot().iter("joint")]
    assert "Größe" in joints
    assert output.read_bytes().startswith(b"<?xml version='1.0' encoding='UTF-8' ?>\n<robot")


@pytest.mark.parametrize(
    ("options", "change", "message"),
    [
        (
            {"max_torque": 33.0},
            {"max_torque_nm": 26.0},
            "motor.max_torque_nm 33 → 26: the import sets it with max_torque=33",
        ),
        ({"kp": 80.0}, {"kp": 64.0}, "motor.kp 80 → 64: the import sets it with kp=80"),
        ({"kd": 3.0}, {"kd": 2.5}, "motor.kd 3 → 2.5: the import sets it with kd=3"),
        ({"motor": "position", "kp": 60.0}, {"kd": 9.0}, "motor.kd .* → 9: the import sets it with motor=position"),
    ],
)
@pytest.mark.parametrize("suffix", [".urdf", ".xml"])
def test_what_an_option_of_the_import_sets_is_refused_or_left_out(
    tmp_path: Path, suffix: str, options: dict[str, Any], change: dict[str, float], message: str
) -> None:
    original, output, joint = tmp_path / f"m{suffix}", tmp_path / f"tuned{suffix}", "ja"
    original.write_text(MJCF.format(""))
    if suffix == ".urdf":
        original, joint = path_of("a1/a1.urdf"), "FR_hip_joint"
        message = message if "max_torque" in options else message.partition("the import")[0] + "the URDF has no place"
    robot = import_robot(original, ImportOptions(**options)).robot
    tuned = with_joint(robot.world, joint, damping=0.4, motor=change)

    with pytest.raises(InvalidRobot, match=message):
        write_xml(Tuning(robot, tuned, ()), original, output, fine)
    written = write_xml(Tuning(robot, tuned, (), partial=True), original, output, fine)

    assert [each.place[2] for each in written.changes] == ["damping"]
    assert f"not in this file: {written.left_out[0]}" in output.read_text()


def test_friction_and_a_time_step_that_options_set_are_left_out(tmp_path: Path) -> None:
    original = tmp_path / "m.xml"
    original.write_text(MJCF.format(""))
    robot = import_robot(original, ImportOptions(static_friction=0.9, time_step_s=0.005)).robot
    material = replace(robot.world.material, static_friction=0.5, dynamic_friction=0.5)
    tuned = replace(robot.world, material=material, time_step_s=0.002)

    with pytest.raises(InvalidRobot, match=r"0.9 → 0.5: the import sets it with static_friction=0.9; .*_s=0.005"):
        write_xml(Tuning(robot, tuned, ()), original, tmp_path / "tuned.xml", fine)
    assert not write_xml(Tuning(robot, tuned, (), partial=True), original, tmp_path / "tuned.xml", fine).changes


LIMITED = """<mujoco><compiler angle="radian"/><worldbody><body><freejoint/><geom size=".1"/>
<body><joint name="j" {joint}/><geom size=".1" mass="1"/></body></body></worldbody>
<actuator>{actuator}</actuator></mujoco>"""
"""A robot with a single hinge, what bears its torque, and its actuator."""

BORNE = 'actuatorfrcrange="-20 20"'
BOTH = '<motor joint="j" gear="30" ctrlrange="-1 1" forcerange="-.5 .5"/>'


@pytest.mark.parametrize("factor", [0.5, 1.5])
@pytest.mark.parametrize(
    ("joint", "actuator", "options"),
    [
        (BORNE, '<position joint="j" kp="50"/>', {}),
        (BORNE, '<position joint="j" kp="50" gear="2" forcerange="-15 15" ctrlrange="-1 1"/>', {}),
        ("", '<motor joint="j" gear="30" ctrlrange="-1 1"/>', {}),
        ("", BOTH, {}),
        (BORNE, BOTH, {}),
        ("", '<velocity joint="j" kv="3"/>', {}),
        (BORNE, BOTH, {"motor": "servo"}),
        ("", BOTH, {"motor": "torque"}),
    ],
)
def test_a_largest_torque_comes_back_whatever_limits_it(
    tmp_path: Path, joint: str, actuator: str, options: dict[str, Any], factor: float
) -> None:
    original, output = tmp_path / "m.xml", tmp_path / "tuned.xml"
    original.write_text(LIMITED.format(joint=joint, actuator=actuator))
    robot = import_robot(original, ImportOptions(**options)).robot
    torque = factor * robot.world.joints[0].motor.max_torque_nm

    write_xml(Tuning(robot, with_joint(robot.world, "j", motor={"max_torque_nm": torque}), ()), original, output, fine)

    again = import_robot(output, ImportOptions(**options)).robot.world.joints[0].motor
    assert again.max_torque_nm == pytest.approx(torque, rel=1e-12)
    limits = mujoco.MjModel.from_xml_path(str(output))
    assert (limits.actuator_ctrllimited[0], limits.actuator_forcelimited[0]) == (
        "ctrlrange" in actuator,
        "forcerange" in actuator or not (joint or "ctrlrange" in actuator or options),
    )
