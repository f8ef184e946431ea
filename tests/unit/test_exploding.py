"""Which rollouts have an energy that neither their joints nor a fall can have given."""

import numpy as np
import pytest

from gaplab.services.engines.energy import Energy
from gaplab.services.world.motions import Motion, Start
from gaplab.services.world.sensing import gravity_m_s2
from gaplab.services.world.world import Body, Box, Joint, Sphere, World

HOPPER = World(
    bodies=(Body("base", 1.0, Box((0.2, 0.1, 0.1))), Body("leg", 0.1, Sphere(0.02), (0.0, 0.0, -0.28))),
    joints=(Joint("hip", "base", "leg", (0.0, 0.0, 0.0), (0.0, 1.0, 0.0)),),
)
ENERGY = Energy(HOPPER)
TIMES_S = ENERGY.checks_s(1.0)


@pytest.mark.parametrize(
    ("speed_m_s", "joint_rad_s", "climb_m_s", "expected"),
    [
        (1.0, 0.0, 0.0, False),
        (5.0, 0.0, 0.0, True),
        (5.0, 20.0, 0.0, False),
        (0.0, 0.0, -9.0, False),  # it falls for a second, at first from rest
        (0.0, 0.0, 9.0, True),
        (np.nan, 0.0, 0.0, False),  # fails for another reason
    ],
)
def test_a_base_is_as_fast_as_its_joints_sweep_and_as_gravity_pulls(
    speed_m_s: float, joint_rad_s: float, climb_m_s: float, expected: bool
) -> None:
    poses = np.zeros((len(TIMES_S), 7))
    poses[:, 0], poses[:, 2] = speed_m_s * TIMES_S, climb_m_s * TIMES_S**2 / 2
    angles = joint_rad_s * TIMES_S[:, None]

    assert ENERGY.explodes(poses, angles, gravity_m_s2(HOPPER)) == expected


@pytest.mark.parametrize(
    ("start", "expected"),
    [
        (Start(), True),
        (Start(velocity_m_s=(0.0, 3.0, 4.0)), False),
        (Start(turning_rad_s=(0.0, 20.0, 0.0)), False),
        (Start(speeds_rad_s=(-20.0,)), False),
        (Start(velocity_m_s=(0.0, 1.0, 0.0)), True),
    ],
)
def test_a_base_is_as_fast_as_it_is_thrown(start: Start, expected: bool) -> None:
    poses, angles = np.zeros((len(TIMES_S), 7)), np.zeros((len(TIMES_S), 1))
    poses[:, 0] = 5.0 * TIMES_S
    motion = Motion(np.zeros(1), np.zeros((1, 0)), TIMES_S, start=start)

    assert ENERGY.explodes(poses, angles, gravity_m_s2(HOPPER), ENERGY.thrown(motion)) == expected


def test_a_joint_that_only_shakes_makes_no_base_fast() -> None:
    poses, angles = np.zeros((len(TIMES_S), 7)), np.zeros((len(TIMES_S), 1))
    poses[:, 0] = 5.0 * TIMES_S
    angles[1::2] = 0.1

    assert ENERGY.explodes(poses, angles, gravity_m_s2(HOPPER))
