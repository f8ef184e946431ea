"""Noise of commands and observations, drawn by address: the same genome has the same draws in every simulator.

Draws are standard normal numbers that the noise of each world scales: common random numbers, so that simulators differ
by their parameters alone. An evaluation is a function of genome and parameters, as without noise.
"""

from dataclasses import replace
from hashlib import sha256

import numpy as np
from numpy.random import Generator

from gaplab.services.core.arrays import FloatArray, Genome, frozen
from gaplab.services.core.motions import LEVEL, Loop, Motion, Tilt
from gaplab.services.core.observations import noises
from gaplab.services.core.streams import stream
from gaplab.services.core.world import Noise, World

QUIET = Noise()
"""No noise, and no latency."""

SEED = 0
"""Seed of all noise: the same for every experiment, so that an evaluation does not depend on the experiment."""


def stream_of(genome: Genome, purpose: str) -> Generator:
    """Return the random generator of a genome `(g,)`, at the address of its digest.

    Args:
        genome: its numbers, to the last bit.
        purpose: use of the numbers; different purposes are independent.
    """
    digest = sha256(np.ascontiguousarray(genome, dtype=np.float64).tobytes()).hexdigest()
    return stream(SEED, purpose, digest, 0)  # the 0 is part of the address: without it, all draws would change


def disturbed(world: World, motion: Motion | Loop, genome: Genome) -> Motion | Loop:
    """Return the motion or the loop of a genome `(g,)`, the address of the draws, with noise and latency of a world.

    A target is disturbed when it changes, and stays so until it changes again. A longer rollout has the same noise, and
    more of it.
    """
    if world.noise == QUIET:
        return motion
    commands = stream_of(genome, "noise of targets")
    tilt = _tilt(world, genome)
    if isinstance(motion, Motion):
        targets = _disturbed(motion.targets, world.noise.target, commands)
        return replace(motion, targets=targets, start_tilt_rad=tilt)
    scales = noises(world, motion.senses, world.noise)
    seen = stream_of(genome, "noise of observations").standard_normal((motion.ticks, len(scales)))
    sent = commands.standard_normal((motion.ticks, len(world.actuators)))
    return replace(
        motion,
        observation_noise=frozen(scales * seen),
        target_noise=frozen(world.noise.target * sent),
        latency_s=world.noise.latency_s,
        start_tilt_rad=tilt,
    )


def _tilt(world: World, genome: Genome) -> Tilt:
    if not world.noise.start_tilt_rad:
        return LEVEL
    x, y = (world.noise.start_tilt_rad * stream_of(genome, "noise of the start").standard_normal(2)).tolist()
    return x, y


def _disturbed(targets: FloatArray, deviation: float, rng: Generator) -> FloatArray:
    """Return targets `(k, a)`, each with the noise of the time at which it was last changed."""
    if not deviation:
        return targets
    changes = np.zeros(targets.shape, dtype=int)
    changes[1:] = np.where(targets[1:] != targets[:-1], np.arange(1, len(targets))[:, None], 0)
    latest = np.maximum.accumulate(changes)
    return frozen(targets + deviation * np.take_along_axis(rng.standard_normal(targets.shape), latest, axis=0))
