"""What is particular to the PhysX engine, beyond the contract that every engine keeps."""

import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from gaplab.schemas.spec import ExperimentSpec
from gaplab.services.core.arrays import FloatArray
from gaplab.services.engines.physx import PhysX
from gaplab.services.engines.physx.engine import PhysXScene
from gaplab.services.specs.assembly import setting
from gaplab.services.specs.resolution import resolve_experiment
from gaplab.services.world.motions import Motion, open_loop
from gaplab.services.world.robots.quadruped import Quadruped
from gaplab.services.world.world import Body, Box, Joint, Material, Motor, Sphere, Vector, World

if not PhysX.available():
    pytest.skip(PhysX.install, allow_module_level=True)

ROBOT = Quadruped()
MOTION = open_loop(ROBOT.motion(ROBOT.known))
STEP_S = 1 / 100


@pytest.fixture
def engine() -> Iterator[PhysX]:
    engine = PhysX()
    yield engine
    engine.close()


def in_material(material: Material) -> World:
    return replace(ROBOT.world, material=material)


def path(engine: PhysX, world: World, motion: Motion = MOTION) -> FloatArray:
    return engine.rollout(world, motion).positions_m


def wheel(motor: Motor, axis: Vector = (0.0, 0.0, 1.0)) -> World:
    """A cube of 1 kg that a motor turns about its own center, on a hub too heavy to be moved."""
    return World(
        bodies=(Body("hub", 1e6, Box((1.0, 1.0, 1.0))), Body("arm", 1.0, Box((0.1, 0.1, 0.1)), collides=False)),
        joints=(Joint("shaft", "hub", "arm", (0.0, 0.0, 1.0), axis, motor),),
        start_height_m=0.5,
        gravity_m_s2=0.0,
        time_step_s=STEP_S,
    )


def turned(engine: PhysX, world: World, target: float, steps: int) -> PhysXScene:
    scene = engine._scenes[world]
    scene.start(world)
    scene.command(0, target)
    scene.step(steps)
    return scene


def test_a_rollout_says_nothing_and_warns_of_nothing() -> None:
    script = """
from dataclasses import replace
from gaplab.services.world.robots.quadruped import Quadruped
from gaplab.services.engines.physx import PhysX
robot = Quadruped()
for gravity in (9.81, 1e9):
    PhysX().rollout(replace(robot.world, gravity_m_s2=gravity), robot.motion(robot.known))
"""

    said = subprocess.run([sys.executable, "-W", "error", "-c", script], capture_output=True, text=True, check=True)

    assert said.stdout + said.stderr == ""


def test_what_the_process_makes_the_librarys_defaults_is_neither_used_nor_changed(engine: PhysX) -> None:
    expected = path(engine, ROBOT.world)
    physx = sys.modules["sapien"].physx
    before = physx.get_scene_config(), physx.get_shape_config(), physx.get_body_config()
    try:
        physx.set_scene_config(gravity=[0.0, 1.0, 0.0], bounce_threshold=7.0, enable_tgs=True, enable_pcm=False)
        physx.set_shape_config(contact_offset=0.1, rest_offset=0.05)
        physx.set_body_config(solver_position_iterations=1, solver_velocity_iterations=7, sleep_threshold=1.0)

        assert np.array_equal(path(PhysX(), ROBOT.world), expected)
        assert physx.get_scene_config().bounce_threshold == 7.0
    finally:
        physx.set_scene_config(before[0])
        physx.set_shape_config(before[1])
        physx.set_body_config(before[2])


def test_a_start_in_the_middle_of_anything_is_a_fresh_start(engine: PhysX) -> None:
    """Also after a few steps near the start, when the contacts that PhysX might remember are much the same."""
    rng = np.random.default_rng(0)
    motions = [open_loop(ROBOT.motion(genome)) for genome in ROBOT.space.draw(3, rng)]
    expected = [path(PhysX(), ROBOT.world, motion) for motion in motions]

    for steps in (1, 2, 3, 5, 10, 50):
        for motion, fresh in zip(motions, expected, strict=True):
            friction = float(rng.uniform(0, 1.5))
            path(
                engine,
                in_material(Material(friction, friction, 0.3)),
                replace(motion, observe_s=np.array([steps / 100])),
            )
            assert np.array_equal(path(engine, ROBOT.world, motion), fresh)


def test_every_body_has_the_mass_and_the_inertia_of_its_solid_shape(engine: PhysX) -> None:
    scene = engine._scenes[replace(ROBOT.world, material=Material())]
    links = {body.name: scene.robot.links[body.name] for body in ROBOT.world.bodies}

    for body in ROBOT.world.bodies:
        assert links[body.name].mass == pytest.approx(body.mass_kg)
        assert links[body.name].inertia == pytest.approx(solid(body), rel=1e-6)
        assert links[body.name].cmass_local_pose.p == pytest.approx(body.center_m)
    assert sum(link.mass for link in links.values()) == pytest.approx(sum(body.mass_kg for body in ROBOT.world.bodies))


def solid(body: Body) -> list[float]:
    """Principal moments of inertia of even density."""
    if isinstance(body.shape, Sphere):
        return [0.4 * body.mass_kg * body.shape.radius_m**2] * 3
    assert isinstance(body.shape, Box)
    x, y, z = np.square(body.shape.size_m)
    return [body.mass_kg / 12 * (y + z), body.mass_kg / 12 * (x + z), body.mass_kg / 12 * (x + y)]


@pytest.mark.parametrize("axis", [(0.0, 0.0, 1.0), (0.0, 0.0, -1.0), (-1.0, 0.0, 0.0), (0.0, 0.6, -0.8)])
def test_a_motor_turns_its_joint_about_its_axis(engine: PhysX, axis: Vector) -> None:
    scene = turned(engine, wheel(Motor(0.5, 1e3), axis), 1.0, 30)

    turn = scene.robot.links["arm"].entity_pose.q
    assert turn == pytest.approx([np.cos(0.5), *(np.sin(0.5) * np.array(axis))], abs=1e-4)


@pytest.mark.parametrize("gain", [0.01, 0.1, 0.7])
def test_a_motor_closes_its_share_of_the_error_in_each_step(engine: PhysX, gain: float) -> None:
    scene = turned(engine, wheel(Motor(gain, 1e4, 1e3)), 1.0, 5)

    assert 1 - scene.articulation.qpos[0] == pytest.approx((1 - gain) ** 5, rel=1e-3)


def test_a_motor_that_closes_all_of_the_error_arrives_in_one_step(engine: PhysX) -> None:
    scene = turned(engine, wheel(Motor(1.0, 1e4, 1e3)), 1.0, 2)

    assert scene.articulation.qpos[0] == pytest.approx(1.0, abs=1e-3)


def test_a_motor_accelerates_no_faster_than_its_torque_can(engine: PhysX) -> None:
    scene = turned(engine, wheel(Motor(0.5, 0.1, 1e3)), 100.0, 10)

    inertia = 1.0 / 600  # kg m², of the cube
    assert scene.articulation.qvel[0] == pytest.approx(10 * STEP_S * 0.1 / inertia, rel=1e-4)


def test_a_motor_turns_no_faster_than_its_speed(engine: PhysX) -> None:
    scene = turned(engine, wheel(Motor(0.5, 1e4, 3.0)), 100.0, 10)

    assert scene.articulation.qpos[0] == pytest.approx(10 * STEP_S * 3.0, rel=1e-4)


def test_joints_may_be_listed_in_any_order(engine: PhysX) -> None:
    still = Motion(np.zeros(1), np.zeros((1, 12)), np.array([1.0]))
    backwards = replace(ROBOT.world, joints=ROBOT.world.joints[::-1])

    height = path(engine, backwards, still)[-1, 2]

    assert height == pytest.approx(path(engine, ROBOT.world, still)[-1, 2], abs=1e-4)


def test_reality_in_physx_is_a_gap_that_no_simulator_in_another_engine_closes() -> None:
    pytest.importorskip("pybullet")
    spec = {"strategy": "random", "engine": "pybullet", "reality": {"engine": "physx"}}

    across = setting(resolve_experiment(ExperimentSpec.model_validate(spec)), 0)

    truth = np.array([[1.0, 0.8, 0.0]])
    real, simulated = across.reality(ROBOT.known).fitness, across.simulate(ROBOT.known[None], truth)[0, 0]
    assert real == pytest.approx(simulated, rel=0.3)
    assert real != simulated
