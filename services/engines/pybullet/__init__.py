"""PyBullet: the default engine. Read `engine` first, then `scene` and `stick_slip`."""

from gaplab.services.engines.pybullet.engine import PyBullet

__all__ = ["PyBullet"]
