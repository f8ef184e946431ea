"""Tunables: each class in this folder with a name is one parameter of the simulator."""

from gaplab.services.core.registry import Registry
from gaplab.services.world.tunables.base import Tunable

tunables: Registry[Tunable] = Registry("tunable", __name__, Tunable)
