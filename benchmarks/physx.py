"""PhysX: its speed against a bare loop of steps, and, by `python -m benchmarks.physx`, its robot against PyBullet's."""

from argparse import ArgumentParser
from collections.abc import Callable

import numpy as np
from scipy import stats

from benchmarks.measure import Row, rates, ratio
from benchmarks.physics import SWITCHING, TUNED, edges, genomes
from gaplab.services.core.arrays import Fitnesses, Genome, Genomes
from gaplab.services.core.optimizers.steady_state import SteadyState
from gaplab.services.core.robots.quadruped import Quadruped
from gaplab.services.core.search import maximise
from gaplab.services.core.streams import stream
from gaplab.services.core.tunables import tunables
from gaplab.services.core.world import Motion
from gaplab.services.engines.base import Engine
from gaplab.services.engines.physx import PhysX
from gaplab.services.engines.pybullet import PyBullet
from gaplab.services.specs.assembly import Simulation

ROBOT = Quadruped()
NEARBY = [np.array([values]) for values in ((1.02, 0.8, 0.0), (1.0, 0.81, 0.0), (1.0, 0.8, 0.02), (0.5, 0.5, 0.0))]


def simulation(engine: Engine) -> Simulation:
    """The quadruped under the paper's three tunables."""
    return Simulation(ROBOT, engine, [tunables[name]() for name in TUNED])


def through_simulate(engine: Engine) -> Callable[[], int]:
    """Rollouts through `Simulate`, one genome a call as an evolution asks for them."""
    simulate, drawn = simulation(engine), genomes()

    def work() -> int:
        for genome in drawn:
            simulate(genome[None], SWITCHING)
        return len(drawn)

    return work


def bare() -> Callable[[], int]:
    """`PhysxCpuSystem.step` in a loop, drives given targets at pulse edges only: what the physics alone costs."""
    world = ROBOT.world
    scene = PhysX()._scenes[world]
    system, joints, start = scene._system, scene.robot.motors, scene._initial
    scene.start(world.material)
    plans = [edges(ROBOT.motion(genome), world.time_step_s) for genome in genomes()]

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
    """Bare, through `Simulate`, and PyBullet through `Simulate`."""
    rivals = {"bare": bare(), "physx": through_simulate(PhysX()), "pybullet": through_simulate(PyBullet())}
    measured = rates(rivals, rounds)
    milliseconds = {name: f"{1e3 / float(np.median(each)):.1f} ms a rollout" for name, each in measured.items()}
    against = {name: ratio(measured["physx"], measured[name]) for name in ("bare", "pybullet")}
    return [
        Row("PhysX: bare loop of steps, one core", milliseconds["bare"]),
        Row("PhysX engine", milliseconds["physx"], against["bare"], "bare", "≥ 0.85"),
        Row("PhysX engine, as above", milliseconds["physx"], against["pybullet"], "PyBullet engine, switching"),
    ]


def main() -> None:
    """Stand, and walk with the same genomes, in PhysX and in PyBullet."""
    parser = ArgumentParser(prog="python -m benchmarks.physx", description=__doc__)
    parser.add_argument("--random", type=int, default=100, help="genomes drawn uniformly")
    parser.add_argument("--evolved", type=int, default=5, help="genomes evolved in each engine")
    parser.add_argument("--evaluations", type=int, default=300, help="of each evolution")
    asked = parser.parse_args()
    engines: dict[str, Engine] = {"physx": PhysX(), "pybullet": PyBullet()}
    still = Motion(np.zeros(1), np.zeros((1, len(ROBOT.world.actuators))), np.array([2.0]))
    for name, engine in engines.items():
        height = engine.rollout(ROBOT.world, still).positions_m[-1, 2]
        print(f"{name}: left alone, the trunk is {1e3 * height:.1f} mm above the ground after 2 s")
    sets = {"random": ROBOT.space.draw(asked.random, stream(0, "random genomes"))}
    for name, engine in engines.items():
        sets[f"evolved in {name}"] = np.array(
            [evolved(engine, asked.evaluations, name, seed) for seed in range(asked.evolved)]
        )
    simulates = {name: simulation(engine) for name, engine in engines.items()}
    compare(sets, simulates)
    nearby(sets["random"], simulates)


def evolved(engine: Engine, evaluations: int, *address: str | int) -> Genome:
    """A controller evolved in the robot's own world."""
    simulate = simulation(engine)
    rng = stream(0, *address)
    found = maximise(
        SteadyState(), ROBOT.space, lambda asked: simulate(asked.genomes, SWITCHING)[:, 0], evaluations, rng
    )
    best: Genome = found.genomes[0]
    return best


def compare(sets: dict[str, Genomes], simulates: dict[str, Simulation]) -> None:
    """A Markdown table of fitnesses side by side; the last line is over all sets."""
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
    """A Markdown table of how well an engine agrees with itself when one coefficient is changed a little."""
    print("\n| static, dynamic friction, restitution | PhysX Spearman | PyBullet Spearman |\n|---|---|---|")
    truth = {name: simulate(drawn, SWITCHING)[:, 0] for name, simulate in simulates.items()}
    for changed in NEARBY:
        each = (stats.spearmanr(truth[name], simulates[name](drawn, changed)[:, 0]).statistic for name in simulates)
        print(f"| {', '.join(map(str, changed[0]))} | {' | '.join(f'{rank:.2f}' for rank in each)} |")


if __name__ == "__main__":
    main()
