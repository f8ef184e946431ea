"""The robot of a spec: its unit and sensors, which measurements are checked against."""

from gaplab.schemas.resolved import ResolvedSpec
from gaplab.services.core.robots import robots
from gaplab.services.core.robots.base import Robot


def robot_of(spec: ResolvedSpec) -> Robot:
    """Return the robot.

    Raises:
        InvalidSpec: it is not installed here.
    """
    return robots.create(spec.robot, "/robot")
