"""What is particular to the PyBullet engine, beyond the contract that every engine keeps."""

from collections.abc import Iterator
from dataclasses import replace
from gc import collect
from importlib import import_module
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gaplab.services.core.arrays import FloatArray
from gaplab.services.engines.pybullet import PyBullet
from gaplab.services.engines.pybullet.engine import StickSlip
from gaplab.services.specs.defaults import default_engine
from gaplab.services.world.controllers.oscillators import Cpg
from gaplab.services.world.kinematics import about, body_poses
from gaplab.services.world.motions import Motion, open_loop
from gaplab.services.world.robots.quadruped import Quadruped
from gaplab.services.world.world import Body, Box, Hull, Inertia, Joint, Material, Motor, Part, PDMotor, Sphere, World

pytest.importorskip("pybullet")

ROBOT = Quadruped()
MOTION = open_loop(ROBOT.motion(ROBOT.known))

INERTIA = Inertia((0.1, 0.1, 0.1))


@pytest.fixture
def engine() -> Iterator[PyBullet]:
    engine = PyBullet()
    yield engine
    engine.close()


def in_material(material: Material) -> World:
    return replace(ROBOT.world, material=material)


def path(engine: PyBullet, world: World, motion: Motion = MOTION) -> FloatArray:
    return engine.rollout(world, motion).positions_m


def light_limbs(torque_nm: float) -> World:
    """A robot of 2.5 kg whose motors are as strong and as stiff as a placeholder in its file says."""

    def motor(kd: float) -> PDMotor:
        return PDMotor("position", torque_nm, kp=torque_nm / 0.35, kd=kd)

    bodies = [Body("trunk", 1.2, (Part(Box((0.34, 0.14, 0.06))),), inertia=Inertia((0.006, 0.01, 0.014)))]
    joints = []
    for leg, (x, y) in {"fl": (0.2, 0.15), "fr": (0.2, -0.15), "rl": (-0.2, 0.15), "rr": (-0.2, -0.15)}.items():
        low, foot = (0.0, 0.0, -0.08), Part(Sphere(0.02), (0.0, 0.0, -0.16))
        bodies += [
            Body(f"{leg}_shoulder", 0.15, (), inertia=Inertia((3e-5, 4e-4, 4e-4))),
            Body(f"{leg}_thigh", 0.15, (), low, inertia=Inertia((4e-4, 4e-4, 4e-5))),
            Body(f"{leg}_shin", 0.03, (foot,), low, inertia=Inertia((1e-4, 1e-4, 1e-6))),
        ]
        joints += [
            Joint(f"{leg}_haa", "trunk", f"{leg}_shoulder", (x, y, 0.0), (1.0, 0.0, 0.0), motor(3.85)),
            Joint(f"{leg}_hfe", f"{leg}_shoulder", f"{leg}_thigh", (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), motor(2.85)),
            Joint(f"{leg}_kfe", f"{leg}_thigh", f"{leg}_shin", (0.0, 0.0, -0.16), (0.0, 1.0, 0.0), motor(0.905)),
        ]
    return World(tuple(bodies), tuple(joints), start_height_m=0.34, time_step_s=1 / 240)


def test_a_robot_that_flies_off_since_its_joints_shake_failed(engine: PyBullet) -> None:
    """Unchecked, six of these eight controllers are faster than 4 m/s, and one reaches 22 m/s."""
    world, controller = light_limbs(1000.0), Cpg()
    controller.prepare(world, np.array([0.5, 3.0]))
    motions = [controller.motion(genome) for genome in controller.space.draw(8, np.random.default_rng(2))]

    places = np.array([path(engine, world, motion) for motion in motions])
    speeds = np.linalg.norm(places[:, 1, :2] - places[:, 0, :2], axis=1) / 2.5

    assert np.isnan(speeds).sum() >= 4
    assert not np.any(speeds > 4.0)


def test_a_robot_with_more_links_than_bullet_permits_is_refused(engine: PyBullet) -> None:
    def of(parts: int) -> World:
        base = Body("base", 1.0, tuple(Part(Sphere(0.01), (0.03 * n, 0.0, 0.0)) for n in range(parts)), inertia=INERTIA)
        joint = Joint("joint", "base", "child", (0.0, 0.0, 0.3), (0.0, 1.0, 0.0), Motor(0.1, 1.0))
        return World((base, Body("child", 0.1, Sphere(0.01))), (joint,), start_height_m=0.01)

    motion = Motion(np.array([0.0]), np.zeros((1, 1)), np.array([0.01]))
    assert PyBullet.runs(of(127))
    assert np.isfinite(engine.rollout(of(127), motion).positions_m).all()
    assert not PyBullet.runs(of(128))
    with pytest.raises(engine._bullet.error, match="out-of-range"):
        engine._build(of(128))
    imported: Any = SimpleNamespace(world=of(128), engine="pybullet")
    assert default_engine(imported) == "mujoco"


def test_a_server_closes_when_nothing_refers_to_its_scene() -> None:
    bullet, engine = import_module("pybullet"), PyBullet()
    engine.rollout(ROBOT.world, MOTION)
    (scene,) = engine._scenes._scenes.values()
    client = scene.client
    assert bullet.getConnectionInfo(client)["isConnected"]

    del scene, engine
    collect()

    assert not bullet.getConnectionInfo(client)["isConnected"]


def test_equal_frictions_cost_no_look_at_the_contacts(engine: PyBullet, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(StickSlip, "step", None)

    assert np.all(np.isfinite(path(engine, in_material(Material(0.8, 0.8)))))


def test_a_robot_in_its_gait_sticks_and_slides(engine: PyBullet, monkeypatch: pytest.MonkeyPatch) -> None:
    slid: list[int] = []
    original = StickSlip._slide
    monkeypatch.setattr(StickSlip, "_slide", lambda self, link: (slid.append(link), original(self, link))[1])  # type: ignore[func-returns-value]

    path(engine, ROBOT.world)

    assert len(slid) > 10
    assert len(set(slid)) == 4, "every foot slides at times"


def test_every_body_has_the_mass_and_the_inertia_of_its_solid_shape(engine: PyBullet) -> None:
    scene = engine._scenes[replace(ROBOT.world, material=Material())]
    names = ["trunk", *(joint.child for joint in ROBOT.world.joints)]
    bodies = {body.name: body for body in ROBOT.world.bodies}

    for index, name in enumerate(names, start=-1):
        mass, _, inertia, center, *_ = scene.bullet.getDynamicsInfo(scene.robot, index, physicsClientId=scene.client)
        assert mass == bodies[name].mass_kg
        assert inertia == pytest.approx(solid(bodies[name]), rel=1e-6)
        assert center == pytest.approx(bodies[name].center_m)


def solid(body: Body) -> list[float]:
    """Principal moments of inertia of even density."""
    if isinstance(body.shape, Sphere):
        return [0.4 * body.mass_kg * body.shape.radius_m**2] * 3
    assert isinstance(body.shape, Box)
    x, y, z = np.square(body.shape.size_m)
    return [body.mass_kg / 12 * (y + z), body.mass_kg / 12 * (x + z), body.mass_kg / 12 * (x + y)]


def test_a_motor_closes_its_share_of_the_error_in_each_step(engine: PyBullet) -> None:
    wheel = World(
        bodies=(Body("hub", 1e6, Box((1.0, 1.0, 1.0))), Body("arm", 1.0, Box((0.1, 0.1, 0.1)), collides=False)),
        joints=(Joint("shaft", "hub", "arm", (0.0, 0.0, 1.0), (0.0, 0.0, 1.0), Motor(0.1, 1e3)),),
        start_height_m=0.5,
        gravity_m_s2=0.0,
    )
    scene = engine._scenes[wheel]
    scene.start(wheel)
    scene.command(0, 1.0)

    scene.step(10)

    angle = scene.bullet.getJointState(scene.robot, 0, physicsClientId=scene.client)[0]
    assert angle == pytest.approx(1 - 0.9**10, rel=0.02)


def test_links_are_where_kinematics_says_in_whatever_order_joints_are_listed(engine: PyBullet) -> None:
    turn = tuple(about(np.array([0.6, 0.0, 0.8]), np.array([0.5]))[0].tolist())
    parts = (
        Part(Sphere(0.03)),
        Part(Box((0.1, 0.1, 0.02)), (0.0, 0.0, -0.1)),
        Part(Hull(((0.1, 0, 0), (0, 0.1, 0), (0, 0, 0.1), (0, 0, 0)))),
    )
    names = ["trunk", "far", "near", "other", "farther"]
    inertia = Inertia((0.01, 0.02, 0.015), turn)
    bodies = tuple(
        Body(name, 0.1 + 0.1 * i, parts, (0.01, 0.0, 0.02 * i), inertia=inertia) for i, name in enumerate(names)
    )
    axis = (0.0, 0.6, 0.8)
    joints = (
        Joint("a", "far", "farther", (0.1, 0.0, 0.0), axis, turn=turn, start=0.3),
        Joint("b", "near", "far", (0.0, 0.1, 0.0), axis, slides=True, start=-0.1),
        Joint("c", "trunk", "near", (0.0, 0.0, 0.1), axis, turn=turn, start=0.7),
        Joint("d", "trunk", "other", (0.0, 0.2, 0.1), axis, turn=turn, start=-0.2),
    )
    world = World(bodies, joints, start_height_m=0.2, start_turn=turn)
    scene = engine._scenes[world]
    scene.start(world)
    scene.step(60)

    positions, orientations = body_poses(world, scene.pose()[None], scene.angles()[None])

    assert np.linalg.norm(scene.pose()[:2]) > 1e-3
    assert np.ptp(scene.angles() - [0.3, -0.1, 0.7, -0.2]) > 1e-3
    for link, joint in zip(scene._robot.joints, world.joints, strict=True):
        state = scene.bullet.getLinkState(scene.robot, link, 0, 1, physicsClientId=scene.client)
        info = scene.bullet.getDynamicsInfo(scene.robot, link, physicsClientId=scene.client)
        place = names.index(joint.child)
        assert info[0] == bodies[place].mass_kg
        assert info[2] == pytest.approx(inertia.moments_kg_m2)
        assert positions[0, place] == pytest.approx(state[4], abs=1e-6)
        assert abs(orientations[0, place] @ state[5]) == pytest.approx(1, abs=1e-6)
