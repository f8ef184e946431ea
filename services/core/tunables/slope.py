"""Slope of the ground."""

from gaplab.services.core.tunables.base import IN_PLACE, Tunable
from gaplab.services.core.world import World


class Slope(Tunable):
    """Angle by which the ground rises along x."""

    name = "slope"
    order = IN_PLACE
    field = "slope_rad"
    unit = "rad"
    lower, upper = -0.1, 0.1
    least, greatest = -1.5, 1.5

    def read(self, world: World) -> float:
        """Return the angle."""
        return world.slope_rad

    def edit(self, world: World, value: float) -> World:
        """Return the world on another slope."""
        return world.edited(self.field, slope_rad=float(value))
