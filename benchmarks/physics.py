"""Speed of PyBullet on one core: a bare loop of steps against the same episode through `Simulate`."""

from collections import defaultdict
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pybullet

from benchmarks.measure import Row, rates, ratio
from gaplab.services.core.arrays import Genome, Genomes, Parameters
from gaplab.services.core.motions import Motion, open_loop
from gaplab.services.core.optimizers.steady_state import SteadyState
from gaplab.services.core.robots.quadruped import Quadruped
from gaplab.services.core.search import maximise
from gaplab.services.core.tunables import tunables
from gaplab.services.engines.base import Engine
from gaplab.services.engines.pybullet import PyBullet
from gaplab.services.engines.pybullet.scene import PyBulletScene
from gaplab.services.specs.simulation import Simulation

TUNED = ("static_friction", "dynamic_friction", "restitution")
GENOMES = 12
SWITCHING = np.array([[1.0, 0.8, 0.0]])
EQUAL = np.array([[0.8, 0.8, 0.0]])


def genomes(count: int = GENOMES) -> Genomes:
    """Return the hand-designed genome and random ones."""
    robot = Quadruped()
    drawn: Genomes = np.vstack([robot.known, robot.space.draw(count - 1, np.random.default_rng(0))])
    return drawn


def simulation(engine: Engine | None = None) -> Simulation:
    """Return the quadruped with the paper's three tunables, by default in PyBullet."""
    return Simulation(Quadruped(), engine or PyBullet(), [tunables[name]() for name in TUNED])


def through_simulate(parameters: Parameters, engine: Engine | None = None, count: int = GENOMES) -> Callable[[], int]:
    """Return work: rollouts through `Simulate`, one genome a call, as the paper's evolution does."""
    simulate, drawn = simulation(engine), genomes(count)

    def work() -> int:
        for genome in drawn:
            simulate(genome[None], parameters)
        return len(drawn)

    return work


def bare() -> Callable[[], int]:
    """Return work: `stepSimulation` in a loop, with motor commands at pulse edges only."""
    robot = Quadruped()
    dynamic = robot.world.material.dynamic_friction
    world = replace(robot.world, material=replace(robot.world.material, static_friction=dynamic))
    scene = PyBulletScene(pybullet, world)
    motions = [open_loop(robot.motion(genome)) for genome in genomes()]

    def work() -> int:
        for motion in motions:
            commands, steps = edges(motion, robot.world.time_step_s)
            scene.start(world)
            for step in range(steps):
                for actuator, target in commands.get(step, ()):
                    scene.command(actuator, target)
                pybullet.stepSimulation(physicsClientId=scene.client)
            pybullet.getBasePositionAndOrientation(scene.robot, physicsClientId=scene.client)
        return len(motions)

    return work


def edges(motion: Motion, time_step_s: float) -> tuple[dict[int, list[tuple[int, float]]], int]:
    """Return the new targets of motors by step, and the number of steps."""
    commands: dict[int, list[tuple[int, float]]] = defaultdict(list)
    before = np.full(motion.targets.shape[1], np.nan)
    for time_s, targets in zip(motion.times_s, motion.targets, strict=True):
        for actuator in np.flatnonzero(targets != before):
            commands[round(time_s / time_step_s)].append((int(actuator), float(targets[actuator])))
        before = targets
    return commands, round(motion.observe_s[-1] / time_step_s)


def evolved(engine: Engine, evaluations: int, rng: np.random.Generator) -> Genome:
    """Return a controller that was evolved in the robot's own world."""
    simulate = simulation(engine)
    fittest = maximise(
        SteadyState(), Quadruped().space, lambda asked: simulate(asked.genomes, SWITCHING)[:, 0], evaluations, rng
    )
    genome: Genome = fittest.genomes[0]
    return genome


def rows(rounds: int) -> list[Row]:
    """Measure bare steps, and the engine with and without stick-slip switching."""
    measured = rates(
        {"bare": bare(), "switching": through_simulate(SWITCHING), "equal": through_simulate(EQUAL)}, rounds
    )
    milliseconds = {name: f"{1e3 / float(np.median(each)):.1f} ms a rollout" for name, each in measured.items()}
    return [
        Row("bare loop of steps, one core", milliseconds["bare"]),
        Row(
            "engine, static ≠ dynamic friction (stick-slip switching)",
            milliseconds["switching"],
            ratio(measured["switching"], measured["bare"]),
            "bare",
            "≥ 0.85",
        ),
        Row(
            "engine, static = dynamic friction",
            milliseconds["equal"],
            ratio(measured["equal"], measured["bare"]),
            "bare",
            "≥ 0.93",
        ),
    ]
