"""PhysX: its speed against a bare loop of steps; `python -m benchmarks.physx` compares the robot with PyBullet's."""

from argparse import ArgumentParser
from collections.abc import Callable

import numpy as np
from scipy import stats

from benchmarks.measure import Row, rates, ratio
from benchmarks.physics import SWITCHING, edges, evolved, genomes, simulation, through_simulate
from gaplab.services.core.arrays import Fitnesses, Genomes
from gaplab.services.core.motions import Motion, open_loop
from gaplab.services.core.robots.quadruped import Quadruped
from gaplab.services.core.streams import stream
from gaplab.services.engines.base import Engine
from gaplab.services.engines.physx import PhysX
from gaplab.services.engines.pybullet import PyBullet
from gaplab.services.specs.simulation import Simulation

ROBOT = Quadruped()
NEARBY = [np.array([values]) for values in ((1.02, 0.8, 0.0), (1.0, 0.81, 0.0), (1.0, 0.8, 0.02), (0.5, 0.5, 0.0))]


def bare() -> Callable[[], int]:
    """Return work: `PhysxCpuSystem.step` in a loop, with new drive targets at pulse edges only."""
    world = ROBOT.world
    scene = PhysX()._scenes[world]
    system, joints, start = scene._system, scene.robot.joints, scene._initial
    scene.start(world)
    plans = [edges(open_loop(ROBOT.motion(genome)), world.time_step_s) for genome in genomes()]

    def work() -> int:
        for commands, steps in plans:
            system.unpack(start)
            for step in range(steps):
                for actuator, target in commands.get(step, ()):
                    joints[actuator].set_drive_target(target)
                system.step()
            scene.articulation.root_pose.p.sum()
        return len(plans)

    return work


def rows(rounds: int) -> list[Row]:
    """Measure bare steps, and PhysX and PyBullet through `Simulate`."""
    competitors = {
        "bare": bare(),
        "physx": through_simulate(SWITCHING, PhysX()),
        "pybullet": through_simulate(SWITCHING, PyBullet()),
    }
    measured = rates(competitors, rounds)
    milliseconds = {name: f"{1e3 / float(np.median(each)):.1f} ms a rollout" for name, each in measured.items()}
    against = {name: ratio(measured["physx"], measured[name]) for name in ("bare", "pybullet")}
    return [
        Row("PhysX: bare loop of steps, one core", milliseconds["bare"]),
        Row("PhysX engine", milliseconds["physx"], against["bare"], "bare", "≥ 0.85"),
        Row("PhysX engine, as above", milliseconds["physx"], against["pybullet"], "PyBullet engine, switching"),
    ]


def main() -> None:
    """Print height at rest and fitness of the same genomes, in PhysX and in PyBullet."""
    parser = ArgumentParser(prog="python -m benchmarks.physx", description=__doc__)
    parser.add_argument("--random", type=int, default=100, help="genomes drawn uniformly")
    parser.add_argument("--evolved", type=int, default=5, help="genomes evolved in each engine")
    parser.add_argument("--evaluations", type=int, default=300, help="evaluations of each evolution")
    arguments = parser.parse_args()
    engines: dict[str, Engine] = {"physx": PhysX(), "pybullet": PyBullet()}
    still = Motion(np.zeros(1), np.zeros((1, len(ROBOT.world.actuators))), np.array([2.0]))
    for name, engine in engines.items():
        height = engine.rollout(ROBOT.world, still).positions_m[-1, 2]
        print(f"{name}: at rest, the trunk is {1e3 * height:.1f} mm above the ground after 2 s")
    sets = {"random": ROBOT.space.draw(arguments.random, stream(0, "random genomes"))}
    for name, engine in engines.items():
        sets[f"evolved in {name}"] = np.array(
            [evolved(engine, arguments.evaluations, stream(0, name, seed)) for seed in range(arguments.evolved)]
        )
    simulates = {name: simulation(engine) for name, engine in engines.items()}
    compare(sets, simulates)
    nearby(sets["random"], simulates)


def compare(sets: dict[str, Genomes], simulates: dict[str, Simulation]) -> None:
    """Print a Markdown table of fitness in both engines; the last line is over all sets."""
    print("\n| genomes | PhysX m/s | PyBullet m/s | Spearman | Pearson |\n|---|---|---|---|---|")
    sides: dict[str, tuple[Fitnesses, Fitnesses]] = {}
    for name, drawn in sets.items():
        sides[name] = (simulates["physx"](drawn, SWITCHING)[:, 0], simulates["pybullet"](drawn, SWITCHING)[:, 0])
    ours, theirs = zip(*sides.values(), strict=True)
    sides["all"] = (np.concatenate(ours), np.concatenate(theirs))
    for name, (here, there) in sides.items():
        means = " | ".join(f"{np.mean(side):.3f} ± {np.std(side, ddof=1):.3f}" for side in (here, there))
        rank, linear = stats.spearmanr(here, there).statistic, stats.pearsonr(here, there).statistic
        print(f"| {name}, {len(here)} | {means} | {rank:.2f} | {linear:.2f} |")


def nearby(drawn: Genomes, simulates: dict[str, Simulation]) -> None:
    """Print a Markdown table of rank correlations of each engine with itself in changed materials."""
    print("\n| static, dynamic friction, restitution | PhysX Spearman | PyBullet Spearman |\n|---|---|---|")
    truth = {name: simulate(drawn, SWITCHING)[:, 0] for name, simulate in simulates.items()}
    for changed in NEARBY:
        each = (stats.spearmanr(truth[name], simulates[name](drawn, changed)[:, 0]).statistic for name in simulates)
        print(f"| {', '.join(map(str, changed[0]))} | {' | '.join(f'{rank:.2f}' for rank in each)} |")


if __name__ == "__main__":
    main()
