"""Evidence that the quadruped is worth tuning: each command prints one table of docs/robot.md.

The code of experiments computes all numbers, with addressed random streams, so a command always prints the same ones.
Ratios are to the direct baseline: the mean fitness of controllers evolved in reality on the same budget.
"""

from argparse import ArgumentParser, Namespace
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from gaplab.services.core.answers import Answers
from gaplab.services.core.arrays import FloatArray, Genome
from gaplab.services.core.optimizers.steady_state import SteadyState
from gaplab.services.core.robots.quadruped import BODY_M, COUNTED_S, PERIOD_S, SETTLING_S, Quadruped, QuadrupedOptions
from gaplab.services.core.search import maximise
from gaplab.services.core.streams import stream
from gaplab.services.core.tunables import tunables
from gaplab.services.core.tuning import Misfit, squared_errors, tune
from gaplab.services.core.types import Sample, Space
from gaplab.services.core.world import Motion
from gaplab.services.engines.pybullet import PyBullet
from gaplab.services.specs.assembly import Simulation

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


def stands(laboratory: Laboratory, _: Namespace) -> None:
    """Print how the robot stands in its neutral pose."""
    times = np.array([0.0, 0.5, 1.0, 2.0, 4.0])
    neutral = Motion(np.zeros(1), np.zeros((1, len(laboratory.robot.world.actuators))), times)
    trajectory = laboratory.engine.rollout(laboratory.robot.world, neutral)
    heights, tilt = trajectory.positions_m[:, 2], tilts(trajectory.orientations)
    drift = np.linalg.norm((trajectory.positions_m - trajectory.positions_m[0])[:, :2], axis=1)
    rows = zip(times, heights, tilt, drift, strict=True)
    table("time s | height m | tilt ° | drift m", (f"{t:.1f} | {z:.4f} | {a:.2f} | {d:.4f}" for t, z, a, d in rows))


def walks(laboratory: Laboratory, arguments: Namespace) -> None:
    """Print how controllers evolved in reality walk for two episodes."""
    settled, counted = round(SETTLING_S / SAMPLING_S), round(COUNTED_S / SAMPLING_S)
    ratios, clearances = [], []

    def rows() -> Iterable[str]:
        for seed in range(arguments.seeds):
            positions, tilt = laboratory.observe(laboratory.in_reality(seed), EPISODE_S + COUNTED_S)
            paths = [positions[i : i + counted + 1] for i in (settled, settled + counted)]
            first, second = (distance(path) / COUNTED_S for path in paths)
            ahead = " | ".join(f"{(path[-1, 0] - path[0, 0]) / COUNTED_S:.2f}" for path in paths)
            ratios.append(second / first)
            clearances.append(positions[settled:, 2].min() - BODY_M[2] / 2)
            speeds = f"{first:.3f} | {second:.3f} | {ratios[-1]:.2f} | {ahead}"
            yield f"{seed} | {speeds} | {clearances[-1]:.3f} | {tilt[settled:].max():.0f}"

    table(
        "seed | speed m/s | second episode | ratio | along x | second, along x | least clearance m | greatest tilt °",
        rows(),
    )
    print(f"{COUNTED_S / PERIOD_S:.0f} gait periods count. Second over first: {mean_and_sd(ratios)}.")
    print(f"Clearance of the trunk's underside, m: {mean_and_sd(clearances)}.")


def gap(laboratory: Laboratory, arguments: Namespace) -> None:
    """Print the fitness in reality of controllers evolved in random simulators."""
    direct = laboratory.direct(arguments.seeds)
    ratios = []

    def rows() -> Iterable[str]:
        for seed in range(arguments.seeds):
            ratios.append(laboratory.real(laboratory.in_random(seed)) / float(np.mean(direct)))
            yield f"{seed} | {numbers(laboratory.random(seed))} | {ratios[-1]:.2f}"

    table("seed | static | dynamic | restitution | real fitness over direct", rows())
    print(f"Direct, m/s: {mean_and_sd(direct)}. Random simulators over direct: {mean_and_sd(ratios)}.")


def known(laboratory: Laboratory, arguments: Namespace) -> None:
    """Print the fitness of the hand-designed genome, and of the genomes that *Known fit* draws around it."""
    direct, genome = float(np.mean(laboratory.direct(arguments.seeds))), laboratory.robot.known
    added = stream(0, "known fit").random((100, len(genome))) / 4
    near = [laboratory.real(each) / direct for each in laboratory.robot.space.contain(genome + added)]
    far = [laboratory.real(each) / direct for each in laboratory.robot.space.draw(100, stream(0, "random genomes"))]
    at = laboratory.real(genome)
    rows = (
        f"hand-designed | {at:.3f} | {at / direct:.2f}",
        f"hand-designed plus U[0, 0.25], mean of 100 | | {mean_and_sd(near)}",
    )
    table("genome | m/s | over direct", (*rows, f"uniformly random, mean of 100 | | {mean_and_sd(far)}"))


def smooth(laboratory: Laboratory, arguments: Namespace) -> None:
    """Print the root mean squared error on ten samples along each coefficient, the others true, over direct."""
    genomes = np.array([laboratory.in_random(seed) for seed in range(10)])
    measured = np.array([laboratory.real(genome) for genome in genomes])
    direct = float(np.mean(laboratory.direct(arguments.seeds)))
    shares = np.linspace(0, 1, 31)
    for index, name in enumerate(NAMES):
        settings = np.tile(laboratory.truth, (len(shares), 1))
        settings[:, index] = laboratory.parameters.lower[index] + shares * laboratory.parameters.extent[index]
        errors = squared_errors(laboratory.simulate(genomes, settings), measured)
        profile = zip(settings[:, index], np.sqrt(errors / len(genomes)) / direct, strict=True)
        table(f"{name} | error over direct | ", (f"{at:.2f} | {error:.3f} | {bar(error)}" for at, error in profile))


def identifiable(laboratory: Laboratory, arguments: Namespace) -> None:
    """Print simulators tuned on samples, and the real fitness of controllers evolved in them."""
    genomes = [laboratory.in_random(seed) for seed in range(10)]
    samples = [Sample(genome, laboratory.real(genome)) for genome in genomes]
    found: dict[int, list[tuple[FloatArray, float]]] = {}

    def rows() -> Iterable[str]:
        for count in arguments.samples:
            for seed in range(arguments.tunings):
                rng = stream(seed, "tune", count)
                chosen = [samples[index] for index in rng.permutation(10)[:count]]
                misfit = Misfit(Answers(laboratory.simulate), chosen)
                best = tune(misfit, laboratory.parameters, SteadyState(), arguments.tuning, rng)[0]
                fitness = laboratory.real(laboratory.evolve(best.parameters, "tuned", arguments.tuning, count, seed))
                found.setdefault(count, []).append((best.parameters, fitness))
                error = np.sqrt(best.squared_error / count)
                yield f"{count} | {seed} | {numbers(best.parameters)} | {error:.4f} | {fitness:.3f}"

    table("samples | seed | static | dynamic | restitution | error m/s | real fitness m/s", rows())
    direct = float(np.mean(laboratory.direct(arguments.seeds)))
    for count, pairs in found.items():
        off = np.median([np.abs(parameters - laboratory.truth) for parameters, _ in pairs], axis=0)
        ratios = [fitness / direct for _, fitness in pairs]
        print(f"{count} samples: median |error| {numbers(off, ', ')}; real fitness over direct {mean_and_sd(ratios)}.")


def table(head: str, rows: Iterable[str]) -> None:
    """Print a Markdown table, row by row."""
    print(f"\n| {head} |\n|{'---|' * (head.count('|') + 1)}")
    for row in rows:
        print(f"| {row} |", flush=True)
    print()


def tilts(orientations: FloatArray) -> FloatArray:
    """Return the angles between the robot's vertical axis and the world's, in degrees."""
    x, y = orientations[..., 0], orientations[..., 1]
    return np.degrees(np.arccos(np.clip(1 - 2 * (x**2 + y**2), -1, 1)))


def distance(positions_m: FloatArray) -> float:
    """Return the distance over ground from the first to the last of positions `(t, 3)`."""
    return float(np.linalg.norm((positions_m[-1] - positions_m[0])[:2]))


def mean_and_sd(values: Sequence[float]) -> str:
    """Return mean ± standard deviation and number of values, as text."""
    return f"{np.mean(values):.3f} ± {np.std(values, ddof=1):.3f} (n = {len(values)})"


def numbers(values: FloatArray, between: str = " | ") -> str:
    """Return numbers as text."""
    return between.join(f"{value:.2f}" for value in values)


def bar(share: float) -> str:
    """Return a bar of text, with a block for each hundredth."""
    return "▪" * round(100 * share)


COMMANDS: dict[str, Callable[[Laboratory, Namespace], None]] = {
    function.__name__: function for function in (stands, walks, gap, known, smooth, identifiable)
}


def main() -> None:
    """Print the requested tables; tables of one call share evolved controllers."""
    parser = ArgumentParser(prog="python -m benchmarks.robot", description=__doc__)
    parser.add_argument("tables", nargs="+", choices=COMMANDS)
    parser.add_argument("--seeds", type=int, default=10, help="controllers evolved in reality")
    parser.add_argument("--evaluations", type=int, default=2_000, help="evaluations of each search for a controller")
    parser.add_argument("--samples", type=int, nargs="+", default=[1, 3, 10], help="identifiable: numbers of samples")
    parser.add_argument("--tunings", type=int, default=3, help="identifiable: tunings with each number of samples")
    parser.add_argument("--tuning", type=int, default=2_000, help="identifiable: evaluations of a tuning")
    parser.add_argument("--keep", type=Path, help="folder for evolved controllers, shared with other calls")
    arguments = parser.parse_args()
    with TemporaryDirectory() as temporary:
        folder = arguments.keep or Path(temporary)
        folder.mkdir(parents=True, exist_ok=True)
        for name in arguments.tables:
            COMMANDS[name](Laboratory(arguments.evaluations, folder), arguments)


if __name__ == "__main__":
    main()
