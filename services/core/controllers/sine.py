"""Each actuator swings as a sine."""

from typing import Annotated

import numpy as np
from pydantic import Field

from gaplab.schemas.base import Frozen, Real
from gaplab.services.core.arrays import FloatArray, Genome, frozen
from gaplab.services.core.controllers.base import Controller
from gaplab.services.core.controllers.parts import Limbs, middles, sampled, sampling_times_s, swings
from gaplab.services.core.motions import Motion
from gaplab.services.core.space import Space
from gaplab.services.core.world import World

QUARTER = 0.25
"""Phase by which each further joint of a limb is ahead in the known genome, so that a foot moves on a loop."""


class SineOptions(Frozen):
    """Options of `sine`."""

    slowest_hz: Annotated[Real, Field(gt=0, le=50)] = Field(default=0.5, description="frequency at gene value 0")
    fastest_hz: Annotated[Real, Field(gt=0, le=50)] = Field(
        default=3.0, description="frequency at gene value 1; not below `slowest_hz`, or genes are reversed"
    )
    amplitude: Annotated[Real, Field(gt=0, le=10)] = Field(
        default=1.0, description="largest amplitude and largest offset, as a factor of each joint's usual swing"
    )
    command_s: Annotated[Real, Field(ge=0.001, le=1)] = Field(default=0.02, description="interval between new targets")


class Sine(Controller):
    """A sine of amplitude, phase and offset for each actuator, and one frequency for all.

    Gene 0 is the frequency, in [0, 1]. Genes 3i + 1, 3i + 2 and 3i + 3 are the amplitude of actuator i in [0, 1], its
    phase in [0, 1], which wraps around, and its offset in [-1, 1]. With its middle m, its swing s and the options'
    amplitude A, its target is m + A s (offset + amplitude sin(2π (f t + phase))).
    """

    name = "sine"
    source = "gaplab; the usual open-loop gait of the field"
    Options = SineOptions
    options: SineOptions

    def prepare(self, world: World, observe_s: FloatArray) -> None:
        """Compute what all motions share."""
        actuators, limbs = len(world.actuators), Limbs.of(world)
        self.space = Space.box(
            [0.0, *[0.0, 0.0, -1.0] * actuators],
            [1.0, *[1.0, 1.0, 1.0] * actuators],
            [False, *[False, True, False] * actuators],
        )
        phases = (limbs.phases("trot")[limbs.limb] + QUARTER * limbs.depth) % 1
        each = np.column_stack([np.full(actuators, 0.5), phases, np.zeros(actuators)])
        self.known = frozen([0.5, *each.ravel()])
        self._middles, self._swings = middles(world), swings(world, self.options.amplitude)
        self._times_s, self._observe_s = sampling_times_s(observe_s, self.options.command_s), observe_s

    def motion(self, genome: Genome) -> Motion:
        """Return the motion, sampled at the interval of the options."""
        slowest, fastest = self.options.slowest_hz, self.options.fastest_hz
        turns = (slowest + (fastest - slowest) * genome[0]) * self._times_s[:, None] + genome[2::3]
        values = genome[3::3] + genome[1::3] * np.sin(2 * np.pi * turns)
        return sampled(self._middles + self._swings * values, self._times_s, self._observe_s)
