"""Robots from files stand, or hold still, in each engine that honours what they need."""

import numpy as np
import pytest

from gaplab.schemas.plugin import PluginRef
from gaplab.services.core.arrays import frozen
from gaplab.services.engines import engines
from gaplab.services.specs.assembly import engine_of
from gaplab.services.world.motions import Motion
from tests.real_robots import STANCES, for_each, imported

pytest.importorskip("mujoco")


@pytest.mark.parametrize("engine", ["pybullet", "mujoco", "physx"])
@for_each(STANCES)
def test_a_robot_with_its_motors_at_rest_stays_as_it_starts(name: str, engine: str) -> None:
    """For three seconds. Gains are those that the import computes, and the largest torques those of the file."""
    if engine not in engines or not engines[engine].available():
        pytest.skip(f"{engine} is not installed")
    pytest.importorskip("pybullet_data")
    world = imported(name).robot.world
    if lacks := engines[engine].lacks(world):
        pytest.skip(f"{engine} does not honour {lacks}")
    starts = np.array([joint.start for joint in world.joints])
    motion = Motion(frozen([0.0]), frozen([starts]), frozen([0.1, 3.0]))

    seen = engine_of(PluginRef(name=engine)).record(world, motion, frozen([1.0, 3.0]))

    first, last = seen.trajectory.positions_m
    assert np.linalg.norm(last - first) < 0.03
    assert abs(float(np.sum(seen.poses[-1, 3:] * world.start_turn))) > np.cos(
        np.radians(3) / 2
    )  # turned by less than 3°
    assert seen.angles_rad[-1] == pytest.approx(starts, abs=0.25)
