"""Controllers that swing: each actuator a sine, or coupled oscillators of phase, a central pattern generator."""

from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gaplab.schemas.base import Frozen, Real
from gaplab.services.core.arrays import FloatArray, Genome, frozen
from gaplab.services.core.space import Space
from gaplab.services.world.controllers.base import Controller
from gaplab.services.world.controllers.parts import Limbs, middles, sampled, sampling_times_s, swings
from gaplab.services.world.motions import Motion
from gaplab.services.world.world import World

QUARTER = 0.25
"""Phase by which each further joint of a limb is ahead in the known genome, so that a foot moves on a loop."""


class SineOptions(Frozen):
    """Options of the controller `sine`."""

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


INTEGRATED_S = 0.005
"""Largest step of the integration of phases."""


class CpgOptions(Frozen):
    """Options of the controller `cpg`."""

    gait: Literal["free", "trot", "pace", "bound", "walk"] = Field(
        default="free",
        description="`free`: a gene is the phase of each actuator; else the limbs have the phases of this gait, and "
        "a gene is the phase of all joints that are equally far from the base",
    )
    frequencies: Literal["common", "own"] = Field(
        default="common",
        description="`own`: each actuator has a frequency of its own, and coupling pulls them together",
    )
    slowest_hz: Annotated[Real, Field(gt=0, le=50)] = Field(default=0.5, description="frequency at gene value 0")
    fastest_hz: Annotated[Real, Field(gt=0, le=50)] = Field(default=3.0, description="frequency at gene value 1")
    coupling_hz: Annotated[Real, Field(ge=0, le=60)] = Field(
        default=4.0, description="strength of the coupling of phases; gaplab's default"
    )
    convergence_hz: Annotated[Real, Field(gt=0, le=1_000)] = Field(
        default=20.0,
        description="rate at which amplitudes and offsets approach those of the genome from 0; authors': 20",
    )
    amplitude: Annotated[Real, Field(gt=0, le=10)] = Field(
        default=1.0, description="largest amplitude and largest offset, as a factor of each joint's usual swing"
    )
    command_s: Annotated[Real, Field(ge=0.001, le=1)] = Field(default=0.02, description="interval between new targets")


class Cpg(Controller):
    """Coupled oscillators of phase, frequency, amplitude and offset, one for each actuator.

    An oscillator has the phase θ, the amplitude r and the offset x. Its phase advances by
    dθ/dt = 2π f + k · mean over all j of sin((θⱼ - φⱼ) - (θ - φ)), with the genome's phase φ, at which θ starts, and
    the coupling k = 2π `coupling_hz`. The amplitude approaches the genome's R from 0 by
    d²r/dt² = a (a/4 (R - r) - dr/dt), and the offset likewise. The target is m + A s (x + r cos θ), with the joint's
    middle m, its swing s and the options' amplitude A. Nothing is fed back, so it is an open-loop motion.

    The genes are the frequencies, one or a, then the phases, a or one for each depth of joints, which wrap around,
    then a amplitudes, all in [0, 1], and a offsets in [-1, 1].
    """

    name = "cpg"
    source = "Ijspeert, Crespi, Ryczko and Cabelguen 2007; the coupling of all to all, and the numbers, are gaplab's"
    Options = CpgOptions
    options: CpgOptions

    def prepare(self, world: World, observe_s: FloatArray) -> None:
        """Compute what all motions share."""
        options, actuators, limbs = self.options, len(world.actuators), Limbs.of(world)
        frequencies = actuators if options.frequencies == "own" else 1
        if options.gait == "free":
            self._limb_phases = np.zeros(actuators)
            self._phase_of: NDArray[np.int_] = np.arange(actuators)
            phases = frozen((limbs.phases("trot")[limbs.limb] + QUARTER * limbs.depth) % 1)
        else:
            self._limb_phases = limbs.phases(options.gait)[limbs.limb]
            self._phase_of = limbs.depth
            phases = frozen(QUARTER * np.arange(limbs.depth.max() + 1) % 1)
        self._ends = np.cumsum([frequencies, len(phases), actuators])
        positive = frequencies + len(phases) + actuators
        wraps = [False] * frequencies + [True] * len(phases) + [False] * 2 * actuators
        self.space = Space.box([0.0] * positive + [-1.0] * actuators, [1.0] * (positive + actuators), wraps)
        self.known = frozen([*[0.5] * frequencies, *phases, *[0.5] * actuators, *[0.0] * actuators])
        self._middles, self._swings = middles(world), swings(world, options.amplitude)
        self._times_s, self._observe_s = sampling_times_s(observe_s, options.command_s), observe_s
        rate = options.convergence_hz / 2 * self._times_s  # the equation is linear: this is its solution
        self._grown = frozen(1 - (1 + rate) * np.exp(-rate))[:, None]

    def motion(self, genome: Genome) -> Motion:
        """Return the motion, sampled at the interval of the options."""
        frequencies, phases, amplitudes, offsets = np.split(genome, self._ends)
        slowest, fastest = self.options.slowest_hz, self.options.fastest_hz
        speeds = 2 * np.pi * (slowest + (fastest - slowest) * frequencies)
        lags = 2 * np.pi * (self._limb_phases + phases[self._phase_of])
        values = self._grown * (offsets + amplitudes * np.cos(self._advances(speeds) + lags))
        return sampled(self._middles + self._swings * values, self._times_s, self._observe_s)

    def _advances(self, speeds: FloatArray) -> FloatArray:
        """Return how far the phases have advanced at each time, `(k, a)`, or `(k, 1)` if all have one speed.

        Oscillators of one speed that start in step stay in step: coupling is zero. Others are integrated by Euler's
        method.
        """
        if len(speeds) == 1:
            return self._times_s[:, None] * speeds
        steps = int(np.ceil(self.options.command_s / INTEGRATED_S))
        step_s, coupling = self.options.command_s / steps, 2 * np.pi * self.options.coupling_hz
        advances = np.empty((len(self._times_s), len(speeds)))
        now = np.zeros(len(speeds))
        for row in advances:
            row[:] = now
            for _ in range(steps):
                turns = np.exp(1j * now)
                now = now + step_s * (speeds + coupling * (turns.mean() * turns.conj()).imag)
        return advances
