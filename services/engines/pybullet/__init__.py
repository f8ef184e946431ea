"""PyBullet: the default engine. Read `engine` first, then `robot`."""

from gaplab.services.engines.pybullet.engine import PyBullet

__all__ = ["PyBullet"]
