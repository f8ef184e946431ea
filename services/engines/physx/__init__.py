"""PhysX through SAPIEN: the paper's own engine. Read `engine` first, then `robot`."""

from gaplab.services.engines.physx.engine import PhysX

__all__ = ["PhysX"]
