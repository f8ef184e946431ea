"""Robots: one file in this folder is one robot."""

from gaplab.services.core.registry import Registry
from gaplab.services.world.robots.base import Robot

robots: Registry[Robot] = Registry("robot", __name__, Robot)
