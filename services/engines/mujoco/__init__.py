"""MuJoCo: the fast engine. Read `engine` first, then `model`, and `law`, which has the physics."""

from gaplab.services.engines.mujoco.engine import MuJoCo

__all__ = ["MuJoCo"]
