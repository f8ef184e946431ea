"""Robots: one file in this folder is one robot."""

from services.core.registry import Registry
from services.core.robots.base import Robot

robots: Registry[Robot] = Registry("robot", __name__, Robot)
