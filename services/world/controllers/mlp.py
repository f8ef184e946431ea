"""A network of one hidden layer in a loop."""

from typing import Annotated

import numpy as np
from pydantic import Field

from gaplab.schemas.base import Frozen, Real
from gaplab.services.core.arrays import FloatArray, Genome, frozen
from gaplab.services.core.space import Space
from gaplab.services.world.controllers.base import Controller
from gaplab.services.world.controllers.parts import Scaling, Senses, clock, middles, swings, weighted, with_constants
from gaplab.services.world.motions import NO_MEMORY, Loop
from gaplab.services.world.world import World

KNOWN_SWING = 0.5
"""Part of the swing that each actuator of the known genome moves to each side."""


class MlpOptions(Frozen):
    """Options of the controller `mlp`."""

    senses: Senses = Field(
        default=("angles", "tilt", "turning"),
        description="groups of observations, separated by commas: angles, speeds, tilt, turning, contacts",
    )
    hidden: Annotated[int, Field(strict=True, ge=1, le=256)] = Field(
        default=8, description="neurons of the hidden layer"
    )
    period_s: Annotated[Real, Field(ge=0.001, le=10)] = Field(default=0.02, description="interval between new targets")
    clock_s: Annotated[Real, Field(ge=0, le=60)] = Field(
        default=0.5, description="period of the sine and the cosine of time among the inputs; 0: there is no clock"
    )
    weight: Annotated[Real, Field(gt=0, le=100)] = Field(default=2.0, description="weight at gene value 1")
    amplitude: Annotated[Real, Field(gt=0, le=10)] = Field(
        default=1.0, description="farthest target, as a factor of each joint's usual swing"
    )


class Mlp(Controller):
    """A network that observes the robot and a clock, and sets the targets: one hidden layer, tanh throughout.

    With inputs z (scaled observations, clock, and 1), the hidden neurons are h = tanh(W z), and the targets are
    m + A s tanh(V (h, 1)), with each joint's middle m, its swing s and the options' amplitude A. The genes are W, row
    by row, then V, each in [-1, 1], times the options' weight. The known genome follows the clock alone.
    """

    name = "mlp"
    source = "gaplab; the usual feedforward policy of the field"
    loops = True
    Options = MlpOptions
    options: MlpOptions

    def prepare(self, world: World, observe_s: FloatArray) -> None:
        """Compute what all loops share."""
        options, actuators = self.options, len(world.actuators)
        self._scaled = Scaling(world, options.senses)
        constants = 2 if options.clock_s else 0
        self._inputs = self._scaled.size + constants + 1
        size = options.hidden * self._inputs + actuators * (options.hidden + 1)
        self.space = Space.box([-1.0] * size, [1.0] * size)
        self._middles, self._swings = middles(world), swings(world, options.amplitude)
        self.known = self._following_the_clock(actuators)
        self._observe_s, self._act = observe_s, self.act

    def motion(self, genome: Genome) -> Loop:
        """Return the loop of the network."""
        return Loop(self._act, self.options.senses, genome, NO_MEMORY, self.options.period_s, self._observe_s)

    def act(
        self, genomes: FloatArray, observations: FloatArray, memory: FloatArray, time_s: float
    ) -> tuple[FloatArray, FloatArray]:
        """Return targets `(n, a)`, and the memories, which are empty."""
        count, hidden = len(genomes), self.options.hidden
        weights = self.options.weight * genomes
        inner = weights[:, : hidden * self._inputs].reshape(count, hidden, self._inputs)
        outer = weights[:, hidden * self._inputs :].reshape(count, -1, hidden + 1)
        inputs = with_constants(self._scaled(observations), (*clock(time_s, self.options.clock_s), 1.0))
        neurons = with_constants(np.tanh(weighted(inner, inputs)), (1.0,))
        return self._middles + self._swings * np.tanh(weighted(outer, neurons)), memory

    def _following_the_clock(self, actuators: int) -> Genome:
        """Return a genome whose first hidden neuron follows the clock, and all actuators that neuron."""
        hidden = self.options.hidden
        inner, outer = np.zeros((hidden, self._inputs)), np.zeros((actuators, hidden + 1))
        inner[0, -2 if self.options.clock_s else -1] = 1 / max(self.options.weight, 1.0)
        outer[:, 0] = KNOWN_SWING / max(self.options.weight, KNOWN_SWING)
        return frozen([*inner.ravel(), *outer.ravel()])
