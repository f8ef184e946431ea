"""Imported robots against MuJoCo's own compiled model of the same file: masses, inertia and forward kinematics."""

from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError
from scipy.spatial.transform import Rotation

from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.errors import InvalidRobot
from gaplab.services.robots.bodies import simplify
from gaplab.services.robots.importing import ImportedFile, import_robot
from gaplab.services.robots.options import ImportOptions
from gaplab.services.world.robot_files import RobotFile
from gaplab.services.world.world import Box, Capsule, Hull, Joint, Motor, PDMotor, World, pd_law, pd_torque
from tests import real_robots
from tests.real_robots import FILES, for_each
from tests.robot_texts import MJCF

mujoco = pytest.importorskip("mujoco")
pybullet = pytest.mark.skipif(find_spec("pybullet_data") is None, reason="PyBullet is not installed")

MASSES_KG = {  # the sums of the masses in the files
    "a1": 12.458,
    "laikago": 25.567,
    "minitaur": 6.0,
    "aliengo": 20.638,
    "mini_cheetah": 8.852,
    "vision60": 26.9,
    "kuka_iiwa": 17.5,
    "franka_panda": 17.96,
}


def path_of(name: str) -> Path:
    try:
        return real_robots.path_of(name)
    except ModuleNotFoundError as error:
        pytest.skip(f"{error.name} is not installed")


@cache
def imported(name: str) -> ImportedFile:
    file, options = FILES[name]
    return import_robot(path_of(file), ImportOptions(**options))


def reference(name: str) -> Any:
    """Return MuJoCo's model of the file, with a free base and with the static bodies that MuJoCo fuses by itself."""
    file = path_of(FILES[name][0])
    text = file.read_text().replace("package://", f"{file.parent}/")
    spec = mujoco.MjSpec.from_file(str(file)) if file.suffix == ".xml" else mujoco.MjSpec.from_string(text, assets=None)
    spec.meshdir = str(file.parent)
    spec.compiler.fusestatic = True
    for joint in [each for each in spec.joints if each.name.startswith("panda_finger")]:
        spec.delete(joint)
    for equality in list(spec.equalities):
        spec.delete(equality)
    root = spec.worldbody.bodies[0]
    if not root.joints:
        root.add_freejoint()
    for body in spec.bodies[1:]:
        empty = not np.any(np.nan_to_num(body.fullinertia)) and not np.any(body.inertia)
        if body.explicitinertial and (empty or (body == root and body.mass == 0)):
            body.mass = max(body.mass, 1e-3)
            body.fullinertia = [np.nan] + [0.0] * 5
            body.inertia = [1.0, 1.0, 1.0]  # of kuka's base, and of laikago, whose inertia is not compared
    spec.compiler.balanceinertia = True
    return spec.compile()


def poses_in(world: World, place: FloatArray, turn: Rotation, angles: FloatArray) -> dict[str, tuple[Any, Rotation]]:
    """Return the pose of each body by name: forward kinematics with scipy, apart from the code of the core."""
    found = {world.bodies[0].name: (place, turn)}
    waiting = dict(zip(world.joints, angles, strict=True))
    while waiting:
        joint = next(each for each in waiting if each.parent in found)
        angle, (at, turned) = waiting.pop(joint), found[joint.parent]
        axis = np.array(joint.axis)
        frame = turned * Rotation.from_quat(joint.turn)
        origin = at + turned.apply(joint.origin_m)
        if joint.slides:
            found[joint.child] = origin + frame.apply(angle * axis), frame
        else:
            found[joint.child] = origin, frame * Rotation.from_rotvec(angle * axis)
    return found


def set_angles(model: Any, data: Any, world: World, angles: FloatArray) -> None:
    for joint, angle in zip(world.joints, angles, strict=True):
        data.qpos[model.joint(joint.name).qposadr[0]] = angle


@for_each(FILES)
def test_bodies_are_where_mujoco_has_them_at_any_joint_angles(name: str) -> None:
    world, model, rng = imported(name).robot.world, reference(name), np.random.default_rng(1)
    data = mujoco.MjData(model)
    for _ in range(5):
        data.qpos[:3], turn = rng.normal(size=3), Rotation.random(rng=rng)
        data.qpos[3:7] = np.roll(turn.as_quat(), 1)
        angles = rng.uniform(-2, 2, len(world.joints))
        set_angles(model, data, world, angles)
        mujoco.mj_forward(model, data)
        poses = poses_in(world, data.qpos[:3].copy(), turn, angles)

        for joint in world.joints:
            at = model.joint(joint.name).id
            place, turned = poses[joint.child]
            assert place == pytest.approx(data.xanchor[at], abs=1e-9)
            assert turned.apply(joint.axis) == pytest.approx(data.xaxis[at], abs=1e-9)
            assert turned.as_matrix() == pytest.approx(data.xmat[model.jnt_bodyid[at]].reshape(3, 3), abs=1e-9)


@for_each(each for each in FILES if each != "laikago")
def test_mass_center_and_inertia_are_those_of_mujoco(name: str) -> None:
    """The total inertia is the mass matrix of the base, at random angles: it depends on every body."""
    world, model, rng = imported(name).robot.world, reference(name), np.random.default_rng(2)
    data = mujoco.MjData(model)
    angles = rng.uniform(-2, 2, len(world.joints))
    set_angles(model, data, world, angles)
    mujoco.mj_forward(model, data)
    root = model.body(world.bodies[0].name).id
    poses = poses_in(world, data.xpos[root].copy(), Rotation.from_matrix(data.xmat[root].reshape(3, 3)), angles)
    moving = world.bodies[1:] if world.fixed else world.bodies

    total, moment = 0.0, np.zeros((3, 3))
    for body in moving:
        carrier = [joint.name for joint in world.joints if joint.child == body.name]
        at = model.jnt_bodyid[model.joint(carrier[0]).id] if carrier else root
        place, turn = poses[body.name]
        center = place + turn.apply(body.center_m)
        axes = (turn * Rotation.from_quat(body.inertia.turn)).as_matrix()
        tensor = axes @ np.diag(body.inertia.moments_kg_m2) @ axes.T
        theirs = data.ximat[at].reshape(3, 3)
        assert body.mass_kg == pytest.approx(model.body_mass[at], rel=1e-12)
        assert center == pytest.approx(data.xipos[at], abs=1e-9)
        assert tensor == pytest.approx(theirs @ np.diag(model.body_inertia[at]) @ theirs.T, rel=1e-9, abs=1e-12)
        to = center - data.xpos[root]
        total += body.mass_kg
        moment += tensor + body.mass_kg * (to @ to * np.eye(3) - np.outer(to, to))
    if not world.fixed:
        matrix = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, data, matrix)
        turn = data.xmat[root].reshape(3, 3)
        assert total == pytest.approx(matrix[0, 0], rel=1e-9)
        assert turn.T @ moment @ turn == pytest.approx(matrix[3:6, 3:6], rel=1e-9, abs=1e-12)


@for_each(MASSES_KG)
def test_no_mass_is_lost(name: str) -> None:
    """MuJoCo alone loses that of a URDF's root: 4.7 of a1's 12.5 kg."""
    found = imported(name)
    held = 1.0 if name == "kuka_iiwa" else 0.0

    assert found.before_kg == pytest.approx(MASSES_KG[name], rel=1e-9)
    assert found.after_kg == pytest.approx(MASSES_KG[name] + held, rel=1e-9)


@for_each(FILES)
def test_joints_keep_their_limits_damping_friction_and_armature(name: str) -> None:
    world, model = imported(name).robot.world, reference(name)

    assert {joint.name for joint in world.joints} == {model.joint(at).name for at in range(1, model.njnt)}
    for joint in world.joints:
        theirs = model.joint(joint.name)
        dof = theirs.dofadr[0]
        assert joint.limits == (tuple(theirs.range) if theirs.limited[0] else None)
        assert joint.damping == model.dof_damping[dof]
        assert joint.dry_friction == model.dof_frictionloss[dof]
        assert joint.armature == model.dof_armature[dof]
        assert joint.slides == (theirs.type[0] == 2)


@for_each(FILES)
def test_the_lowest_point_touches_the_ground_at_the_start(name: str) -> None:
    """MuJoCo measures it: the distance of each shape from a plane, of meshes with all their vertices."""
    world, model = imported(name).robot.world, reference(name)
    data = mujoco.MjData(model)
    data.qpos[2] = world.start_height_m
    data.qpos[3:7] = np.roll(world.start_turn, 1)
    set_angles(model, data, world, np.array([joint.start for joint in world.joints]))
    mujoco.mj_kinematics(model, data)
    robots = [geom for geom in range(model.ngeom) if model.geom_bodyid[geom] > 0]
    heights = [lowest(model, data, geom) for geom in robots]

    if world.fixed:
        assert min(heights) > -0.005
    else:
        assert min(heights) == pytest.approx(0, abs=0.004 if model.nmesh else 1e-9)


def lowest(model: Any, data: Any, geom: int) -> float:
    """Return the height of the lowest of many points on a shape."""
    turn, size = data.geom_xmat[geom].reshape(3, 3), model.geom_size[geom]
    match int(model.geom_type[geom]):
        case 2:
            points = np.zeros((1, 3))
            extra = size[0]
        case 3:
            points, extra = np.array([[0, 0, size[1]], [0, 0, -size[1]]]), size[0]
        case 5:
            around = np.linspace(0, 2 * np.pi, 3601)
            circle = np.stack([size[0] * np.cos(around), size[0] * np.sin(around), 0 * around + size[1]], axis=1)
            points, extra = np.vstack([circle, circle * [1, 1, -1]]), 0.0
        case 6:
            corners = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, -1).T
            points, extra = corners * size, 0.0
        case _:
            first = model.mesh_vertadr[model.geom_dataid[geom]]
            points = model.mesh_vert[first : first + model.mesh_vertnum[model.geom_dataid[geom]]].astype(float)
            extra = 0.0
    return float((points @ turn.T)[:, 2].min() + data.geom_xpos[geom][2] - extra)


def test_the_same_import_gives_the_same_file() -> None:
    file, options = FILES["mini_cheetah"]
    again = import_robot(path_of(file), ImportOptions(**options)).robot

    assert again.sha256 == imported("mini_cheetah").robot.sha256
    assert RobotFile.read(again.text) == again


@pytest.mark.parametrize(
    ("file", "reason"),
    [
        (
            "laikago/laikago_toes_limits.urdf",
            "chassis moves, but has mass 13.71 kg and a moment of inertia of 0; --mend",
        ),
        ("mini_cheetah/mini_cheetah.urdf", "thigh_fr: moments .* break the triangle inequality; --mend"),
        ("franka_panda/panda.urdf", "panda_finger_joint2 mimics another, .*; --lock"),
        ("humanoid.xml", "tendons: left_hipknee, but .*; body lwaist has 2 joints"),
        ("reacher.xml", "2 separate bodies"),
        ("point.xml", "body torso has 3 joints"),
    ],
)
def test_what_a_world_has_no_place_for_is_refused_by_name(file: str, reason: str) -> None:
    with pytest.raises(InvalidRobot, match=reason):
        import_robot(path_of(file), ImportOptions())


def test_what_is_lost_is_said() -> None:
    a1, ant = "\n".join(imported("a1").robot.lost), "\n".join(imported("ant").robot.lost)

    assert "transmissions are lost" in a1
    assert "FR_hip_tran" in a1
    assert "velocity limits are lost, which a servo keeps: FR_hip_joint" in a1
    assert "part of it: FR_toe" in a1
    assert "contact properties are lost" not in a1
    assert "contact properties are lost" in "\n".join(imported("mini_cheetah").robot.lost)
    assert "soft contacts" in ant
    assert "the order of actuators is that of the joints: hip_1" in ant


def joint_of(name: str, joint: str) -> Joint:
    return next(each for each in imported(name).robot.world.joints if each.name == joint)


def test_motors_of_mjcf_have_their_gears_and_limits() -> None:
    assert joint_of("ant", "hip_4").motor == PDMotor("torque", 150.0)
    assert joint_of("ant", "ankle_2").start == -1.0  # of init_qpos
    assert joint_of("ant", "ankle_2").swing == 75.0


def test_motors_of_a_urdf_have_its_effort_and_gains_from_it() -> None:
    motor = joint_of("a1", "FR_hip_joint").motor

    assert isinstance(motor, PDMotor)
    assert (motor.follows, motor.max_torque_nm) == ("position", 20.0)
    assert motor.kp == pytest.approx(20 / 0.35)
    assert 0.5 < motor.kd < 5


def small(tmp_path: Path, more: str = "", **options: Any) -> World:
    file = tmp_path / "m.xml"
    file.write_text(MJCF.format(more))
    return import_robot(file, ImportOptions(**options)).robot.world


def test_every_value_of_a_small_mjcf_is_found_again(tmp_path: Path) -> None:
    world = small(tmp_path)
    first, second, third = world.joints

    assert first.motor == PDMotor("position", 12.0, kp=450.0, kd=18.0)
    assert second.motor == PDMotor("velocity", second.motor.max_torque_nm, kd=7.0)
    assert third.motor is None
    assert (first.limits, first.damping, first.dry_friction, first.armature) == ((-1, 1), 0.2, 0.1, 0.01)
    assert (first.start, second.start, second.slides) == (0.3, 0.05, True)
    assert first.axis == (0, 1, 0)
    assert world.time_step_s == 0.004
    assert [body.mass_kg for body in world.bodies] == pytest.approx([2, 0.3, 0.2, 0.1])
    assert world.bodies[0].parts[0].shape == Box((0.2, 0.4, 0.1))
    assert isinstance(world.bodies[1].parts[0].shape, Capsule)
    assert isinstance(world.bodies[2].parts[0].shape, Hull)
    assert world.material.static_friction == 1.0  # MuJoCo's default of a shape, above that of the plane
    assert {name: each.static_friction for name, each in world.surfaces} == {"friction_0.7": 0.7, "friction_1.5": 1.5}


def test_a_reference_angle_and_a_joint_beside_the_origin_keep_the_kinematics(tmp_path: Path) -> None:
    world, rng = small(tmp_path), np.random.default_rng(3)
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "m.xml"))
    data = mujoco.MjData(model)
    for angles in rng.uniform(-1, 1, (5, 3)):
        set_angles(model, data, world, angles)
        mujoco.mj_kinematics(model, data)
        poses = poses_in(world, np.array([0, 0, 1]), Rotation.identity(), angles)

        for body in world.bodies:
            place, turn = poses[body.name]
            at = model.body(body.name).id
            assert place + turn.apply(body.center_m) == pytest.approx(data.xipos[at], abs=1e-12)
            assert turn.as_matrix() == pytest.approx(data.xmat[at].reshape(3, 3), abs=1e-12)


GEARED = """<mujoco><compiler angle="radian"/><worldbody><body><freejoint/><geom size=".1"/>
<body><joint name="j"/><geom size=".1" mass="1"/></body></body></worldbody><actuator>{}</actuator></mujoco>"""
"""A robot with a single hinge; `{}` takes its actuator."""


def geared(tmp_path: Path, actuator: str) -> tuple[PDMotor, list[str]]:
    file = tmp_path / "geared.xml"
    file.write_text(GEARED.format(actuator))
    robot = import_robot(file, ImportOptions()).robot
    motor = robot.world.joints[0].motor
    assert isinstance(motor, PDMotor)
    return motor, list(robot.lost)


@pytest.mark.parametrize("gear", [3, -0.5])
@pytest.mark.parametrize(
    "actuator",
    [
        '<position name="p" joint="j" kp="50" kv="2" gear="{}" forcerange="-99 99"/>',
        '<velocity name="p" joint="j" kv="7" gear="{}" forcerange="-99 99"/>',
        '<motor name="p" joint="j" gear="{}" forcerange="-99 99"/>',
        '<general name="p" joint="j" gear="{}" forcerange="-99 99" gainprm="4"/>',
    ],
)
def test_at_the_target_that_the_import_states_a_motor_has_the_torque_of_mujocos_control(
    tmp_path: Path, actuator: str, gear: float
) -> None:
    motor, lost = geared(tmp_path, actuator.format(gear))
    law = pd_law(motor, inverse_inertia=0.0, step_s=0.0)
    (factor,) = [float(line.split()[6]) for line in lost if line.startswith("targets are those of the joint, ")]
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "geared.xml"))
    data = mujoco.MjData(model)

    for control, angle, speed in np.random.default_rng(5).uniform(-1, 1, (5, 3)):
        data.ctrl[0], data.qpos[-1], data.qvel[-1] = control, angle, speed
        mujoco.mj_forward(model, data)

        assert pd_torque(factor * control, angle, speed, law) == pytest.approx(data.qfrc_actuator[-1], rel=1e-4)


def test_limits_of_controls_and_torques_that_a_motor_has_not_are_said(tmp_path: Path) -> None:
    _, position = geared(tmp_path, '<position name="p" joint="j" kp="50" gear="3" ctrlrange="-0.2 0.2"/>')
    _, velocity = geared(tmp_path, '<velocity name="p" joint="j" kv="7" ctrlrange="0 2" forcerange="-1 3"/>')
    _, one_sided = geared(tmp_path, '<motor name="p" joint="j" ctrlrange="0 1"/>')
    motor, both_sides = geared(tmp_path, '<motor name="p" joint="j" ctrlrange="-1 1" forcerange="-4 4"/>')

    assert "targets have no limits, where ctrlrange is -0.2 to 0.2: p" in position
    assert "targets have no limits, where ctrlrange is 0 to 2: p" in velocity
    assert "torque has the same limit to both sides, where forcerange is -1 to 3: p" in velocity
    assert "torque has the same limit to both sides, where ctrlrange is 0 to 1: p" in one_sided
    assert motor.max_torque_nm == 1.0
    assert "range" not in "".join(both_sides)


def test_actuators_that_a_world_has_not_are_refused_by_name(tmp_path: Path) -> None:
    with pytest.raises(InvalidRobot, match="second is the second one of joint ja"):
        small(tmp_path, '<motor name="second" joint="ja"/>')
    with pytest.raises(InvalidRobot, match="actuator odd is not a motor, position or velocity actuator"):
        small(tmp_path, '<damper name="odd" joint="jc" kv="1" ctrlrange="0 1"/>')
    with pytest.raises(InvalidRobot, match="actuator odd is not a motor, position or velocity actuator"):
        small(tmp_path, '<intvelocity name="odd" joint="jc" kp="1" actrange="-1 1"/>')


def test_options_set_what_the_file_leaves_open(tmp_path: Path) -> None:
    given: dict[str, Any] = {
        "motor": "servo",
        "motored": "j[ac]",
        "max_torque": 2.0,
        "start": {"ja": 0.5},
        "time_step_s": 0.01,
    }
    world = small(tmp_path, **given, static_friction=0.6, observed="c", fixed=True)

    assert [joint.motor for joint in world.joints] == [Motor(0.1, 2.0), None, Motor(0.1, 2.0)]
    assert (world.joints[0].start, world.joints[0].swing) == (0.5, 0.5)
    assert (world.time_step_s, world.observed, world.fixed) == (0.01, "c", True)
    assert (world.material.static_friction, world.material.dynamic_friction, world.surfaces) == (0.6, 0.6, ())
    with pytest.raises(InvalidRobot, match="ja cannot start at 2: its limits are -1 to 1"):
        small(tmp_path, start={"ja": 2.0})
    with pytest.raises(InvalidRobot, match=r"no joint has a name like knee.*joints: ja, jb, jc"):
        small(tmp_path, start={"knee": 2.0})
    with pytest.raises(InvalidRobot, match="no keyframe 'home'"):
        small(tmp_path, keyframe="home")


def test_a_base_that_is_turned_stands_on_the_ground(tmp_path: Path) -> None:
    """The file of laikago has y upwards. The box here is 0.4 m wide: its half is more than the leg below."""
    world = small(tmp_path, turn="1.5707963267948966,0,0")

    assert world.start_turn == pytest.approx((np.sqrt(0.5), 0, 0, np.sqrt(0.5)))
    assert world.start_height_m == pytest.approx(0.2, abs=0.03)
    laikago = import_robot(path_of(FILES["laikago"][0]), ImportOptions(mend=True, turn=(np.pi / 2, 0, 0))).robot.world
    assert laikago.start_height_m > 0.4


@pytest.mark.parametrize("fixed", [True, False])
def test_the_ground_may_be_lower(tmp_path: Path, *, fixed: bool) -> None:
    usual, lower = (small(tmp_path, fixed=fixed, ground_m=height) for height in (None, -0.5))

    assert (usual.ground_m, lower.ground_m) == (0.0, -0.5)
    assert lower.start_height_m == pytest.approx(usual.start_height_m - (0.0 if fixed else 0.5))
    with pytest.raises(ValidationError, match="ground_m"):
        small(tmp_path, ground_m=-5.0)


def test_a_locked_joint_is_fixed(tmp_path: Path) -> None:
    world = small(tmp_path, lock=("ja",))

    assert [joint.name for joint in world.joints] == ["jb", "jc"]
    assert sum(body.mass_kg for body in world.bodies) == pytest.approx(2.6)


URDF = """<robot name="Two links"><link name="base"><inertial><mass value="1"/><inertia ixx=".1" ixy="0" ixz="0"
iyy=".1" iyz="0" izz=".1"/></inertial><collision><geometry><mesh filename="package://two/meshes/cube.obj"/></geometry>
</collision></link><link name="arm">{mass}<collision><origin xyz="0 0 .5"/><geometry><box size=".1 .1 1"/></geometry>
</collision></link><joint name="hinge" type="{kind}"><parent link="base"/><child link="arm"/><axis xyz="0 1 0"/>
<limit effort="7" velocity="3" lower="-1" upper="2"/><dynamics damping=".3" friction=".4"/></joint></robot>"""
INERTIAL = """<inertial><origin xyz="0 0 .5"/><mass value="10"/><inertia ixx=".85" ixy="0" ixz="0" iyy=".85" iyz="0"
izz=".02"/></inertial>""".replace("\n", " ")
CUBE = "".join(f"v {x} {y} {z}\n" for x in (0, 1) for y in (0, 1) for z in (0, 1)) + "".join(
    f"f {face}\n" for face in ("1 2 4 3", "5 7 8 6", "1 5 6 2", "3 4 8 7", "1 3 7 5", "2 6 8 4")
)


def two_links(tmp_path: Path, kind: str = "revolute", *, with_mesh: bool = True) -> ImportedFile:
    folder = tmp_path / "two" / "urdf"
    folder.mkdir(parents=True, exist_ok=True)
    if with_mesh:
        (tmp_path / "two" / "meshes").mkdir(exist_ok=True)
        (tmp_path / "two" / "meshes" / "cube.obj").write_text(CUBE)
    (folder / "two.urdf").write_text(URDF.format(kind=kind, mass=INERTIAL))
    return import_robot(folder / "two.urdf", ImportOptions())


def test_a_package_is_found_in_the_folders_above(tmp_path: Path) -> None:
    found = two_links(tmp_path).robot
    (hinge,) = found.world.joints

    assert found.name == "two_links"
    cube = found.world.bodies[0].parts[0].shape
    assert isinstance(cube, Hull)
    assert len(cube.points_m) == 8
    assert (hinge.limits, hinge.damping, hinge.dry_friction) == ((-1.0, 2.0), 0.3, 0.4)
    assert hinge.motor.max_torque_nm == 7.0
    assert found.world.bodies[1].mass_kg == pytest.approx(10.0)


def test_a_missing_mesh_and_a_joint_without_a_place_are_named(tmp_path: Path) -> None:
    with pytest.raises(InvalidRobot, match=r"mesh 'package://two/meshes/cube.obj' was not found beside two.urdf"):
        two_links(tmp_path, with_mesh=False)
    with pytest.raises(InvalidRobot, match="joint hinge is planar"):
        two_links(tmp_path, "planar")


def test_a_dae_is_converted_to_metres(tmp_path: Path) -> None:
    """The duck of PyBullet is in centimetres."""
    pytest.importorskip("collada")
    text = URDF.format(kind="continuous", mass=INERTIAL).replace(
        "package://two/meshes/cube.obj", f"file://{path_of('duck.dae')}"
    )
    (tmp_path / "duck.urdf").write_text(text)
    duck = import_robot(tmp_path / "duck.urdf", ImportOptions()).robot.world.bodies[0].parts[0].shape

    assert isinstance(duck, Hull)
    assert np.ptp(np.array(duck.points_m)) == pytest.approx(1.64 + 0.69, rel=0.5)
    assert max(np.ptp(np.array(duck.points_m), axis=0)) < 2.5


def test_meshes_of_one_name_in_two_folders_stay_apart(tmp_path: Path) -> None:
    trimesh = pytest.importorskip("trimesh")
    pytest.importorskip("collada")
    for folder, size in (("a", 0.1), ("b", 0.4)):
        (tmp_path / folder).mkdir()
        trimesh.creation.box((size, size, size)).export(tmp_path / folder / "part.dae")
    box = '<box size=".1 .1 1"/>'
    text = URDF.format(kind="continuous", mass=INERTIAL).replace("package://two/meshes/cube.obj", "a/part.dae")
    (tmp_path / "two.urdf").write_text(text.replace(box, '<mesh filename="b/part.dae"/>'))

    base, arm = import_robot(tmp_path / "two.urdf", ImportOptions()).robot.world.bodies

    shapes = [body.parts[0].shape for body in (base, arm)]
    widths = [np.ptp(np.array(shape.points_m), axis=0).max() for shape in shapes if isinstance(shape, Hull)]
    assert widths == pytest.approx([0.1, 0.4])


@pytest.mark.parametrize("suffix", [".urdf", ".xml"])
def test_a_lock_that_fits_no_joint_is_refused(tmp_path: Path, suffix: str) -> None:
    file = path_of("a1/a1.urdf") if suffix == ".urdf" else tmp_path / "m.xml"
    if suffix == ".xml":
        file.write_text(MJCF)

    with pytest.raises(InvalidRobot, match=r"no joint has a name like 'nope\*', as --lock says; joints: "):
        import_robot(file, ImportOptions(lock=("nope*",)))


def test_a_file_that_is_neither_is_refused(tmp_path: Path) -> None:
    (tmp_path / "x.urdf").write_text("hello")
    with pytest.raises(InvalidRobot, match=r"Start tag expected.*line 1, column 1$"):
        import_robot(tmp_path / "x.urdf", ImportOptions())


@pytest.mark.parametrize(
    ("before", "after", "reason"),
    [
        ('effort="7"', 'effort="-7"', "line 5: joint hinge: limit effort '-7' is below 0"),
        ('velocity="3"', 'velocity="fast"', "line 5: joint hinge: limit velocity 'fast' is not a finite number"),
        (
            'lower="-1" upper="2"',
            'lower="2" upper="-1"',
            "line 5: joint hinge has limits 2 to -1; the smaller is first",
        ),
        ('xyz="0 1 0"/>', 'xyz="0 1"/>', "line 4: joint hinge: axis xyz '0 1' is not 3 finite numbers"),
        (
            'xyz="0 1 0"/>',
            'xyz="0 0 0"/>',
            "line 4: joint hinge: axis xyz '0 0 0' is not a direction; give one like '0 1 0'",
        ),
        ('mass value="1"', 'mass value="-1"', "line 1: link base: mass value '-1' is below 0"),
        ('ixx=".1"', 'ixx="-.1"', "line 2: link base: inertia ixx '-.1' is below 0"),
        ('mass value="1"', "mass", "line 1: link base: mass has no value"),
        ('size=".1 .1 1"', 'size=".1 .1 -1"', "line 3: link arm: box size '.1 .1 -1' is not 3 numbers above 0"),
        ('<box size=".1 .1 1"/>', '<sphere radius="0"/>', "line 3: link arm: sphere radius '0' is not above 0"),
        (
            'child link="arm"',
            'child link="leg"',
            "line 4: joint hinge: child link 'leg' is not in the file; links: base, arm",
        ),
        ('<parent link="base"/>', "", "line 4: joint hinge: no parent link is given; links: base, arm"),
        ('child link="arm"', 'child link="base"', "line 4: joint hinge joins the link base to itself"),
        (
            'type="revolute"',
            'type="revolut"',
            "line 4: joint hinge has the type 'revolut'; permitted: revolute, continuous, prismatic, fixed",
        ),
        ('type="revolute"', "", "line 4: joint hinge has no type; permitted: revolute, continuous, prismatic, fixed"),
        ('link name="arm"', 'link name="base"', "line 3: link base has the name of that in line 1; rename one of them"),
        ('joint name="hinge"', "joint", "line 4: a joint has no name"),
        (
            "</robot>",
            '<joint name="b" type="fixed"><parent link="base"/><child link="arm"/></joint></robot>',
            "line 5: joint b: child link 'arm' is already that of joint hinge in line 4; a link has one parent",
        ),
        ("</robot>", "<a>" * 300 + "</a>" * 300 + "</robot>", "Excessive depth"),
        ("</robot>", "<b></robot>", "mismatch: b line 5"),
    ],
)
def test_what_is_wrong_in_a_urdf_is_told_with_its_line(tmp_path: Path, before: str, after: str, reason: str) -> None:
    two_links(tmp_path)
    file = tmp_path / "two" / "urdf" / "two.urdf"
    file.write_text(file.read_text().replace(before, after, 1))

    with pytest.raises(InvalidRobot) as raised:
        import_robot(file, ImportOptions())

    assert any(reason in each for each in raised.value.reasons)


@pytest.mark.parametrize("mend", [False, True])
def test_what_is_mended_is_no_slip_of_the_pen(tmp_path: Path, *, mend: bool) -> None:
    two_links(tmp_path)
    file = tmp_path / "two" / "urdf" / "two.urdf"
    file.write_text(file.read_text().replace('mass value="1"', 'mass value="-2.0"'))

    with pytest.raises(InvalidRobot) as raised:
        import_robot(file, ImportOptions(mend=mend))

    assert raised.value.reasons == ("line 1: link base: mass value '-2.0' is below 0",)


def test_what_is_only_seen_or_of_an_extension_may_have_any_size(tmp_path: Path) -> None:
    two_links(tmp_path)
    file = tmp_path / "two" / "urdf" / "two.urdf"
    seen = '<visual><geometry><sphere radius="0"/></geometry></visual></link>'
    extension = (
        "<gazebo><link><collision><geometry><box><size>1 1 1</size></box></geometry></collision></link></gazebo>"
    )
    file.write_text(file.read_text().replace("</link>", seen, 1).replace("</robot>", f"{extension}</robot>"))

    assert [body.name for body in import_robot(file, ImportOptions()).robot.world.bodies] == ["base", "arm"]


def test_a_file_that_is_neither_says_what_it_is(tmp_path: Path) -> None:
    (tmp_path / "m.sdf").write_text("<?xml version='1.0'?><sdf version='1.9'><model name='m'/></sdf>")
    with pytest.raises(InvalidRobot, match="the file is <sdf>, but an import reads URDF, <robot>, and MJCF, <mujoco>"):
        import_robot(tmp_path / "m.sdf", ImportOptions())


def test_a_name_without_a_letter_is_refused(tmp_path: Path) -> None:
    (tmp_path / "m.xml").write_text(MJCF.format(""))
    with pytest.raises(InvalidRobot, match="'日本' has no letter from a to z"):
        import_robot(tmp_path / "m.xml", ImportOptions(name="日本"))


def test_equal_limits_are_none_and_said_without_a_log(here: Path, capfd: pytest.CaptureFixture[str]) -> None:
    two_links(here)
    file = here / "two" / "urdf" / "two.urdf"
    file.write_text(file.read_text().replace('lower="-1" upper="2"', 'lower="0" upper="0"'))

    robot = import_robot(file, ImportOptions()).robot

    assert robot.world.joints[0].limits is None
    assert "joints whose limits are equal have none: hinge" in robot.lost
    assert [each.name for each in here.iterdir()] == ["two"]
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("value", ["inf", "nan"])
def test_a_number_of_an_mjcf_that_is_not_finite_is_refused(tmp_path: Path, value: str) -> None:
    (tmp_path / "m.xml").write_text(MJCF.format("").replace('armature=".01"', f'armature="{value}"'))

    with pytest.raises(InvalidRobot):
        import_robot(tmp_path / "m.xml", ImportOptions())


def test_a_simple_hull_lies_inside_and_says_what_it_lacks() -> None:
    points = np.random.default_rng(5).normal(size=(2000, 3))
    points /= np.linalg.norm(points, axis=1)[:, None]
    few, lacking = simplify(points, 32)
    more, less = simplify(points, 64)

    assert (len(few), len(more)) == (32, 64)
    assert 0 < less < lacking < 0.25
    assert {tuple(each) for each in few} <= {tuple(each) for each in points}
    assert simplify(points[:20], 32)[1] == 0
