"""MuJoCo through `Simulate`, against PyBullet's on one core and against a bare `mujoco.rollout`, on one and on two."""

from collections.abc import Callable

import numpy as np
from mujoco import mjtState
from mujoco import rollout as library

from benchmarks.measure import Row, rates, ratio
from benchmarks.physics import SWITCHING, TUNED, genomes
from gaplab.services.core.robots.quadruped import Quadruped
from gaplab.services.core.tunables import tunables
from gaplab.services.engines.base import Engine
from gaplab.services.engines.mujoco import MuJoCo
from gaplab.services.engines.mujoco.scene import MuJoCoScene, _in_force
from gaplab.services.engines.pybullet import PyBullet
from gaplab.services.specs.assembly import Simulation

ROBOT = Quadruped()
MANY = 96
"""Genomes of a batch: enough for two threads to be busy to the end."""


def simulation(engine: Engine) -> Simulation:
    """The quadruped under the paper's three tunables."""
    return Simulation(ROBOT, engine, [tunables[name]() for name in TUNED])


def one_by_one(engine: Engine, count: int) -> Callable[[], int]:
    """Rollouts through `Simulate`, one genome a call as the paper's evolution asks for them."""
    simulate, drawn = simulation(engine), genomes(count)

    def work() -> int:
        for genome in drawn:
            simulate(genome[None], SWITCHING)
        return len(drawn)

    return work


def call_by_call() -> Callable[[], int]:
    """The engine alone, one motion a call, the motions made beforehand: what its own work costs."""
    engine, motions = MuJoCo(), [ROBOT.motion(genome) for genome in genomes(MANY)]

    def work() -> int:
        for motion in motions:
            engine.rollout(ROBOT.world, motion)
        return MANY

    return work


def at_once(engine: Engine) -> Callable[[], int]:
    """The same through `Simulate` in one call."""
    simulate, drawn = simulation(engine), genomes(MANY)

    def work() -> int:
        return simulate(drawn, SWITCHING).size

    return work


def bare(threads: int) -> Callable[[], int]:
    """`mujoco.rollout` of the same motions in the same model under the same law, its inputs made beforehand."""
    engine = MuJoCo(MuJoCo.Options(threads=threads))
    scene: MuJoCoScene = engine._scene(ROBOT.world)
    motions = [ROBOT.motion(genome) for genome in genomes(MANY)]
    steps = int(scene._steps(motions[0].observe_s)[-1])
    controls = scene._controls(motions, steps)
    start = np.tile(scene._start, (MANY, 1))
    models = scene._painted([ROBOT.world.material]) * MANY
    pool = library.Rollout(nthread=threads if threads > 1 else 0)

    def work() -> int:
        with _in_force(scene._mujoco, *scene._callbacks):
            pool.rollout(models, scene._datas, start, controls, control_spec=mjtState.mjSTATE_QFRC_APPLIED.value)
        return MANY

    return work


def rows(rounds: int) -> list[Row]:
    """One by one and in batches, beside PyBullet and beside MuJoCo alone."""
    rivals = {
        "pybullet": one_by_one(PyBullet(), 12),
        "single": one_by_one(MuJoCo(), MANY),
        "calls": call_by_call(),
        "batch": at_once(MuJoCo()),
        "bare": bare(1),
        "batch on 2": at_once(MuJoCo(MuJoCo.Options(threads=2))),
        "bare on 2": bare(2),
    }
    measured = rates(rivals, rounds)

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
