"""Controllers of the quadruped in MuJoCo: the time of a rollout, and whether `anticipating` helps.

`python -m benchmarks.controllers` prints both tables of docs/controllers.md. For the second, the trot that is known and
the best of random gaits walk in a world without change, with friction halved, and with a longer front shin.
"""

from argparse import ArgumentParser
from collections.abc import Mapping
from itertools import product
from time import process_time

import numpy as np
from numpy.random import default_rng

from gaplab.services.core.arrays import FloatArray, Genomes
from gaplab.services.core.controllers import controllers
from gaplab.services.core.robots.base import Robot
from gaplab.services.core.robots.quadruped import Quadruped
from gaplab.services.core.tasks.walk import Walk
from gaplab.services.core.tunables import tunables
from gaplab.services.engines.mujoco import MuJoCo
from gaplab.services.specs.simulation import Simulation

ROLLOUTS = 64
SEED = 6
UNCHANGED, SLIPPERY, LIMPING = (1.0, 0.8, 1.0), (0.5, 0.4, 1.0), (1.0, 0.8, 1.2)
"""Static friction, dynamic friction, and the length of a front shin as a factor."""

GAINS, LAGS_S = (0.0, 0.25, 0.5), (0.03, 0.06, 0.12)


def driven(name: str, options: Mapping[str, object]) -> Robot:
    """Return the quadruped that walks with a controller."""
    robot, controller = Quadruped(), controllers[name]
    robot.perform(controller(controller.Options.model_validate(options)), Walk())
    return robot


def speeds(robot: Robot, genomes: Genomes) -> FloatArray:
    """Return the fitness `(n, 3)` of genomes in the three worlds, m/s."""
    shin = next(body.name for body in robot.world.bodies if "front" in body.name and "shin" in body.name)
    length = tunables["length_scale"]
    edits = [
        tunables["static_friction"](),
        tunables["dynamic_friction"](),
        length(length.Options.model_validate({"of": shin})),
    ]
    return Simulation(robot, MuJoCo(), edits)(genomes, np.array([UNCHANGED, SLIPPERY, LIMPING]))


def times() -> None:
    """Print the time of a rollout of each controller, 64 random genomes a call."""
    engine = MuJoCo()
    for name in controllers:
        robot = driven(name, {})
        simulate, genomes = Simulation(robot, engine, []), robot.space.draw(ROLLOUTS, default_rng(SEED))
        nothing = np.empty((1, 0))
        simulate(genomes, nothing)
        began = process_time()
        simulate(genomes, nothing)
        milliseconds = 1e3 * (process_time() - began) / ROLLOUTS
        print(f"| `{name}` | {robot.space.size} | {milliseconds:.1f} |", flush=True)


def losses(gaits: int, kept: int) -> None:
    """Print what the two changes cost the known trot and the best gaits, open loop and with `anticipating`."""
    robot = driven("square_pulses", {})
    drawn = robot.space.draw(gaits, default_rng(SEED))
    best = drawn[np.argsort(-speeds(robot, drawn)[:, 0])[:kept]]
    genomes = np.vstack([robot.known, best])
    without = speeds(robot, genomes)
    _print_losses("`square_pulses`", without, without)
    for gain, heading in product(GAINS, GAINS):
        for lag_s in LAGS_S if gain else LAGS_S[:1]:
            options = {"gain": gain, "heading_gain": heading, "lag_s": lag_s}
            walking = speeds(driven("anticipating", options), genomes)
            _print_losses(f"{gain:g}, {heading:g}, {lag_s:g}", walking, without)


def _print_losses(name: str, walking: FloatArray, without: FloatArray) -> None:
    lost, before = walking[:, :1] - walking[:, 1:], without[:, :1] - without[:, 1:]
    error = (lost - before).std(axis=0, ddof=1) / np.sqrt(len(lost))
    cells = (f"{mean:.3f} ({each:.3f})" for mean, each in zip(lost.mean(axis=0), error, strict=True))
    print(f"| {name} | {walking[:, 0].mean():.3f} | {' | '.join(cells)} |", flush=True)


def main() -> None:
    """Print both tables."""
    parser = ArgumentParser(prog="python -m benchmarks.controllers", description=__doc__)
    parser.add_argument("--gaits", type=int, default=2000, help="random gaits")
    parser.add_argument("--kept", type=int, default=50, help="best of them that the changes are tried on")
    arguments = parser.parse_args()
    print("| controller | genes | milliseconds a rollout |\n|---|---|---|")
    times()
    print("\nLosses in m/s, in brackets the standard error of the difference from square_pulses.\n")
    print("| gain, heading_gain, lag_s | unchanged, m/s | friction halved | a longer front shin |\n|---|---|---|---|")
    losses(arguments.gaits, arguments.kept)


if __name__ == "__main__":
    main()
