"""Speed of engines: bare steps against the same episodes of the quadruped through `Simulate`."""

from collections import defaultdict
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pybullet
from mujoco import mjtState
from mujoco import rollout as library

from benchmarks.measure import Row, compared
from gaplab.services.core.arrays import Genomes
from gaplab.services.core.optimizers.steady_state import SteadyState
from gaplab.services.core.search import maximise
from gaplab.services.core.streams import stream
from gaplab.services.engines.base import Engine
from gaplab.services.engines.mujoco import MuJoCo
from gaplab.services.engines.mujoco.engine import MuJoCoScene
from gaplab.services.engines.physx import PhysX
from gaplab.services.engines.pybullet import PyBullet
from gaplab.services.engines.pybullet.engine import PyBulletScene
from gaplab.services.specs.simulation import Simulation
from gaplab.services.world.motions import Motion, open_loop
from gaplab.services.world.robots.quadruped import Quadruped
from gaplab.services.world.tunables import tunables

ROBOT = Quadruped()
TUNED = ("static_friction", "dynamic_friction", "restitution")
SWITCHING = np.array([[1.0, 0.8, 0.0]])
GENOMES, MANY = 12, 96
"""Genomes of a round, and of a batch: enough to keep two threads busy to the end."""
STEPS = 5_000  # of evolution in a round

Work = Callable[[], int]

PYBULLET = "PyBullet, static ≠ dynamic friction (stick-slip switching)"
COMPARED = (
    (PYBULLET, "PyBullet, bare loop of steps", "≥ 0.85"),
    ("PhysX", PYBULLET, ""),
    ("MuJoCo, one genome a call", PYBULLET, "≥ 5"),
    (f"MuJoCo, {MANY} genomes a call", PYBULLET, "≥ 5"),
    (f"MuJoCo, {MANY} genomes a call", "bare mujoco.rollout", "≥ 0.9"),
    ("the same on 2 threads", "bare mujoco.rollout on 2", "≥ 0.9"),
    ("the same on 2 threads", f"MuJoCo, {MANY} genomes a call", "cores"),
    ("a step of the paper's evolution, without physics", PYBULLET, "≥ 100"),
)
"""What is measured, what it is compared with, and the ratio that it should have."""


def genomes(count: int = GENOMES) -> Genomes:
    """Return the hand-designed genome and random ones."""
    drawn: Genomes = np.vstack([ROBOT.known, ROBOT.space.draw(count - 1, np.random.default_rng(0))])
    return drawn


def through_simulate(engine: Engine, count: int = GENOMES, *, batch: bool = False) -> Work:
    """Return work: rollouts through `Simulate`, one genome a call, as the paper's evolution does, or all in one."""
    simulate, drawn = Simulation(ROBOT, engine, [tunables[name]() for name in TUNED]), genomes(count)
    return lambda: sum(simulate(each, SWITCHING).size for each in ([drawn] if batch else drawn[:, None]))


def evolution() -> int:
    """Run steps of the paper's evolution (ask, replacement, tell) without the cost of fitness."""
    maximise(SteadyState(), ROBOT.space, lambda asked: asked.genomes[:, 0], STEPS, stream(0, "benchmark"))
    return STEPS


def bare_pybullet() -> Work:
    """Return work: `stepSimulation` in a loop, with motor commands at pulse edges only."""
    material = ROBOT.world.material
    world = replace(ROBOT.world, material=replace(material, static_friction=material.dynamic_friction))
    scene = PyBulletScene(pybullet, world)
    motions = [open_loop(ROBOT.motion(genome)) for genome in genomes()]

    def work() -> int:
        for motion in motions:
            commands, steps = edges(motion)
            scene.start(world)
            for step in range(steps):
                for actuator, target in commands.get(step, ()):
                    scene.command(actuator, target)
                pybullet.stepSimulation(physicsClientId=scene.client)
            pybullet.getBasePositionAndOrientation(scene.robot, physicsClientId=scene.client)
        return len(motions)

    return work


def bare_mujoco(threads: int) -> Work:
    """Return work: `mujoco.rollout` of the same motions, model and contact law, with precomputed inputs."""
    engine = MuJoCo(MuJoCo.Options(threads=threads))
    scene: MuJoCoScene = engine._scenes[ROBOT.world.kind]
    motions = [open_loop(ROBOT.motion(genome)) for genome in genomes(MANY)]
    steps = int(scene.steps(motions[0].observe_s)[-1])
    controls = scene.controls.of(motions, steps, [None])
    start = np.tile(scene.states.start, (MANY, 1))
    models = [prepared.model for prepared in scene.models[[ROBOT.world]]] * MANY
    pool = library.Rollout(nthread=threads if threads > 1 else 0)

    def work() -> int:
        with scene.pool.in_force():
            pool.rollout(models, scene.pool.datas, start, controls, control_spec=mjtState.mjSTATE_QFRC_APPLIED.value)
        return MANY

    return work


def edges(motion: Motion) -> tuple[dict[int, list[tuple[int, float]]], int]:
    """Return the new targets of motors by step, and the number of steps."""
    commands: dict[int, list[tuple[int, float]]] = defaultdict(list)
    before, step_s = np.full(motion.targets.shape[1], np.nan), ROBOT.world.time_step_s
    for time_s, targets in zip(motion.times_s, motion.targets, strict=True):
        for actuator in np.flatnonzero(targets != before):
            commands[round(time_s / step_s)].append((int(actuator), float(targets[actuator])))
        before = targets
    return commands, round(motion.observe_s[-1] / step_s)


def rows(rounds: int) -> list[Row]:
    """Measure all engines in turn."""
    on_two = MuJoCo(MuJoCo.Options(threads=2))
    competitors = {
        "PyBullet, bare loop of steps": bare_pybullet(),
        PYBULLET: through_simulate(PyBullet()),
        "MuJoCo, one genome a call": through_simulate(MuJoCo(), count=MANY),
        f"MuJoCo, {MANY} genomes a call": through_simulate(MuJoCo(), count=MANY, batch=True),
        "bare mujoco.rollout": bare_mujoco(1),
        "the same on 2 threads": through_simulate(on_two, count=MANY, batch=True),
        "bare mujoco.rollout on 2": bare_mujoco(2),
        "a step of the paper's evolution, without physics": evolution,
    }
    if PhysX.available():
        competitors["PhysX"] = through_simulate(PhysX())
    return compared(competitors, COMPARED, rounds)
