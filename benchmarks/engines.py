"""The same robot in every installed engine: its height at rest, and the fitness of the same genomes.

`python -m benchmarks.engines` prints the tables of docs/engines.md, over all registered engines; `--svg FILE`
draws them.
"""

from argparse import ArgumentParser
from itertools import combinations
from pathlib import Path

import numpy as np
from scipy.stats import spearmanr

from benchmarks.physics import SWITCHING as TRUTH
from benchmarks.physics import evolved, simulation
from gaplab.services.core.arrays import FloatArray, Genomes
from gaplab.services.core.motions import Motion
from gaplab.services.core.robots.quadruped import Quadruped
from gaplab.services.core.streams import stream
from gaplab.services.engines import engines
from gaplab.services.engines.base import Engine

ROBOT = Quadruped()
NEARBY = {"0.01 more dynamic friction": (1.0, 0.81, 0.0), "both frictions 0.5": (0.5, 0.5, 0.0)}
ALONE_S = 3.0


def installed() -> dict[str, Engine]:
    """Return the installed engines that run the quadruped, by name."""
    return {name: kind() for name, kind in engines.items() if kind.available() and kind.runs(ROBOT.world)}


def stands(installed_engines: dict[str, Engine]) -> None:
    """Print the height of the robot at rest in its neutral pose."""
    world = ROBOT.world
    still = Motion(np.zeros(1), np.zeros((1, len(world.actuators))), np.array([ALONE_S]))
    print(f"The robot weighs {sum(body.mass_kg for body in world.bodies):.2f} kg.\n")
    print(f"| engine | the trunk's height after {ALONE_S:.0f} s, mm |\n|---|---|")
    for name, engine in installed_engines.items():
        print(f"| {name} | {1e3 * engine.rollout(world, still).positions_m[-1, 2]:.1f} |")


def pairs(sets: dict[str, Genomes], fitnesses: dict[str, dict[str, FloatArray]]) -> None:
    """Print the rank correlation of each pair of engines, over each set of genomes and over all."""
    print(f"\n| engines | {' | '.join(f'{name}, {len(drawn)}' for name, drawn in sets.items())} | all |")
    print("|---|" + "---|" * (len(sets) + 1))
    for one, other in combinations(fitnesses, 2):
        ranks = [rank(fitnesses[one][name], fitnesses[other][name]) for name in sets]
        every = rank(*(np.concatenate(list(fitnesses[name].values())) for name in (one, other)))
        print(f"| {one}, {other} | {' | '.join(ranks)} | {every} |")


def means(sets: dict[str, Genomes], fitnesses: dict[str, dict[str, FloatArray]]) -> None:
    """Print the mean fitness ± standard deviation in each engine."""
    print(f"\n| measured in, m/s | {' | '.join(sets)} |\n|---|{'---|' * len(sets)}")
    for name, by_set in fitnesses.items():
        print(f"| {name} | {' | '.join(f'{each.mean():.3f} ± {each.std(ddof=1):.3f}' for each in by_set.values())} |")


def self_correlations(installed_engines: dict[str, Engine], drawn: Genomes) -> None:
    """Print the rank correlation of each engine with itself in slightly and strongly changed worlds."""
    print(f"\n| an engine with itself | {' | '.join(NEARBY)} |\n|---|{'---|' * len(NEARBY)}")
    for name, engine in installed_engines.items():
        both = simulation(engine)(drawn, np.vstack([TRUTH, *NEARBY.values()]))
        print(f"| {name} | {' | '.join(rank(both[:, 0], both[:, other]) for other in range(1, both.shape[1]))} |")


def rank(ours: FloatArray, theirs: FloatArray) -> str:
    """Return Spearman's rank correlation over the genomes that fail in neither, as text."""
    finite = np.isfinite(ours) & np.isfinite(theirs)
    return f"{spearmanr(ours[finite], theirs[finite]).statistic:.2f}"


def draw(file: Path, fitnesses: dict[str, dict[str, FloatArray]]) -> None:
    """Draw scatter plots of fitness in one engine against another, for each pair."""
    from matplotlib.figure import Figure

    engine_pairs = list(combinations(fitnesses, 2))
    figure = Figure(figsize=(4 * len(engine_pairs), 4), layout="constrained")
    most = 1.05 * max(float(np.nanmax(each)) for by_set in fitnesses.values() for each in by_set.values())
    for axes, (one, other) in zip(figure.subplots(1, len(engine_pairs), squeeze=False)[0], engine_pairs, strict=True):
        axes.axline((0, 0), slope=1, color="0.8", zorder=0)
        for name in fitnesses[one]:
            axes.scatter(fitnesses[one][name], fitnesses[other][name], s=10, label=name)
        axes.set(xlabel=f"{one}, m/s", ylabel=f"{other}, m/s", xlim=(0, most), ylim=(0, most), aspect="equal")
    figure.axes[0].legend(frameon=False, fontsize="small")
    figure.savefig(file)


def main() -> None:
    """Print the tables, and draw them if requested."""
    parser = ArgumentParser(prog="python -m benchmarks.engines", description=__doc__)
    parser.add_argument("--random", type=int, default=110, help="genomes drawn uniformly")
    parser.add_argument("--evolved", type=int, default=30, help="genomes evolved in each engine")
    parser.add_argument("--evaluations", type=int, default=200, help="evaluations of each evolution")
    parser.add_argument("--svg", type=Path, help="file for the scatter plots")
    arguments = parser.parse_args()
    installed_engines = installed()
    stands(installed_engines)
    sets = {"random": ROBOT.space.draw(arguments.random, stream(0, "random genomes"))}
    for name, engine in installed_engines.items():
        rngs = [stream(seed, "evolved", engine.name) for seed in range(arguments.evolved)]
        sets[f"evolved in {name}"] = np.array([evolved(engine, arguments.evaluations, rng) for rng in rngs])
    fitnesses = {
        name: {each: simulation(engine)(drawn, TRUTH)[:, 0] for each, drawn in sets.items()}
        for name, engine in installed_engines.items()
    }
    means(sets, fitnesses)
    pairs(sets, fitnesses)
    self_correlations(installed_engines, sets["random"])
    if arguments.svg:
        draw(arguments.svg, fitnesses)


if __name__ == "__main__":
    main()
