"""Robots from files, in each engine: do they stand, what does a search reach, and do the engines rank gaits alike?

`python -m benchmarks.real_robots` prints the tables of docs/robots.md. The robots are those of pybullet_data and
gymnasium, imported as tests/real_robots.py says. Each engine that honours what a robot needs

- holds its joints where they start, for three seconds;
- searches for a controller with CMA-ES, from the usual one;
- rates the same random controllers, and the table has Spearman's correlation between their fitness in two engines.
"""

from argparse import ArgumentParser
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations
from time import process_time

import numpy as np
from numpy.random import default_rng
from scipy.stats import spearmanr

from gaplab.schemas.plugin import PluginRef
from gaplab.services.core import robot_library
from gaplab.services.core.arrays import FloatArray, frozen
from gaplab.services.core.motions import Motion
from gaplab.services.core.optimizers import optimizers
from gaplab.services.core.robots.robot_file import Imported, ImportedOptions
from gaplab.services.core.search import Question, maximise
from gaplab.services.core.world import World
from gaplab.services.engines import engines
from gaplab.services.engines.base import Engine
from gaplab.services.specs.assembly import engine_of
from gaplab.services.specs.simulation import Simulation
from tests.real_robots import FILES, imported

NOTHING = np.empty((1, 0))
"""The simulator without tunables: the robot as its file has it."""

HELD_S = 3.0
SEED = 16


@dataclass(frozen=True)
class Measured:
    """What one engine showed of one robot.

    Attributes:
        moved_m: how far the observed body moved while the joints were held.
        tilt_deg: how far the base turned meanwhile.
        known: fitness of the usual controller.
        found: fitness of the best controller of the search.
        rollout_ms: processor time of a rollout.
        fitnesses: `(n,)`: of the random controllers.
    """

    moved_m: float
    tilt_deg: float
    known: float
    found: float
    rollout_ms: float
    fitnesses: FloatArray


def main() -> None:
    """Print the tables."""
    parser = ArgumentParser(prog="python -m benchmarks.real_robots", description=__doc__)
    parser.add_argument("--robots", nargs="+", choices=FILES, default=list(FILES))
    parser.add_argument("--gaits", type=int, default=100, help="random controllers")
    parser.add_argument("--evaluations", type=int, default=500, help="rollouts of a search")
    arguments = parser.parse_args()
    able = [name for name, each in engines.items() if name != "analytic" and each.available()]
    lines: list[str] = []
    print("| robot | engine | moved, cm | turned, ° | usual controller | after a search | a rollout, ms |")
    print("|---|---|---|---|---|---|---|")
    for name in arguments.robots:
        robot, world, unit = prepared(name)
        measured: dict[str, Measured] = {}
        for engine in able:
            if lacks := engines[engine].lacks(world):
                print(f"| {name} | {engine} | lacks {lacks} | | | | |")
                continue
            found = measured[engine] = measure(
                robot, engine_of(PluginRef(name=engine)), arguments.gaits, arguments.evaluations
            )
            print(
                f"| {name} | {engine} | {100 * found.moved_m:.1f} | {found.tilt_deg:.1f} | {found.known:.3f} {unit} "
                f"| {found.found:.3f} {unit} | {found.rollout_ms:.1f} |",
                flush=True,
            )
        lines += correlations(name, measured)
    print("\n| robot | engines | Spearman's correlation | 95 % interval | controllers |\n|---|---|---|---|---|")
    print("\n".join(lines))


def prepared(name: str) -> tuple[Imported, World, str]:
    """Return a robot with its usual controller and task, its world, and the unit of its fitness."""
    file = imported(name).robot
    robot_library.learn([file.text])
    robot = Imported(ImportedOptions(sha256=file.sha256, name=name))
    return robot, robot.world, robot.unit


def measure(robot: Imported, engine: Engine, gaits: int, evaluations: int) -> Measured:
    """Return what an engine shows of a robot."""
    simulation = Simulation(robot, engine, [])
    known = float(simulation(robot.known[None], NOTHING)[0, 0])
    genomes = robot.space.draw(gaits, default_rng(SEED))
    began = process_time()
    fitnesses = simulation(genomes, NOTHING)[:, 0]
    rollout_ms = 1e3 * (process_time() - began) / gaits

    def evaluate(question: Question) -> FloatArray:
        return simulation(question.genomes, NOTHING)[:, 0]

    cma_es = optimizers.create(PluginRef(name="cma_es"))
    best = maximise(cma_es, robot.space, evaluate, evaluations, default_rng(SEED), robot.known[None])
    moved_m, tilt_deg = held(robot.world, engine)
    return Measured(moved_m, tilt_deg, known, float(best.fitness[0]), rollout_ms, fitnesses)


def held(world: World, engine: Engine) -> tuple[float, float]:
    """Return how far the observed body moves, m, and the base turns, °, while all joints are held where they start."""
    starts = np.array([joint.start for joint in world.actuators])
    motion = Motion(frozen([0.0]), frozen([starts]), frozen([0.1, HELD_S]))
    seen = engine.record(world, motion, frozen([1.0, HELD_S]))
    first, last = seen.trajectory.positions_m
    agreement = abs(float(np.sum(seen.poses[-1, 3:] * world.start_turn)))
    return float(np.linalg.norm(last - first)), float(np.degrees(2 * np.arccos(min(agreement, 1.0))))


def correlations(name: str, measured: dict[str, Measured]) -> Iterator[str]:
    """Yield a row for each two engines."""
    for first, second in combinations(measured, 2):
        pairs = np.column_stack([measured[first].fitnesses, measured[second].fitnesses])
        pairs = pairs[np.isfinite(pairs).all(axis=1)]
        found = spearmanr(*pairs.T).statistic
        low, high = np.tanh(np.arctanh(found) + np.array([-1.96, 1.96]) / np.sqrt(len(pairs) - 3))
        yield f"| {name} | {first}, {second} | {found:.2f} | {low:.2f} to {high:.2f} | {len(pairs)} |"


if __name__ == "__main__":
    main()
