"""Recording a rollout changes nothing of it, in any engine, and what is recorded is where the bodies were."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from gaplab.services.engines import engines
from gaplab.services.engines.base import Engine
from gaplab.services.world.kinematics import body_poses, clearances_m
from gaplab.services.world.motions import open_loop
from gaplab.services.world.robots import robots
from gaplab.services.world.robots.quadruped import Quadruped

INSTALLED = [name for name, engine in engines.items() if engine.available()]
EMBODIED = [name for name in INSTALLED if engines[name].runs(Quadruped().world)]
TIMES_S = np.arange(151) / 50


@pytest.fixture(params=EMBODIED)
def engine(request: pytest.FixtureRequest) -> Any:
    return engines[request.param]()


def genomes(count: Any = 3) -> Any:
    return Quadruped().space.draw(count, np.random.default_rng(5))


@pytest.mark.parametrize("material", [{}, {"dynamic_friction": 0.3, "restitution": 0.4}])
def test_fitness_is_bit_equal_with_and_without_recording(engine: Any, material: Any) -> None:
    robot = Quadruped()
    world = replace(robot.world, material=replace(robot.world.material, **material))
    motions = [robot.motion(genome) for genome in genomes()]

    without = robot.fitness(engine.rollouts([world], motions))[:, 0]
    recorded = [float(robot.fitness(engine.record(world, motion, TIMES_S).trajectory)) for motion in motions]
    again = robot.fitness(engine.rollouts([world], motions))[:, 0]

    assert recorded == without.tolist() == again.tolist()
    assert len(set(recorded)) == len(recorded)


def test_a_recording_passes_through_what_the_rollout_observes(engine: Any) -> None:
    robot = Quadruped()
    motion = robot.motion(robot.known)

    seen = engine.record(robot.world, motion, TIMES_S)

    at = [TIMES_S.tolist().index(each) for each in motion.observe_s]
    assert seen.poses.shape == (151, 7)
    assert seen.angles_rad.shape == (151, 12)
    assert np.array_equal(seen.poses[at, :3], seen.trajectory.positions_m)
    assert np.array_equal(seen.poses[at, 3:], seen.trajectory.orientations)


def test_joints_follow_their_motors_and_feet_stay_out_of_the_ground(engine: Any) -> None:
    robot = Quadruped()
    motion = open_loop(robot.motion(robot.known))

    seen = engine.record(robot.world, motion, TIMES_S)
    positions, orientations = body_poses(robot.world, seen.poses, seen.angles_rad)
    feet = [place for place, body in enumerate(robot.world.bodies) if place and body.collides]
    lowest = np.array(
        [clearances_m(robot.world.bodies[each], positions[:, each], orientations[:, each]) for each in feet]
    )
    targets = motion.targets[np.searchsorted(motion.times_s, TIMES_S, side="right") - 1]

    assert np.all(seen.angles_rad[0] == 0)
    assert lowest[:, 0] == pytest.approx(0, abs=1e-6)
    assert lowest.min() > -0.02
    assert np.all((lowest < 0.002).any(axis=1) & (lowest > 0.01).any(axis=1))  # each foot is put down and lifted
    turning, wanted = np.diff(seen.angles_rad, axis=0), (targets - seen.angles_rad)[:-1]
    assert all(np.corrcoef(turning[:, each], wanted[:, each])[0, 1] > 0.5 for each in range(12))


def test_a_recording_of_physics_that_blows_up_is_nan_and_harms_nothing_after_it(engine: Any) -> None:
    robot = Quadruped()
    motion = robot.motion(robot.known)
    before = engine.rollout(robot.world, motion).positions_m

    lost = engine.record(replace(robot.world, gravity_m_s2=-1e9), motion, TIMES_S)

    assert np.isnan(lost.trajectory.positions_m).all()
    assert np.isnan(lost.poses).all()
    assert np.isnan(lost.angles_rad).all()
    assert np.array_equal(engine.rollout(robot.world, motion).positions_m, before)


def test_engines_agree_on_which_joint_is_which() -> None:
    robot = Quadruped()
    motion = robot.motion(genomes(1)[0])
    early = TIMES_S[:11]

    found = [engines[name]().record(robot.world, motion, early).angles_rad for name in EMBODIED]

    for each in found[1:]:
        assert np.all(np.abs(each[-1]) > 0.05)
        assert np.array_equal(np.sign(each[-1]), np.sign(found[0][-1]))


@pytest.mark.parametrize("name", INSTALLED)
def test_an_engine_that_tells_nothing_of_joints_still_shows_the_base(name: Any) -> None:
    robot = Quadruped() if name in EMBODIED else robots["toy_function"]()
    motion = robot.motion(robot.known)
    times = motion.observe_s

    seen = Engine.record(engines[name](), robot.world, motion, times)

    assert seen.angles_rad is None
    assert np.array_equal(seen.poses[:, :3], seen.trajectory.positions_m)
