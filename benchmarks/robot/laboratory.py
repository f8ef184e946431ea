"""The quadruped in reality and in simulators, and controllers evolved in them."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from gaplab.services.core.arrays import FloatArray, Genome
from gaplab.services.core.optimizers.steady_state import SteadyState
from gaplab.services.core.robots.quadruped import COUNTED_S, SETTLING_S, Quadruped, QuadrupedOptions
from gaplab.services.core.search import maximise
from gaplab.services.core.space import Space
from gaplab.services.core.streams import stream
from gaplab.services.core.tunables import tunables
from gaplab.services.engines.pybullet import PyBullet
from gaplab.services.specs.simulation import Simulation

NAMES = ("static_friction", "dynamic_friction", "restitution")
EPISODE_S = SETTLING_S + COUNTED_S
SAMPLING_S = 0.05
"""Interval between observations of a robot."""


class Laboratory:
    """The robot in reality and in simulators with three tunables.

    Args:
        evaluations: evaluations of each search for a controller.
        folder: folder for evolved controllers, shared with later tables and other processes.
    """

    def __init__(self, evaluations: int, folder: Path) -> None:
        self.evaluations = evaluations
        self.folder = folder
        self.robot = Quadruped()
        self.engine = PyBullet()
        edits = [tunables[name]() for name in NAMES]
        self.simulate = Simulation(self.robot, self.engine, edits)
        self.truth = np.array([edit.read(self.robot.world) for edit in edits])
        self.parameters = Space.box([edit.lower for edit in edits], [edit.upper for edit in edits])

    def real(self, genome: Genome) -> float:
        """Return the fitness of the genome `(g,)` in reality."""
        return float(self.simulate(genome[None], self.truth[None])[0, 0])

    def random(self, seed: int) -> FloatArray:
        """Return a simulator `(3,)`, drawn uniformly within the bounds of the tunables."""
        drawn: FloatArray = self.parameters.draw(1, stream(seed, "random simulator"))[0]
        return drawn

    def in_reality(self, seed: int) -> Genome:
        """Return a controller evolved in reality."""
        return self.evolve(self.truth, "direct", seed)

    def in_random(self, seed: int) -> Genome:
        """Return a controller evolved in a random simulator."""
        return self.evolve(self.random(seed), "random", seed)

    def evolve(self, parameters: FloatArray, *address: str | int) -> Genome:
        """Return the fittest controller that the budget finds in a simulator `(3,)`."""
        file = self.folder / f"{self.evaluations}-{'-'.join(map(str, address))}.npy"
        if not file.exists():
            fittest = maximise(
                SteadyState(),
                self.robot.space,
                lambda asked: self.simulate(asked.genomes, parameters[None])[:, 0],
                self.evaluations,
                stream(0, *address),
            )
            np.save(file, fittest.genomes[0])
        genome: Genome = np.load(file)
        return genome

    def direct(self, seeds: int) -> list[float]:
        """Return the fitness of controllers evolved in reality."""
        return [self.real(self.in_reality(seed)) for seed in range(seeds)]

    def observe(self, genome: Genome, duration_s: float) -> tuple[FloatArray, FloatArray]:
        """Return positions `(t, 3)` and tilts `(t,)` in degrees, from time 0 on, in reality."""
        robot = Quadruped(QuadrupedOptions(counted_s=duration_s - SETTLING_S))
        motion = replace(robot.motion(genome), observe_s=np.arange(0.0, duration_s + SAMPLING_S / 2, SAMPLING_S))
        trajectory = self.engine.rollout(robot.world, motion)
        return trajectory.positions_m, tilts(trajectory.orientations)


def tilts(orientations: FloatArray) -> FloatArray:
    """Return the angles between the robot's vertical axis and the world's, in degrees."""
    x, y = orientations[..., 0], orientations[..., 1]
    return np.degrees(np.arccos(np.clip(1 - 2 * (x**2 + y**2), -1, 1)))
