"""Noise of commands, and noise and latency of observations."""

from dataclasses import replace
from typing import Literal

from pydantic import Field

from gaplab.schemas.base import Frozen
from gaplab.services.world.tunables.base import IN_PLACE, Tunable
from gaplab.services.world.world import World

UNITS = {
    "target": "",
    "angle_rad": "rad",
    "speed_rad_s": "rad/s",
    "tilt": "1",
    "turning_rad_s": "rad/s",
    "start_tilt_rad": "rad",
}
"""What is noisy, with its unit; that of targets is the motor's."""


class NoiseOptions(Frozen):
    """Options of the tunable `noise`."""

    of: Literal["target", "angle_rad", "speed_rad_s", "tilt", "turning_rad_s", "start_tilt_rad"] = Field(
        default="target",
        description="the noisy quantity: targets, what a controller in a loop observes, or the tilt at the start",
    )


class NoiseDeviation(Tunable):
    """Standard deviation of the noise of targets, of what a controller in a loop observes, or of the start."""

    name = "noise"
    source = "Jakobi, Husbands and Harvey 1995; the bounds are gaplab's"
    order = IN_PLACE
    field = "noise"
    lower, upper = 0.0, 0.1
    least, greatest = 0.0, 100.0
    Options = NoiseOptions
    options: NoiseOptions

    def __init__(self, options: Frozen | None = None) -> None:
        super().__init__(options)
        self.unit = UNITS[self.options.of]
        if self.options.of == "start_tilt_rad":
            self.field = "noise.start_tilt_rad"

    def read(self, world: World) -> float:
        """Return the standard deviation."""
        return float(getattr(world.noise, self.options.of))

    def edit(self, world: World, value: float) -> World:
        """Return the world with another standard deviation."""
        changes: dict[str, float] = {self.options.of: float(value)}
        return world.edited(self.field, noise=replace(world.noise, **changes))

    def lack(self, world: World) -> tuple[str, tuple[str, ...]] | None:
        """Return, if the base never moves, so that it cannot be tilted, a sentence and the other options."""
        if world.fixed and self.options.of == "start_tilt_rad":
            return "the base of the robot never moves, so its start has no tilt", tuple(UNITS)[:-1]
        return None


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
