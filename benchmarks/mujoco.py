"""Speed of MuJoCo through `Simulate`, against PyBullet and against bare `mujoco.rollout` on one and two threads."""

from collections.abc import Callable

import numpy as np
from mujoco import mjtState
from mujoco import rollout as library

from benchmarks.measure import Row, rates, ratio
from benchmarks.physics import SWITCHING, genomes, simulation, through_simulate
from gaplab.services.core.motions import open_loop
from gaplab.services.core.robots.quadruped import Quadruped
from gaplab.services.engines.base import Engine
from gaplab.services.engines.mujoco import MuJoCo
from gaplab.services.engines.mujoco.scene import MuJoCoScene

ROBOT = Quadruped()
MANY = 96
"""Genomes of a batch: enough to keep two threads busy to the end."""


def call_by_call() -> Callable[[], int]:
    """Return work: rollouts by the engine alone, one precomputed motion a call."""
    engine, motions = MuJoCo(), [open_loop(ROBOT.motion(genome)) for genome in genomes(MANY)]

    def work() -> int:
        for motion in motions:
            engine.rollout(ROBOT.world, motion)
        return MANY

    return work


def at_once(engine: Engine) -> Callable[[], int]:
    """Return work: rollouts through `Simulate` in one call."""
    simulate, drawn = simulation(engine), genomes(MANY)

    def work() -> int:
        return simulate(drawn, SWITCHING).size

    return work


def bare(threads: int) -> Callable[[], int]:
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


def rows(rounds: int) -> list[Row]:
    """Measure the engine one by one and in batches, against PyBullet and bare MuJoCo."""
    competitors = {
        "pybullet": through_simulate(SWITCHING),
        "single": through_simulate(SWITCHING, MuJoCo(), MANY),
        "calls": call_by_call(),
        "batch": at_once(MuJoCo()),
        "bare": bare(1),
        "batch on 2": at_once(MuJoCo(MuJoCo.Options(threads=2))),
        "bare on 2": bare(2),
    }
    measured = rates(competitors, rounds)

    def row(figure: str, ours: str, theirs: str, reference: str, target: str) -> Row:
        value = f"{1e3 / float(np.median(measured[ours])):.2f} ms a rollout"
        return Row(figure, value, ratio(measured[ours], measured[theirs]), reference, target)

    return [
        row("MuJoCo engine, one genome a call", "single", "pybullet", "PyBullet engine, switching", "≥ 5"),
        row(f"MuJoCo engine, {MANY} genomes a call", "batch", "pybullet", "PyBullet engine, switching", "≥ 5"),
        row("MuJoCo engine alone, one motion a call", "calls", "bare", "bare mujoco.rollout", "≥ 0.9"),
        row(f"MuJoCo engine, {MANY} genomes a call", "batch", "bare", "bare mujoco.rollout", "≥ 0.9"),
        row("the same on 2 threads", "batch on 2", "bare on 2", "bare mujoco.rollout on 2", "≥ 0.9"),
        row("the same on 2 threads", "batch on 2", "batch", "on 1 thread", "cores"),
    ]
