"""Controllers of pulses: the paper's, and one that corrects them on line.

In the paper's, each actuator is extended and contracted by a periodic pulse of two genes. The other corrects the
pulses by the difference between the expected and the observed motion.
"""

from typing import Annotated

import numpy as np
from pydantic import Field

from gaplab.schemas.base import Frozen, Real
from gaplab.services.core.arrays import FloatArray, Genome, frozen
from gaplab.services.core.errors import InvalidSpec, Violation
from gaplab.services.core.space import Space
from gaplab.services.world.controllers.base import Controller
from gaplab.services.world.controllers.parts import Limbs, middles, swings
from gaplab.services.world.kinematics import inverse, rotated
from gaplab.services.world.motions import Loop, Motion
from gaplab.services.world.world import World

NARROWEST, WIDEST = 0.1, 0.9
"""Width of a pulse in periods, at gene values 0 and 1."""

MOST_TARGETS = 10_000_000
"""Most targets of a motion: of each actuator, whenever a pulse of any begins or ends; 80 MB."""


class SquarePulsesOptions(Frozen):
    """Options of the controller `square_pulses`."""

    period_s: Annotated[Real, Field(ge=0.001, le=60)] = Field(default=0.5, description="period of all pulses")
    amplitude: Annotated[Real, Field(gt=0, le=10)] = Field(
        default=1.0, description="amplitude, as a factor of each joint's usual swing"
    )


class SquarePulses(Controller):
    """A periodic pulse of phase and width for each actuator.

    Gene 2i is the phase of actuator i, and gene 2i + 1 the width of its pulse, both in [0, 1]; phases wrap around.
    During its pulse an actuator is at its middle plus its amplitude, else at its middle minus its amplitude. The middle
    is the start of the joint, or 0 for a motor that follows a speed or a torque.
    """

    name = "square_pulses"
    source = "Paper, section 2"
    Options = SquarePulsesOptions
    options: SquarePulsesOptions

    def prepare(self, world: World, observe_s: FloatArray) -> None:
        """Compute what all motions share; numpy is faster with these arrays than with numbers or rows to repeat.

        Raises:
            InvalidSpec: the pulses are so short that motions would not fit into memory.
        """
        actuators = len(world.actuators)
        self._refuse_too_many(actuators, float(observe_s[-1]))
        self.space = Space.box([0.0] * 2 * actuators, [1.0] * 2 * actuators, [True, False] * actuators)
        self.known = frozen([0.5] * 2 * actuators)
        self._observe_s, self._period_s = observe_s, self.options.period_s
        self._cycles = frozen(np.arange(np.ceil(observe_s[-1] / self._period_s))[:, None])
        self._narrowest, self._range = frozen([NARROWEST] * actuators), frozen([WIDEST - NARROWEST] * actuators)
        swing, rest = swings(world, self.options.amplitude)[:, None], middles(world)[:, None]
        times = 1 + 2 * actuators * self._cycles.size
        self._inside = frozen(np.repeat(rest + swing, times, axis=1))
        self._outside = frozen(np.repeat(rest - swing, times, axis=1))

    def _refuse_too_many(self, actuators: int, duration_s: float) -> None:
        period_s = self.options.period_s
        if 2 * actuators**2 * np.ceil(duration_s / period_s) > MOST_TARGETS:
            least_s = duration_s / max(1, MOST_TARGETS // (2 * actuators**2))
            message = f"{period_s:g} s is too short for motions of {duration_s:g} s with {actuators} actuators"
            permitted = f"at least {least_s:.3g} s, or a shorter motion"
            raise InvalidSpec([Violation("/controller/options/period_s", period_s, message, permitted)])

    def motion(self, genome: Genome) -> Motion:
        """Return the motion: each actuator is at plus its amplitude during its pulse, else at minus."""
        phases, widths = genome[0::2], self._narrowest + self._range * genome[1::2]
        ends = np.concatenate((phases, phases + widths))
        edges = ends - np.floor(ends)  # mod 1, to the last bit, in half the time
        edges.sort()
        times = np.empty(2 + self._cycles.size * edges.size)  # in periods, and a moment after the last
        times[0], times[1:-1] = 0.0, (self._cycles + edges).ravel()
        times[-1] = times[-2] + 1e-9
        since = (times[:-1] + times[1:]) / 2 - phases[:, None]
        since -= np.floor(since)
        targets = np.where(since < widths[:, None], self._inside, self._outside).T
        times_s, distinct = times[:-1] * self._period_s, times[:-1] != times[1:]
        if np.count_nonzero(distinct) < len(distinct):
            times_s, targets = times_s[distinct], targets[distinct]
        times_s.setflags(write=False)
        targets.setflags(write=False)
        return Motion(times_s, targets, self._observe_s)


class Pulses:
    """The targets of periodic pulses of phase and width.

    Attributes:
        genes: number of genes: gene 2i is the phase of actuator i, gene 2i + 1 the width of its pulse.
        wraps: `(genes,)`: whether each gene wraps around.
        known: `(genes,)`: a trot in which all joints of a limb move at once.
    """

    def __init__(self, world: World, period_s: float, amplitude: float) -> None:
        actuators, limbs = len(world.actuators), Limbs.of(world)
        self.genes = 2 * actuators
        self.wraps = [True, False] * actuators
        phases = limbs.phases("trot")[limbs.limb]
        self.known = frozen(np.column_stack([phases, np.full(actuators, 0.5)]).ravel())
        self._period_s = period_s
        self._middles, self._swings = middles(world), swings(world, amplitude)

    def targets(self, genomes: FloatArray, time_s: float) -> FloatArray:
        """Return the targets `(n, a)` of genomes `(n, ≥ genes)` at a time."""
        phases, widths = genomes[:, 0 : self.genes : 2], genomes[:, 1 : self.genes : 2]
        since = time_s / self._period_s - phases
        since = since - np.floor(since)
        inside = since < NARROWEST + (WIDEST - NARROWEST) * widths
        return self._middles + np.where(inside, self._swings, -self._swings)


LEAST_UPRIGHT = 0.9
"""Least vertical component of the axis of a joint that turns the robot."""


class AnticipatingOptions(Frozen):
    """Options of the controller `anticipating`."""

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
        follows = np.array([joint.follows == "position" for joint in world.actuators])
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
