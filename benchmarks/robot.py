"""The evidence that the quadruped is worth tuning: each command prints one table of docs/robot.md.

Everything is computed by the code that experiments run, with random streams at addresses: the same command prints the
same numbers. Ratios are to the direct baseline: the mean fitness of controllers evolved in reality on the same budget.
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
LOOK_S = 0.05
"""How often a watched robot is looked at."""


class Laboratory:
    """The robot in its reality and in simulators of three tunables.

    Args:
        evaluations: of each search for a controller.
        kept: a folder in which evolved controllers are kept, for later tables and for other processes.
    """

    def __init__(self, evaluations: int, kept: Path) -> None:
        self.evaluations = evaluations
        self.kept = kept
        self.robot = Quadruped()
        self.engine = PyBullet()
        edits = [tunables[name]() for name in NAMES]
        self.simulate = Simulation(self.robot, self.engine, edits)
        self.truth = np.array([edit.read(self.robot.world) for edit in edits])
        self.parameters = Space.box([edit.lower for edit in edits], [edit.upper for edit in edits])

    def real(self, genome: Genome) -> float:
        """The fitness of the genome `(g,)` in reality."""
        return float(self.simulate(genome[None], self.truth[None])[0, 0])

    def random(self, seed: int) -> FloatArray:
        """`(3,)`: a simulator drawn uniformly within the bounds of the tunables."""
        drawn: FloatArray = self.parameters.draw(1, stream(seed, "random simulator"))[0]
        return drawn

    def in_reality(self, seed: int) -> Genome:
        """A controller evolved in reality."""
        return self.evolve(self.truth, "direct", seed)

    def in_random(self, seed: int) -> Genome:
        """A controller evolved in a random simulator."""
        return self.evolve(self.random(seed), "random", seed)

    def evolve(self, parameters: FloatArray, *address: str | int) -> Genome:
        """The fittest controller that the budget finds in a simulator `(3,)`."""
        file = self.kept / f"{self.evaluations}-{'-'.join(map(str, address))}.npy"
        if not file.exists():
            found = maximise(
                SteadyState(),
                self.robot.space,
                lambda asked: self.simulate(asked.genomes, parameters[None])[:, 0],
                self.evaluations,
                stream(0, *address),
            )
            np.save(file, found.genomes[0])
        genome: Genome = np.load(file)
        return genome

    def direct(self, seeds: int) -> list[float]:
        """Fitness of controllers evolved in reality."""
        return [self.real(self.in_reality(seed)) for seed in range(seeds)]

    def watch(self, genome: Genome, duration_s: float) -> tuple[FloatArray, FloatArray]:
        """Positions `(t, 3)` and tilts `(t,)` in degrees from time 0 on, in reality."""
        robot = Quadruped(QuadrupedOptions(counted_s=duration_s - SETTLING_S))
        motion = replace(robot.motion(genome), observe_s=np.arange(0.0, duration_s + LOOK_S / 2, LOOK_S))
        trajectory = self.engine.rollout(robot.world, motion)
        return trajectory.positions_m, tilts(trajectory.orientations)


def stands(laboratory: Laboratory, _: Namespace) -> None:
    """The robot left alone in its neutral pose."""
    times = np.array([0.0, 0.5, 1.0, 2.0, 4.0])
    alone = Motion(np.zeros(1), np.zeros((1, len(laboratory.robot.world.actuators))), times)
    trajectory = laboratory.engine.rollout(laboratory.robot.world, alone)
    heights, tilt = trajectory.positions_m[:, 2], tilts(trajectory.orientations)
    drift = np.linalg.norm((trajectory.positions_m - trajectory.positions_m[0])[:, :2], axis=1)
    rows = zip(times, heights, tilt, drift, strict=True)
    table("time s | height m | tilt ° | drift m", (f"{t:.1f} | {z:.4f} | {a:.2f} | {d:.4f}" for t, z, a, d in rows))


def walks(laboratory: Laboratory, asked: Namespace) -> None:
    """Controllers evolved in reality, watched for twice an episode."""
    settled, counted = round(SETTLING_S / LOOK_S), round(COUNTED_S / LOOK_S)
    ratios, clearances = [], []

    def rows() -> Iterable[str]:
        for seed in range(asked.seeds):
            positions, tilt = laboratory.watch(laboratory.in_reality(seed), EPISODE_S + COUNTED_S)
            paths = [positions[i : i + counted + 1] for i in (settled, settled + counted)]
            first, second = (distance(path) / COUNTED_S for path in paths)
            ahead = " | ".join(f"{(path[-1, 0] - path[0, 0]) / COUNTED_S:.2f}" for path in paths)
            ratios.append(second / first)
            clearances.append(positions[settled:, 2].min() - BODY_M[2] / 2)
            speeds = f"{first:.3f} | {second:.3f} | {ratios[-1]:.2f} | {ahead}"
            yield f"{seed} | {speeds} | {clearances[-1]:.3f} | {tilt[settled:].max():.0f}"

    table("seed | speed m/s | next episode | ratio | along x | next | least clearance m | greatest tilt °", rows())
    print(f"{COUNTED_S / PERIOD_S:.0f} gait periods are counted. Second over first: {spread(ratios)}.")
    print(f"Clearance of the trunk's underside, m: {spread(clearances)}.")


def gap(laboratory: Laboratory, asked: Namespace) -> None:
    """Controllers evolved in random simulators, put into reality."""
    direct = laboratory.direct(asked.seeds)
    ratios = []

    def rows() -> Iterable[str]:
        for seed in range(asked.seeds):
            ratios.append(laboratory.real(laboratory.in_random(seed)) / float(np.mean(direct)))
            yield f"{seed} | {numbers(laboratory.random(seed))} | {ratios[-1]:.2f}"

    table("seed | static | dynamic | restitution | real fitness over direct", rows())
    print(f"Direct, m/s: {spread(direct)}. Random simulators over direct: {spread(ratios)}.")


def known(laboratory: Laboratory, asked: Namespace) -> None:
    """The hand-designed genome, and the genomes that *Known fit* draws around it."""
    direct, genome = float(np.mean(laboratory.direct(asked.seeds))), laboratory.robot.known
    added = stream(0, "known fit").random((100, len(genome))) / 4
    near = [laboratory.real(each) / direct for each in laboratory.robot.space.contain(genome + added)]
    far = [laboratory.real(each) / direct for each in laboratory.robot.space.draw(100, stream(0, "random genomes"))]
    at = laboratory.real(genome)
    rows = (f"hand-designed | {at:.3f} | {at / direct:.2f}", f"plus U[0, 0.25], of 100 | | {spread(near)}")
    table("genome | m/s | over direct", (*rows, f"uniform, of 100 | | {spread(far)}"))


def smooth(laboratory: Laboratory, asked: Namespace) -> None:
    """Root mean squared error on ten fit samples along each coefficient, the others true, over direct."""
    genomes = np.array([laboratory.in_random(seed) for seed in range(10)])
    measured = np.array([laboratory.real(genome) for genome in genomes])
    direct = float(np.mean(laboratory.direct(asked.seeds)))
    shares = np.linspace(0, 1, 31)
    for index, name in enumerate(NAMES):
        settings = np.tile(laboratory.truth, (len(shares), 1))
        settings[:, index] = laboratory.parameters.lower[index] + shares * laboratory.parameters.extent[index]
        errors = squared_errors(laboratory.simulate(genomes, settings), measured)
        profile = zip(settings[:, index], np.sqrt(errors / len(genomes)) / direct, strict=True)
        table(f"{name} | error over direct | ", (f"{at:.2f} | {error:.3f} | {bar(error)}" for at, error in profile))


def identifiable(laboratory: Laboratory, asked: Namespace) -> None:
    """Simulators tuned on fit samples: how far from the truth they are, and what evolves in them is worth."""
    genomes = [laboratory.in_random(seed) for seed in range(10)]
    samples = [Sample(genome, laboratory.real(genome)) for genome in genomes]
    found: dict[int, list[tuple[FloatArray, float]]] = {}

    def rows() -> Iterable[str]:
        for count in asked.samples:
            for seed in range(asked.tunings):
                rng = stream(seed, "tune", count)
                some = [samples[index] for index in rng.permutation(10)[:count]]
                misfit = Misfit(Answers(laboratory.simulate), some)
                best = tune(misfit, laboratory.parameters, SteadyState(), asked.tuning, rng)[0]
                fitness = laboratory.real(laboratory.evolve(best.parameters, "tuned", asked.tuning, count, seed))
                found.setdefault(count, []).append((best.parameters, fitness))
                error = np.sqrt(best.squared_error / count)
                yield f"{count} | {seed} | {numbers(best.parameters)} | {error:.4f} | {fitness:.3f}"

    table("samples | seed | static | dynamic | restitution | error m/s | real fitness m/s", rows())
    direct = float(np.mean(laboratory.direct(asked.seeds)))
    for count, pairs in found.items():
        off = np.median([np.abs(parameters - laboratory.truth) for parameters, _ in pairs], axis=0)
        ratios = [fitness / direct for _, fitness in pairs]
        print(f"{count} samples: median |error| {numbers(off, ', ')}; real fitness over direct {spread(ratios)}.")


def table(head: str, rows: Iterable[str]) -> None:
    """A Markdown table, printed row by row."""
    print(f"\n| {head} |\n|{'---|' * (head.count('|') + 1)}")
    for row in rows:
        print(f"| {row} |", flush=True)
    print()


def tilts(orientations: FloatArray) -> FloatArray:
    """Angles between the robot's up and the world's, degrees."""
    x, y = orientations[..., 0], orientations[..., 1]
    return np.degrees(np.arccos(np.clip(1 - 2 * (x**2 + y**2), -1, 1)))


def distance(positions_m: FloatArray) -> float:
    """From the first to the last of positions `(t, 3)`, over ground."""
    return float(np.linalg.norm((positions_m[-1] - positions_m[0])[:2]))


def spread(values: Sequence[float]) -> str:
    """Mean ± standard deviation, and how many."""
    return f"{np.mean(values):.3f} ± {np.std(values, ddof=1):.3f} (n = {len(values)})"


def numbers(values: FloatArray, between: str = " | ") -> str:
    """Numbers in a row."""
    return between.join(f"{value:.2f}" for value in values)


def bar(share: float) -> str:
    """A bar of text: a block for each hundredth."""
    return "▪" * round(100 * share)


COMMANDS: dict[str, Callable[[Laboratory, Namespace], None]] = {
    each.__name__: each for each in (stands, walks, gap, known, smooth, identifiable)
}


def main() -> None:
    """Print the tables that were asked for; several in one call share the controllers that they evolve."""
    parser = ArgumentParser(prog="python -m benchmarks.robot", description=__doc__)
    parser.add_argument("tables", nargs="+", choices=COMMANDS)
    parser.add_argument("--seeds", type=int, default=10, help="controllers evolved in reality")
    parser.add_argument("--evaluations", type=int, default=2_000, help="of each search for a controller")
    parser.add_argument("--samples", type=int, nargs="+", default=[1, 3, 10], help="identifiable: how many to tune on")
    parser.add_argument("--tunings", type=int, default=3, help="identifiable: tunings with each number of samples")
    parser.add_argument("--tuning", type=int, default=2_000, help="identifiable: evaluations of each, the paper's 2000")
    parser.add_argument("--keep", type=Path, help="a folder to keep evolved controllers in, for other calls")
    asked = parser.parse_args()
    with TemporaryDirectory() as temporary:
        kept = asked.keep or Path(temporary)
        kept.mkdir(parents=True, exist_ok=True)
        for name in asked.tables:
            COMMANDS[name](Laboratory(asked.evaluations, kept), asked)


if __name__ == "__main__":
    main()
