"""A robot with PD motors in MuJoCo: Simulate against bare stepping, 20 simulators by turns, and feedback.

`python -m benchmarks.any_robot_mujoco` prints all three; with the name of a URDF or an MJCF, the first of that robot.
Bare stepping is one call of `mujoco.rollout` with the same model and law, and targets that were computed before.
Feedback is the controller `mlp`, 64 genomes a call, against as many of `square_pulses`, which needs no sensors.
"""

from argparse import ArgumentParser
from collections.abc import Callable
from pathlib import Path

import numpy as np
from mujoco import mjtState
from mujoco import rollout as library

from benchmarks.any_robot import Dog, best, by_turns
from gaplab.services.core import robot_library
from gaplab.services.core.arrays import Genomes
from gaplab.services.core.controllers import controllers
from gaplab.services.core.motions import open_loop
from gaplab.services.core.robots.base import Robot
from gaplab.services.core.robots.quadruped import Quadruped
from gaplab.services.core.robots.robot_file import Imported, ImportedOptions
from gaplab.services.core.tasks.walk import Walk
from gaplab.services.core.tunables import tunables
from gaplab.services.engines.mujoco import MuJoCo
from gaplab.services.robots.importing import import_robot
from gaplab.services.robots.options import ImportOptions
from gaplab.services.specs.simulation import Simulation

TOGETHER = 64
ROUNDS = 15
FEEDBACK = "angles,tilt,turning", "angles,speeds,tilt,turning,contacts"
PARAMETERS = np.array([[0.8]])


def drawn(robot: Robot, count: int = TOGETHER) -> Genomes:
    """Return the robot's known genome and random ones."""
    genomes: Genomes = np.vstack([robot.known, robot.space.draw(count - 1, np.random.default_rng(0))])
    return genomes


def simulation(robot: Robot, engine: MuJoCo) -> Simulation:
    """Return a Simulate of a robot with one tunable."""
    return Simulation(robot, engine, [tunables["dynamic_friction"]()])


def bare(robot: Robot, engine: MuJoCo, genomes: Genomes) -> Callable[[], object]:
    """Return work: `mujoco.rollout` of the motions of genomes, with precomputed inputs."""
    scene = engine._scenes[robot.world.built(engine.in_place)]
    motions = [open_loop(robot.motion(genome)) for genome in genomes]
    controls = scene.controls.of(motions, int(scene.steps(motions[0].observe_s)[-1]), [None]).copy()
    starts = np.tile(scene.states.start, (len(genomes), 1))
    models = [prepared.model for prepared in scene.models[[robot.world]]] * len(genomes)
    pool = library.Rollout(nthread=0)

    def work() -> None:
        with scene.pool.in_force():
            pool.rollout(models, scene.pool.datas, starts, controls, control_spec=mjtState.mjSTATE_QFRC_APPLIED.value)

    return work


def overhead(robot: Robot) -> None:
    """Print the time of a rollout through Simulate, and of bare stepping."""
    engine, genomes = MuJoCo(), drawn(robot)
    simulate = simulation(robot, engine)
    one_by_one, together, alone = best(
        [
            lambda: [simulate(genome[None], PARAMETERS) for genome in genomes],
            lambda: simulate(genomes, PARAMETERS),
            bare(robot, engine, genomes),
        ],
        ROUNDS,
    )
    for name, its in ((f"{TOGETHER} a call", together), ("one a call", one_by_one)):
        figures = f"Simulate {1e3 * its / TOGETHER:.2f} ms a rollout, bare {1e3 * alone / TOGETHER:.2f} ms"
        print(f"{robot.label}, {name}: {figures}, {alone / its:.2f}")


def feedback(robot: Robot, senses: str) -> None:
    """Print the time of a rollout with feedback, and of one without."""
    engine = MuJoCo()
    closed = type(robot)()
    mlp = controllers["mlp"]
    closed.perform(mlp(mlp.Options.model_validate({"senses": senses})), Walk())
    loop, motion = simulation(closed, engine), simulation(robot, engine)
    loops, motions = drawn(closed), drawn(robot)
    fed, unfed = best([lambda: loop(loops, PARAMETERS), lambda: motion(motions, PARAMETERS)], ROUNDS)
    figures = f"feedback {1e3 * fed / TOGETHER:.2f} ms a rollout, open loop {1e3 * unfed / TOGETHER:.2f} ms"
    print(f"{robot.name}, {senses}, {TOGETHER} a call: {figures}, {unfed / fed:.2f}")


def imported(file: Path) -> Robot:
    """Return the robot of a file."""
    robot = import_robot(file, ImportOptions()).robot
    robot_library.learn([robot.text])
    return Imported(ImportedOptions(sha256=robot.sha256, name=robot.name))


def main() -> None:
    """Print all figures, or that of a file."""
    parser = ArgumentParser(prog="python -m benchmarks.any_robot_mujoco", description=__doc__)
    parser.add_argument("file", nargs="?", type=Path)
    if file := parser.parse_args().file:
        overhead(imported(file))
        return
    overhead(Dog())
    by_turns(MuJoCo(), Dog())
    for robot in (Dog(), Quadruped()):
        for senses in FEEDBACK:
            feedback(robot, senses)


if __name__ == "__main__":
    main()
