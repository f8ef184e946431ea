"""Latency of observations."""

from dataclasses import replace

from gaplab.services.core.tunables.base import IN_PLACE, Tunable
from gaplab.services.core.world import World


class Latency(Tunable):
    """Age of what a controller in a loop observes, rounded to whole time steps of the simulator."""

    name = "latency"
    order = IN_PLACE
    field = "noise"
    also = frozenset({"latency_s"})
    unit = "s"
    lower, upper = 0.0, 0.05
    least, greatest = 0.0, 10.0

    def read(self, world: World) -> float:
        """Return the latency."""
        return world.noise.latency_s

    def edit(self, world: World, value: float) -> World:
        """Return the world with another latency."""
        return world.edited(self.field, noise=replace(world.noise, latency_s=float(value)))
