"""A strategy that no experiment names; the soak edits and breaks its file."""

from gaplab_plugins.calm import Calm


class Bystander(Calm):
    """The fittest in simulation, too."""

    name = "bystander"
