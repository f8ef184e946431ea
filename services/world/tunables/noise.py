"""Tunables of what lies between physics and sensors: noise, latency, biases, and clocks that differ."""

from dataclasses import replace
from typing import Literal

from pydantic import Field

from gaplab.schemas.base import Frozen
from gaplab.services.world.tunables.base import ALL, IN_PLACE, Pattern, Tunable, WorldTunable, lacking, matching
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
        elif self.options.of != "target":
            self.of_loops = True

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
    of_loops = True
    lower, upper = 0.0, 0.05
    least, greatest = 0.0, 10.0

    def read(self, world: World) -> float:
        """Return the latency."""
        return world.noise.latency_s

    def edit(self, world: World, value: float) -> World:
        """Return the world with another latency."""
        return world.edited(self.field, noise=replace(world.noise, latency_s=float(value)))


class TimeOffset(WorldTunable):
    """Time by which commands begin later than the clock of the sensors says, rounded to whole time steps.

    The robot rests until the first command. Where it is negative, the commands of before time 0 are lost, but for the
    last one.
    """

    name = "time_offset"
    field = "time_offset_s"
    unit = "s"
    lower, upper = -0.1, 0.4
    least, greatest = -10.0, 10.0
    of_loops = False

    def lack(self, world: World) -> tuple[str, tuple[str, ...]] | None:
        """Return, if the robot has no motor that follows commands, a sentence."""
        return None if world.actuators else ("the robot has no motors", ())


class BiasOptions(Frozen):
    """Options of the tunable `bias`."""

    of: Pattern = Field(default="*", description=ALL)


class Bias(Tunable):
    """What the encoders of joints read beyond the true angle; motors do not follow it, but controllers in a loop do.

    A recorded angle at the start of a motion is what an encoder read, so the joint began at that, less the bias.
    """

    name = "bias"
    order = IN_PLACE
    field = "biases"
    unit = "rad"
    lower, upper = -0.1, 0.1
    least, greatest = -10.0, 10.0
    Options = BiasOptions
    options: BiasOptions

    def read(self, world: World) -> float:
        """Return the bias; of several joints their mean."""
        known, names = dict(world.biases), self.sensors(world)
        return sum(known.get(name, 0.0) for name in names) / len(names)

    def edit(self, world: World, value: float) -> World:
        """Return the world with the bias of each chosen joint replaced."""
        names = self.sensors(world)
        biases = {name: bias for name, bias in world.biases if name not in names}
        if value:
            biases |= dict.fromkeys(names, float(value))
        return world.edited(self.field, biases=tuple(sorted(biases.items())))

    def sensors(self, world: World) -> tuple[str, ...]:
        """Return the names of the encoders."""
        return tuple(f"angle {name}" for name in matching(self.options.of, [each.name for each in world.joints]))

    def lack(self, world: World) -> tuple[str, tuple[str, ...]] | None:
        """Return, if the robot has no such joint, a sentence and the names of its joints."""
        return lacking("joint", self.options.of, [joint.name for joint in world.joints])
