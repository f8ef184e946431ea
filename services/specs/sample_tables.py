"""The check of a table of samples for a robot that a request names."""

from gaplab.schemas.samples import SamplesRead
from gaplab.services.core.sample_tables import read_samples
from gaplab.services.specs.robots import Driven, robot_of


def check_samples(text: str, robot: Driven) -> SamplesRead:
    """Return the samples of a CSV table, or everything that is wrong with it.

    Raises:
        InvalidSpec: the robot, its controller or its task does not exist, or refuses its options.
    """
    return read_samples(text, robot_of(robot))
