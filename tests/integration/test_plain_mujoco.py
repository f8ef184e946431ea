"""A world as an MJCF for MuJoCo alone."""

from dataclasses import replace
from typing import Any

import mujoco
import numpy as np
import pytest

from gaplab.services.core.errors import InvalidRobot
from gaplab.services.engines.mujoco import MuJoCo
from gaplab.services.engines.mujoco.plain import mjcf_of, plain_positions
from gaplab.services.world.motions import Motion, open_loop
from gaplab.services.world.robots.quadruped import Quadruped
from gaplab.services.world.world import Body, Box, Material, PDMotor, World
from tests.real_robots import imported

ROBOT = Quadruped()
FALLING_S = np.array([0.1, 0.5, 1.0, 2.0])


def motion(seed: int) -> Any:
    return open_loop(ROBOT.motion(ROBOT.space.draw(1, np.random.default_rng(seed))[0])).observed_at(FALLING_S)


@pytest.mark.parametrize("seed", [0, 1])
def test_where_nothing_touches_the_ground_mujoco_alone_moves_as_the_engine_does(seed: int) -> None:
    high = replace(ROBOT.world, start_height_m=20.0)

    here = MuJoCo().rollout(high, motion(seed)).positions_m

    assert plain_positions(high, motion(seed)) == pytest.approx(here, abs=5e-3)
    assert here[-1, 2] == pytest.approx(20.0 - 9.81 * 2.0**2 / 2, abs=0.2)


def test_the_file_has_the_masses_the_friction_and_the_slope_of_the_world() -> None:
    world = replace(imported("a1").robot.world, material=Material(0.9, 0.4), slope_rad=0.1)

    model = mujoco.MjModel.from_xml_string(mjcf_of(world, ["tuned -- by hand"]))

    assert model.body_mass[1:].sum() == pytest.approx(sum(body.mass_kg for body in world.bodies))
    touching = [at for at in range(1, model.ngeom) if model.geom_conaffinity[at]]
    assert touching
    assert {float(model.geom_friction[at, 0]) for at in touching} == {0.4}
    assert model.opt.gravity == pytest.approx([-9.81 * np.sin(0.1), 0.0, -9.81 * np.cos(0.1)])
    for joint in world.actuators:
        assert isinstance(joint.motor, PDMotor)
        assert model.actuator(joint.name).gainprm[0] == pytest.approx(joint.motor.kp, rel=1e-4)
        assert model.actuator(joint.name).forcerange[1] == pytest.approx(joint.motor.max_torque_nm, rel=1e-4)


def test_a_body_called_world_without_joints_and_one_that_mujoco_refuses() -> None:
    block = World((Body("world", 1.0, Box((0.2, 0.2, 0.2))),), start_height_m=20.0)
    thrown = Motion(np.zeros(1), np.zeros((1, 0)), np.array([0.0, 1.0]))

    assert plain_positions(block, thrown)[:, 2] == pytest.approx([20.0, 20.0 - 9.81 / 2], abs=0.05)
    with pytest.raises(InvalidRobot, match="MuJoCo alone refuses this world"):
        mjcf_of(replace(block, bodies=(replace(block.bodies[0], mass_kg=1e-30),)))


def test_the_hand_of_an_arm_moves_in_mujoco_alone_as_in_the_engine() -> None:
    world = imported("kuka_iiwa").robot.world
    world = replace(world, observed=world.bodies[-1].name)
    targets = np.linspace(0.0, 0.4, 20)[:, None] + [joint.start for joint in world.actuators]
    reaching = Motion(np.arange(20) / 20, targets, np.array([0.0, 0.3, 0.6, 0.9]))

    here = MuJoCo().rollout(world, reaching).positions_m

    assert plain_positions(world, reaching) == pytest.approx(here, abs=5e-3)
    assert np.ptp(here, axis=0).max() > 0.1
