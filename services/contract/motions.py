"""What the contracts of controllers and robots ask of motions."""

from typing import Protocol

import numpy as np

from gaplab.services.core.arrays import FloatArray, Genome, Genomes
from gaplab.services.core.motions import Loop, Motion
from gaplab.services.core.observations import names
from gaplab.services.core.world import World

CALLS = 12
"""Calls of `act` whose numbers are compared."""


class Moves(Protocol):
    """A controller or a robot."""

    def motion(self, genome: Genome) -> Motion | Loop:
        """Return the motion that the genome `(g,)` describes."""
        ...


def check_targets(motion: Motion, actuators: int) -> None:
    """Check that a motion has finite targets for each actuator, at times that ascend from 0.

    Raises:
        AssertionError: it has not.
    """
    expected = (len(motion.times_s), actuators)
    assert np.shape(motion.targets) == expected, f"targets have the shape {np.shape(motion.targets)}, not {expected}"
    assert np.isfinite(motion.targets).all(), "targets are not finite"
    assert motion.times_s[0] == 0.0, f"times_s begin at {motion.times_s[0]}, not at 0"
    assert np.all(np.diff(motion.times_s) > 0), "times_s do not ascend"


def numbers(mover: Moves, world: World, genomes: Genomes) -> FloatArray:
    """Return the numbers of each genome, `(k, n, ...)`: targets; of a loop also memories, of a few calls.

    Raises:
        AssertionError: `act` returns targets or memories of another shape.
    """
    loops = [mover.motion(genome) for genome in genomes]
    if not isinstance(loops[0], Loop):
        return np.array([[each.targets for each in loops if not isinstance(each, Loop)]])
    first = loops[0]
    count = len(names(world, first.senses))
    memories = np.array([each.memory for each in loops if isinstance(each, Loop)])
    found = []
    for tick in range(CALLS):
        observations = np.array([_seen(genome, tick, count) for genome in genomes])
        targets, memories = first.act(genomes, observations, memories, tick * first.period_s)
        expected = (len(genomes), len(world.actuators))
        assert np.shape(targets) == expected, f"act returned targets of shape {np.shape(targets)}, not {expected}"
        assert np.shape(memories) == (len(genomes), len(first.memory)), f"act returned {np.shape(memories)} as memories"
        found.append(np.hstack([targets, memories]))
    return np.array(found)


def _seen(genome: Genome, tick: int, count: int) -> FloatArray:
    """Return some observations `(count,)` that belong to a genome and a call."""
    return np.random.default_rng([tick, *np.frombuffer(genome.tobytes(), dtype=np.uint32)]).normal(size=count)
