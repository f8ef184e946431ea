"""Pulses that are corrected on line, by the difference between the expected and the observed motion."""

from typing import Annotated

import numpy as np
from pydantic import Field

from gaplab.schemas.base import Frozen, Real
from gaplab.services.core.arrays import FloatArray, Genome, frozen
from gaplab.services.core.controllers.base import Controller
from gaplab.services.core.controllers.parts import Limbs, follows_angle, middles
from gaplab.services.core.controllers.square_pulses import Pulses
from gaplab.services.core.kinematics import inverse, rotated
from gaplab.services.core.motions import Loop
from gaplab.services.core.space import Space
from gaplab.services.core.world import World

LEAST_UPRIGHT = 0.9
"""Least vertical component of the axis of a joint that turns the robot."""


class AnticipatingOptions(Frozen):
    """Options of `anticipating`."""

    gain: Annotated[Real, Field(ge=0, le=10)] = Field(
        default=0.5, description="share of the error of each angle that is added to its target; gaplab's default"
    )
    heading_gain: Annotated[Real, Field(ge=0, le=10)] = Field(
        default=0.5, description="share of the turn from the first heading by which upright joints turn back; gaplab's"
    )
    lag_s: Annotated[Real, Field(gt=0, le=10)] = Field(
        default=0.06, description="time constant with which an expected angle follows its target; gaplab's default"
    )
    period_s: Annotated[Real, Field(ge=0.001, le=10)] = Field(default=0.02, description="interval between new targets")
    pulse_s: Annotated[Real, Field(gt=0, le=60)] = Field(default=0.5, description="period of the pulses")
    amplitude: Annotated[Real, Field(gt=0, le=10)] = Field(
        default=1.0, description="amplitude of the pulses, as a factor of each joint's usual swing"
    )


class Anticipating(Controller):
    """Pulses as in `square_pulses`, plus a share of the error between the expected and the observed motion.

    The expected angle e of a joint follows the pulses' target u, de/dt = (u - e) / `lag_s`, from the joint's start; the
    expected heading is the first one. With the observed angle q, and the turn ψ, summed up from the angular velocity
    about the axis of the base that is upright at the start, the target is u + gain (e - q) - heading_gain · ψ · z.
    There z is 1 for an axis that points upwards, -1 downwards, and 0 for one that is not upright.

    Joints whose motors follow speeds or torques are not corrected. Genes are those of the pulses.
    """

    name = "anticipating"
    source = "after Hartland and Bredeche 2006, whose law and model are not published; both are gaplab's"
    loops = True
    Options = AnticipatingOptions
    options: AnticipatingOptions

    _senses = ("angles", "turning")

    def prepare(self, world: World, observe_s: FloatArray) -> None:
        """Compute what all loops share."""
        options = self.options
        self._pulses = Pulses(world, options.pulse_s, options.amplitude)
        self.space = Space.box([0.0] * self._pulses.genes, [1.0] * self._pulses.genes, self._pulses.wraps)
        self.known = self._pulses.known
        follows = np.array([follows_angle(joint) for joint in world.actuators])
        upward = Limbs.of(world).upward
        upright = np.where(follows & (np.abs(upward) > LEAST_UPRIGHT), np.sign(upward), 0.0)
        self._gains = frozen(options.gain * follows)
        self._turning_back = frozen(-options.heading_gain * upright)
        self._up = rotated(inverse(np.array(world.start_turn)), np.array([0.0, 0.0, 1.0]))
        self._closer = 1 - float(np.exp(-options.period_s / options.lag_s))
        self._memory = frozen([*middles(world), 0.0])
        self._observe_s, self._act = observe_s, self.act

    def motion(self, genome: Genome) -> Loop:
        """Return the loop of the genome; its memory is the expected angles, then the turn."""
        return Loop(self._act, self._senses, genome, self._memory, self.options.period_s, self._observe_s)

    def act(
        self, genomes: FloatArray, observations: FloatArray, memory: FloatArray, time_s: float
    ) -> tuple[FloatArray, FloatArray]:
        """Return targets `(n, a)`, and the expected angles and the turn at the next call."""
        angles = observations[:, :-3]
        spin = sum(observations[:, axis - 3, None] * self._up[axis] for axis in range(3))
        expected, turn = memory[:, :-1], memory[:, -1:]
        pulses = self._pulses.targets(genomes, time_s)
        targets = pulses + self._gains * (expected - angles) + self._turning_back * turn
        later = expected + self._closer * (pulses - expected)
        return targets, np.hstack([later, turn + self.options.period_s * spin])
