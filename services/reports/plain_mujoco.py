"""The tuned simulator of a spec in MuJoCo alone; a process for rollouts calls these functions."""

from collections.abc import Sequence

from gaplab.services.core.arrays import FloatArray, frozen
from gaplab.services.core.errors import InvalidRobot
from gaplab.services.engines.mujoco.plain import LOST, mjcf_of, plain_positions
from gaplab.services.replay.sent_specs import SentSpec, received
from gaplab.services.specs.assembly import simulation_of
from gaplab.services.specs.robots import robot_of
from gaplab.services.world.motions import Motion
from gaplab.services.world.robots.base import Robot
from gaplab.services.world.world import World


def tuned_mjcf(sent_spec: SentSpec, parameters: Sequence[float], headline: str) -> str:
    """Return a simulator as MJCF, with a line at its start; "" without MuJoCo, or if it refuses it."""
    _, world = _tuned(sent_spec, parameters)
    try:
        return mjcf_of(world, [headline, f"Not in this file: {', '.join(LOST)}"])
    except InvalidRobot:
        return ""


def plain_motion(
    sent_spec: SentSpec, parameters: Sequence[float], genome: Sequence[float], times_s: FloatArray
) -> FloatArray | None:
    """Return `(t, 3)`: where the body that counts is in MuJoCo alone, m; None of a controller that observes."""
    robot, world = _tuned(sent_spec, parameters)
    motion = robot.motion(frozen(genome)).observed_at(times_s)
    return plain_positions(world, motion) if isinstance(motion, Motion) else None


def _tuned(sent_spec: SentSpec, parameters: Sequence[float]) -> tuple[Robot, World]:
    spec = received(sent_spec)
    robot = robot_of(spec)
    return robot, simulation_of(spec, robot).world(frozen(parameters))
