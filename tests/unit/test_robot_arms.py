"""Imports of arms, and of files that say little: keyframes, links without mass, gains, motors without limits."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gaplab.schemas.plugin import PluginRef
from gaplab.services.core.errors import InvalidRobot
from gaplab.services.engines import engines
from gaplab.services.robots.importing import import_robot
from gaplab.services.robots.options import ImportOptions
from gaplab.services.world.controllers import controllers
from gaplab.services.world.robot_files import RobotFile
from gaplab.services.world.tasks import tasks
from gaplab.services.world.world import Motor, PDMotor

mujoco = pytest.importorskip("mujoco")

ARM = """<mujoco><compiler angle="radian"/><worldbody>
<body name="base" pos="0 0 .5">{base}
<body name="upper" pos="0 0 .1"><joint name="shoulder" axis="0 0 1" range="-2 2"/>
<geom type="capsule" size=".03" fromto="0 0 0 .3 0 0" mass="2"/>
<body name="lower" pos=".3 0 0"><joint axis="0 1 0" range="-2 2" ref=".1"/>
<geom type="capsule" size=".02" fromto="0 0 0 .2 0 0" mass="1"/>
<body name="finger" pos=".2 0 0"><joint name="finger" type="slide" axis="0 1 0" range="0 .04"/>{finger}
</body></body></body></body></worldbody>{more}</mujoco>"""
"""An arm of two links and a finger; its middle joint has no name."""

BOX = '<geom type="box" size=".1 .1 .1" mass="3"/>'
TIP = '<geom size=".01" mass=".1"/>'
DRIVE = '<actuator><position name="p" joint="shoulder" kp="50" kv="2" forcerange="-9 9"/>{}</actuator>'


def arm(tmp_path: Path, more: str = "", *, base: str = BOX, finger: str = TIP, **options: Any) -> RobotFile:
    file = tmp_path / "arm.xml"
    drive = "" if "<actuator>" in more else DRIVE.format("")
    file.write_text(ARM.format(base=base, finger=finger, more=drive + more))
    return import_robot(file, ImportOptions(**options)).robot


KEYS = '<keyframe><key name="home" qpos=".5 -.7 .02"/><key name="away" qpos="1 1.5 .01"/></keyframe>'


def starts(robot: RobotFile) -> list[float]:
    return [joint.start for joint in robot.world.joints]


def test_a_keyframe_of_a_fixed_base_has_the_angles_of_the_joints(tmp_path: Path) -> None:
    """MuJoCo pads keyframes at their end, when the import makes the base free."""
    home, away = arm(tmp_path, KEYS), arm(tmp_path, KEYS, keyframe="away")
    plain = arm(tmp_path)

    assert starts(home) == [0.5, -0.7, 0.02]
    assert starts(away) == [1.0, 1.5, 0.01]
    assert starts(plain) == [0.0, 0.1, 0.0]
    for robot in (home, away):
        assert (robot.world.start_height_m, robot.world.start_turn) == (0.5, (0, 0, 0, 1))


def test_a_keyframe_of_a_free_base_has_its_pose(tmp_path: Path) -> None:
    key = '<keyframe><key qpos="0 0 9 0 0 0 2 .5 -.7 .02"/></keyframe>'

    world = arm(tmp_path, key, base=f"<freejoint/>{BOX}").world

    assert world.start_turn == (0, 0, 1, 0)
    assert [joint.start for joint in world.joints] == [0.5, -0.7, 0.02]


GRIP = DRIVE.format('<position name="grip" joint="finger" kp="5" forcerange="-1 1"/>')


@pytest.mark.parametrize("drives", ["", GRIP])
def test_a_locked_joint_leaves_the_keyframes_of_the_others(tmp_path: Path, drives: str) -> None:
    controls = 'ctrl=".5 .02"' if drives else ""
    fixed_key = f'<keyframe><key qpos=".5 -.7 .02" {controls}/></keyframe>'

    fixed = arm(tmp_path, drives + fixed_key, lock=("finger",))

    assert starts(fixed) == [0.5, -0.7]


def test_a_locked_joint_of_a_free_robot_leaves_the_keyframes_of_the_others(tmp_path: Path) -> None:
    key = '<keyframe><key qpos="0 0 9 0 0 0 2 .5 -.7 .02" ctrl=".5 .02"/></keyframe>'

    robot = arm(tmp_path, GRIP + key, base=f"<freejoint/>{BOX}", lock=("shoulder",))

    assert starts(robot) == [-0.7, 0.02]
    assert robot.world.start_turn == (0, 0, 1, 0)


def test_sensors_of_a_locked_joint_and_of_its_actuator_are_lost(tmp_path: Path) -> None:
    more = '<sensor><jointpos joint="finger"/><actuatorpos actuator="grip"/></sensor>'

    robot = arm(tmp_path, GRIP + more, lock=("finger",))

    assert "2 sensors are lost" in robot.lost
    assert len(robot.world.joints) == 2


def test_init_qpos_of_a_fixed_base_is_the_start(tmp_path: Path) -> None:
    assert starts(arm(tmp_path, '<custom><numeric name="init_qpos" data=".5 -.7 .02"/></custom>')) == [0.5, -0.7, 0.02]


def test_keyframes_are_read_where_masses_are_to_be_mended(tmp_path: Path) -> None:
    robot = arm(tmp_path, KEYS, finger='<site name="tool"/>', mend=True)

    assert starts(robot) == [0.5, -0.7, 0.02]
    assert robot.world.bodies[-1].mass_kg == 0.001


@pytest.mark.parametrize("base", ["", '<geom type="box" size=".1 .1 .1" mass="0"/>', '<geom size=".1" density="0"/>'])
def test_a_base_without_mass_that_never_moves_is_no_reason_to_refuse(tmp_path: Path, base: str) -> None:
    robot = arm(tmp_path, base=base)

    assert robot.world.fixed
    assert robot.world.bodies[0].mass_kg == 1.0
    assert "base has no mass or no inertia, but never moves: it gets 1 kg m²" in robot.lost


URDF = """<robot name="arm"><link name="base">{base}</link><link name="link"><inertial><origin xyz="0 0 .2"/>
<mass value="1"/><inertia ixx=".1" ixy="0" ixz="0" iyy=".1" iyz="0" izz=".1"/></inertial></link><link name="tool"/>
<joint name="hinge" type="revolute"><parent link="base"/><child link="link"/><axis xyz="0 1 0"/>
<limit effort="7" velocity="3" lower="-1" upper="2"/></joint>
<joint name="wrist" type="{kind}"><parent link="link"/><child link="tool"/><axis xyz="0 0 1"/>
<limit effort="1" velocity="3" lower="-1" upper="2"/></joint></robot>"""
VISUAL = "<visual><geometry><box size='1 1 1'/></geometry></visual>"
COLLISION = "<collision><geometry><box size='.1 .1 .1'/></geometry></collision>"


def urdf(tmp_path: Path, *, base: str = "", kind: str = "fixed", **options: Any) -> RobotFile:
    (tmp_path / "arm.urdf").write_text(URDF.format(base=base, kind=kind))
    return import_robot(tmp_path / "arm.urdf", ImportOptions(**options)).robot


@pytest.mark.parametrize("base", ["", VISUAL, COLLISION])
@pytest.mark.parametrize("visuals", [False, True])
def test_a_root_link_without_inertial_is_no_reason_with_fixed(tmp_path: Path, base: str, visuals: bool) -> None:
    robot = urdf(tmp_path, base=base, fixed=True, visuals=visuals)

    assert [body.mass_kg for body in robot.world.bodies] == [1.0, 1.0]
    with pytest.raises(InvalidRobot, match=r"base moves, but has mass 0 kg .*; --mend replaces it"):
        urdf(tmp_path, base=base)


def test_a_moving_link_without_inertial_is_mended_or_refused_by_name(tmp_path: Path) -> None:
    robot = urdf(tmp_path, base=COLLISION, kind="revolute", mend=True)

    tool = robot.world.bodies[-1]
    assert (tool.mass_kg, tool.center_m) == (0.001, (0, 0, 0))
    assert tool.inertia.moments_kg_m2 == pytest.approx([9e-7] * 3)
    assert any(line.startswith("tool: mass 0 kg, inertia 0: mended to 0.001 kg") for line in robot.lost)
    with pytest.raises(InvalidRobot, match=r"tool moves, but has mass 0 kg .*; --mend replaces it"):
        urdf(tmp_path, base=COLLISION, kind="revolute")


def test_a_moving_body_without_a_name_is_mended_and_one_that_carries_mass_is_not(tmp_path: Path) -> None:
    nameless = "</body><body><joint name='extra'/><site name='end'/>"
    carrying = "<body name='tip'><geom size='.01' mass='.1'/></body>"

    mended = arm(tmp_path, finger=f"{TIP}{nameless}", mend=True)
    whole = arm(tmp_path, finger=carrying)

    assert (mended.world.bodies[-1].name, mended.world.bodies[-1].mass_kg) == ("body5", 0.001)
    assert whole.world.bodies[-1].mass_kg == pytest.approx(0.1)


def test_masses_that_mujoco_bounds_by_itself_need_no_mending(tmp_path: Path) -> None:
    robot = arm(tmp_path, '<compiler boundmass=".2" boundinertia=".001"/>', finger='<site name="tool"/>')

    assert robot.world.bodies[-1].mass_kg == 0.2


def test_gains_of_a_fixed_arm_are_those_on_its_fixed_base(tmp_path: Path) -> None:
    """MuJoCo alone tells the inertias: that of its own fixed model of the same file."""
    options: dict[str, Any] = {"motor": "position", "max_torque": 7.0}
    fixed, free = arm(tmp_path, **options), arm(tmp_path, base=f"<freejoint/>{BOX}", **options)
    model = mujoco.MjModel.from_xml_string(ARM.format(base=BOX, finger=TIP, more=""))
    floating = mujoco.MjModel.from_xml_string(ARM.format(base=f"<freejoint/>{BOX}", finger=TIP, more=""))

    for robot, inverse in ((fixed, model.dof_invweight0), (free, floating.dof_invweight0[6:])):
        for joint, each in zip(robot.world.joints, inverse, strict=True):
            assert isinstance(joint.motor, PDMotor)
            assert joint.motor.kd / (2 * np.sqrt(joint.motor.kp / each)) == pytest.approx(0.7, rel=1e-9)
    assert fixed.world.joints[0].motor != free.world.joints[0].motor


@pytest.mark.parametrize("gear", [1, 100])
def test_a_torque_motor_without_limit_gets_a_torque_of_the_robots_weight(tmp_path: Path, gear: float) -> None:
    robot = arm(tmp_path, f'<actuator><motor name="m" joint="shoulder" gear="{gear}"/></actuator>')
    joint = robot.world.joints[0]
    assert isinstance(joint.motor, PDMotor)
    urdfs = arm(tmp_path, motor="torque", motored="shoulder").world.joints[0]

    assert joint.motor.max_torque_nm == urdfs.motor.max_torque_nm
    assert joint.swing == joint.motor.max_torque_nm / 2
    assert any(line.startswith("actuator m has no largest torque: 1") and "weight" in line for line in robot.lost)


def test_a_robot_with_torque_motors_without_limits_can_be_simulated(tmp_path: Path) -> None:
    world = arm(tmp_path, '<actuator><motor joint="shoulder" gear="100"/></actuator>').world
    controller, task = controllers.create(PluginRef(name="sine")), tasks.create(PluginRef(name="reach"))
    controller.prepare(world, task.observe_s)

    genomes = controller.space.draw(5, np.random.default_rng(0))
    found = engines["mujoco"]().rollouts([world], [controller.motion(genome) for genome in genomes])

    assert np.isfinite(task.fitness(found)).all()


VELOCITY = '<actuator><velocity joint="shoulder" kv="3" gear="2"/></actuator>'
TORQUE = '<actuator><motor joint="shoulder" ctrlrange="-1 1"/></actuator>'


def test_gains_of_the_options_replace_those_of_the_actuators(tmp_path: Path) -> None:
    def motor(more: str = "", **options: Any) -> PDMotor | Motor | None:
        return arm(tmp_path, more, **options).world.joints[0].motor

    assert motor() == PDMotor("position", 9.0, 50.0, 2.0)
    assert motor(kp=60.0) == PDMotor("position", 9.0, 60.0, 2.0)
    assert motor(kd=4.0, max_torque=5.0) == PDMotor("position", 5.0, 50.0, 4.0)
    boundless = '<actuator><position joint="shoulder" kp="50" gear="2"/></actuator>'
    assert motor(boundless, kp=60.0) == PDMotor("position", 240.0, 60.0, 0.0)
    assert motor(VELOCITY, kd=4.0) == PDMotor("velocity", 320.0, kd=4.0)


@pytest.mark.parametrize(
    ("more", "options", "reason"),
    [
        ("", {"position_gain": 0.2}, "position_gain=0.2 has no effect on position motors: leave it out"),
        (VELOCITY, {"kp": 60}, "kp=60 has no effect on velocity motors"),
        (TORQUE, {"kp": 60}, "kp=60 has no effect on torque motors"),
        (TORQUE, {"kd": 2}, "kd=2 has no effect on torque motors"),
        ("", {"motor": "servo", "kp": 60}, "kp=60 has no effect on servo motors"),
        ("", {"motor": "torque", "kd": 2}, "kd=2 has no effect on torque motors"),
        ("", {"motor": "velocity", "position_gain": 0.2}, "position_gain=0.2 has no effect on velocity motors"),
    ],
)
def test_an_option_that_no_motor_uses_is_refused(
    tmp_path: Path, more: str, options: dict[str, Any], reason: str
) -> None:
    with pytest.raises(InvalidRobot, match=reason):
        arm(tmp_path, more, **options)


def test_compensation_of_gravity_and_coefficients_that_a_world_has_not_are_said(tmp_path: Path) -> None:
    plain = ARM.replace('name="finger" pos', 'name="finger" gravcomp="1" pos')
    joint = '<joint name="finger" damping="1 2" stiffness="0 3" actuatorgravcomp="true"'
    file = tmp_path / "arm.xml"
    drive = DRIVE.format('<motor name="m" joint="finger" damping="0 1" ctrlrange="-1 1"/>')
    file.write_text(plain.replace('<joint name="finger"', joint).format(base=BOX, finger=TIP, more=drive))

    lost = import_robot(file, ImportOptions()).robot.lost

    assert "springs of joints are lost: finger" in lost
    assert "compensation of gravity (gravcomp) is lost: finger" in lost
    assert "compensation of gravity by motors (actuatorgravcomp) is lost: finger" in lost
    assert "damping is linear; its other coefficients are lost: finger" in lost
    assert "damping of actuators is lost: m" in lost
    assert not [line for line in arm(tmp_path).lost if "gravity" in line or "damping" in line or "springs" in line]
