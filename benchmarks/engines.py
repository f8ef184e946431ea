"""The same robot in every engine that is installed: how it stands, and the fitness of the same genomes side by side.

`python -m benchmarks.engines` prints the tables of docs/engines.md; `--svg FILE` draws them. An engine takes part by
being registered.
"""

from argparse import ArgumentParser
from itertools import combinations
from pathlib import Path

import numpy as np
from scipy.stats import spearmanr

from benchmarks.physics import TUNED
from gaplab.services.core.arrays import FloatArray, Genome, Genomes
from gaplab.services.core.optimizers.steady_state import SteadyState
from gaplab.services.core.robots.quadruped import Quadruped
from gaplab.services.core.search import maximise
from gaplab.services.core.streams import stream
from gaplab.services.core.tunables import tunables
from gaplab.services.core.world import Motion
from gaplab.services.engines import engines
from gaplab.services.engines.base import Engine
from gaplab.services.specs.assembly import Simulation

ROBOT = Quadruped()
TRUTH = np.array([[1.0, 0.8, 0.0]])
NEARBY = {"0.01 more dynamic friction": (1.0, 0.81, 0.0), "half the friction": (0.5, 0.5, 0.0)}
ALONE_S = 3.0


def installed() -> dict[str, Engine]:
    """The engines that run the quadruped, by name."""
    return {name: each() for name, each in engines.items() if each.available() and each.runs(ROBOT.world)}


def simulation(engine: Engine) -> Simulation:
    """The quadruped under the paper's three tunables."""
    return Simulation(ROBOT, engine, [tunables[name]() for name in TUNED])


def evolved(engine: Engine, evaluations: int, seed: int) -> Genome:
    """A controller evolved in the robot's own world."""
    simulate, rng = simulation(engine), stream(seed, "evolved", engine.name)
    found = maximise(SteadyState(), ROBOT.space, lambda asked: simulate(asked.genomes, TRUTH)[:, 0], evaluations, rng)
    best: Genome = found.genomes[0]
    return best


def stands(found: dict[str, Engine]) -> None:
    """Left alone in its neutral pose."""
    world = ROBOT.world
    still = Motion(np.zeros(1), np.zeros((1, len(world.actuators))), np.array([ALONE_S]))
    print(f"The robot weighs {sum(body.mass_kg for body in world.bodies):.2f} kg.\n")
    print(f"| engine | the trunk's height after {ALONE_S:.0f} s, mm |\n|---|---|")
    for name, engine in found.items():
        print(f"| {name} | {1e3 * engine.rollout(world, still).positions_m[-1, 2]:.1f} |")


def pairs(sets: dict[str, Genomes], fitnesses: dict[str, dict[str, FloatArray]]) -> None:
    """Rank correlations of each two engines, over each set of genomes and over all."""
    print(f"\n| engines | {' | '.join(f'{name}, {len(drawn)}' for name, drawn in sets.items())} | all |")
    print("|---|" + "---|" * (len(sets) + 1))
    for one, other in combinations(fitnesses, 2):
        ranks = [rank(fitnesses[one][name], fitnesses[other][name]) for name in sets]
        every = rank(*(np.concatenate(list(fitnesses[name].values())) for name in (one, other)))
        print(f"| {one}, {other} | {' | '.join(ranks)} | {every} |")


def means(sets: dict[str, Genomes], fitnesses: dict[str, dict[str, FloatArray]]) -> None:
    """Mean ± standard deviation of each engine."""
    print(f"\n| m/s in | {' | '.join(sets)} |\n|---|{'---|' * len(sets)}")
    for name, of in fitnesses.items():
        print(f"| {name} | {' | '.join(f'{each.mean():.3f} ± {each.std(ddof=1):.3f}' for each in of.values())} |")


def itself(found: dict[str, Engine], drawn: Genomes) -> None:
    """Rank correlation of each engine with itself where a little, or much, is different: what one can hope for."""
    print(f"\n| an engine with itself | {' | '.join(NEARBY)} |\n|---|{'---|' * len(NEARBY)}")
    for name, engine in found.items():
        both = simulation(engine)(drawn, np.vstack([TRUTH, *NEARBY.values()]))
        print(f"| {name} | {' | '.join(rank(both[:, 0], both[:, other]) for other in range(1, both.shape[1]))} |")


def rank(ours: FloatArray, theirs: FloatArray) -> str:
    """Spearman's rank correlation, over genomes that fail in neither."""
    fine = np.isfinite(ours) & np.isfinite(theirs)
    return f"{spearmanr(ours[fine], theirs[fine]).statistic:.2f}"


def draw(file: Path, fitnesses: dict[str, dict[str, FloatArray]]) -> None:
    """A scatter of fitness in one engine against fitness in another, for each two."""
    from matplotlib.figure import Figure

    couples = list(combinations(fitnesses, 2))
    figure = Figure(figsize=(4 * len(couples), 4), layout="constrained")
    most = 1.05 * max(float(np.nanmax(each)) for of in fitnesses.values() for each in of.values())
    for axes, (one, other) in zip(figure.subplots(1, len(couples), squeeze=False)[0], couples, strict=True):
        axes.axline((0, 0), slope=1, color="0.8", zorder=0)
        for name in fitnesses[one]:
            axes.scatter(fitnesses[one][name], fitnesses[other][name], s=10, label=name)
        axes.set(xlabel=f"{one}, m/s", ylabel=f"{other}, m/s", xlim=(0, most), ylim=(0, most), aspect="equal")
    figure.axes[0].legend(frameon=False, fontsize="small")
    figure.savefig(file)


def main() -> None:
    """Print, and draw if asked to."""
    parser = ArgumentParser(prog="python -m benchmarks.engines", description=__doc__)
    parser.add_argument("--random", type=int, default=110, help="genomes drawn uniformly")
    parser.add_argument("--evolved", type=int, default=30, help="genomes evolved in each engine")
    parser.add_argument("--evaluations", type=int, default=200, help="of each evolution")
    parser.add_argument("--svg", type=Path, help="a file for the scatter")
    asked = parser.parse_args()
    found = installed()
    stands(found)
    sets = {"random": ROBOT.space.draw(asked.random, stream(0, "random genomes"))}
    for name, engine in found.items():
        sets[f"evolved in {name}"] = np.array([evolved(engine, asked.evaluations, n) for n in range(asked.evolved)])
    fitnesses = {
        name: {each: simulation(engine)(drawn, TRUTH)[:, 0] for each, drawn in sets.items()}
        for name, engine in found.items()
    }
    means(sets, fitnesses)
    pairs(sets, fitnesses)
    itself(found, sets["random"])
    if asked.svg:
        draw(asked.svg, fitnesses)


if __name__ == "__main__":
    main()
