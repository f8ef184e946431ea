"""One function for each table; ratios are to the direct baseline, the fitness of controllers evolved in reality."""

from argparse import Namespace
from collections.abc import Iterable

import numpy as np

from benchmarks.robot.laboratory import EPISODE_S, NAMES, SAMPLING_S, Laboratory, tilts
from benchmarks.robot.text import bar, mean_and_sd, numbers, table
from gaplab.services.core.answers import Answers
from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.motions import Motion
from gaplab.services.core.optimizers.steady_state import SteadyState
from gaplab.services.core.robots.quadruped import BODY_M, COUNTED_S, PERIOD_S, SETTLING_S
from gaplab.services.core.streams import stream
from gaplab.services.core.tuners.base import TuningTask
from gaplab.services.core.tuners.search import SearchTuner
from gaplab.services.core.tuning import Misfit, squared_errors
from gaplab.services.core.types import Sample


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
                task = TuningTask(misfit, laboratory.parameters, SteadyState(), 1, arguments.tuning, ())
                best = SearchTuner().tune(task, rng)[0]
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


def distance(positions_m: FloatArray) -> float:
    """Return the distance over ground from the first to the last of positions `(t, 3)`."""
    return float(np.linalg.norm((positions_m[-1] - positions_m[0])[:2]))
