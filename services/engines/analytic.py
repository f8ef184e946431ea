"""A closed formula in place of physics, with which all of gaplab runs in seconds."""

from collections.abc import Sequence

import numpy as np

from gaplab.services.core.arrays import FloatArray
from gaplab.services.engines.base import Engine
from gaplab.services.world.motions import Loop, Motion, Trajectory, open_loop
from gaplab.services.world.world import World


class Analytic(Engine):
    """A formula for worlds without bodies: the base glides along x, at a speed given by one target and the material.

    The speed has a broad hill, a narrow peak and ripples. The three coefficients move their places and heights, so a
    search in a wrong simulator climbs the wrong slope. Most controllers reveal little about the place of the peak.
    """

    name = "analytic"
    source = "Paper, section 2, Fig. 3 shows such a function; this one is gaplab's"
    honours = frozenset({"material.static_friction", "material.dynamic_friction", "material.restitution"})
    batch = 1_000
    repeatable = True
    usual_rollout_s = 1e-4

    @classmethod
    def runs(cls, world: World) -> bool:
        """Return whether the world has no bodies."""
        return not world.bodies

    def rollout(self, world: World, motion: Motion | Loop) -> Trajectory:
        """Return the glide of one motion in one world."""
        glides = self.rollouts([world], [motion])
        return Trajectory(motion.observe_s, glides.positions_m[0, 0], glides.orientations[0, 0])

    def rollouts(self, worlds: Sequence[World], motions: Sequence[Motion | Loop]) -> Trajectory:
        """Return all glides at once."""
        if any(motion.joints or motion.start is not None for motion in motions):
            raise TypeError("a formula has no joints, and its motion no start")
        materials = [each.material for each in worlds]
        coefficients = np.array([(each.static_friction, each.dynamic_friction, each.restitution) for each in materials])
        targets = np.array([open_loop(motion).targets[0, 0] for motion in motions])
        times_s = motions[0].observe_s
        positions_m = np.zeros((len(motions), len(worlds), len(times_s), 3))
        positions_m[..., 0] = speed(targets[:, None], *coefficients.T)[..., None] * times_s
        upright = np.broadcast_to([0.0, 0.0, 0.0, 1.0], (*positions_m.shape[:3], 4))
        return Trajectory(times_s, positions_m, upright)


def speed(
    target: FloatArray, static_friction: FloatArray, dynamic_friction: FloatArray, restitution: FloatArray
) -> FloatArray:
    """Return the speed in m/s at a target in [0, 1] with the three coefficients; all arguments broadcast."""
    hill = 0.5 * _bump((target - 0.9 + 0.5 * dynamic_friction) / 0.3)
    peak = (0.5 - 0.4 * restitution) * _bump((target - 0.2 - 0.4 * static_friction) / 0.1)
    ripple = 0.1 * np.sin(2 * np.pi * (4.0 * target + 1.5 * dynamic_friction - 2.0 * restitution))
    return np.asarray(0.1 + hill + peak + ripple)


def _bump(distance: FloatArray) -> FloatArray:
    return np.asarray(np.exp(-(distance**2)))
