"""The pulses of `square_pulses` at one time, for controllers in a loop that add to them."""

import numpy as np

from gaplab.services.core.arrays import FloatArray, frozen
from gaplab.services.core.controllers.actuation import Limbs, middles, swings
from gaplab.services.core.controllers.square_pulses import NARROWEST, WIDEST
from gaplab.services.core.world import World


class Pulses:
    """The targets of periodic pulses of phase and width.

    Attributes:
        genes: number of genes: gene 2i is the phase of actuator i, gene 2i + 1 the width of its pulse.
        wraps: `(genes,)`: whether each gene wraps around.
        known: `(genes,)`: a trot in which all joints of a limb move at once.

    Args:
        world: robot.
        period_s: period of all pulses.
        amplitude: factor of each joint's usual swing.
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
