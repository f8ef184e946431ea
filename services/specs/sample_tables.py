"""The check of a table of samples for a robot that a request names."""

from gaplab.schemas.plugin import PluginRef
from gaplab.schemas.samples import SamplesRead
from gaplab.services.core.robots import robots
from gaplab.services.core.sample_tables import read_samples


def check_samples(text: str, robot: PluginRef) -> SamplesRead:
    """Return the samples of a CSV table, or everything that is wrong with it.

    Raises:
        InvalidSpec: the robot does not exist, or refuses its options.
    """
    return read_samples(text, robots.create(robot, "robot"))
