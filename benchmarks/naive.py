"""The same robot and episode as a user would write them, after PyBullet's examples."""

from collections.abc import Callable
from multiprocessing import get_context
from multiprocessing.pool import Pool
from pathlib import Path
from tempfile import mkdtemp

import numpy as np
import pybullet

from benchmarks.physics import genomes
from benchmarks.urdf import urdf
from gaplab.services.core.arrays import Genome
from gaplab.services.core.motions import open_loop
from gaplab.services.core.robots.quadruped import Quadruped

STEP_S = 1 / 240
"""Time step, PyBullet's default; its default of 50 solver iterations applies too."""


def evaluate(file: str, genome: Genome) -> float:
    """Simulate from scratch: load the URDF file and command every motor in every step, with Bullet's defaults."""
    robot = Quadruped()
    pybullet.resetSimulation()
    pybullet.setGravity(0, 0, -robot.world.gravity_m_s2)
    plane = pybullet.createMultiBody(0, pybullet.createCollisionShape(pybullet.GEOM_PLANE))
    pybullet.changeDynamics(plane, -1, lateralFriction=1.0)
    body = pybullet.loadURDF(file, basePosition=[0, 0, robot.world.start_height_m])
    motion, motors = open_loop(robot.motion(genome)), [joint.motor for joint in robot.world.actuators]
    forces = [motor.max_torque_nm for motor in motors if motor]
    joints = list(range(pybullet.getNumJoints(body)))
    for step in range(round(motion.observe_s[-1] / STEP_S)):
        row = int(np.searchsorted(motion.times_s, step * STEP_S, side="right")) - 1
        targets = motion.targets[row].tolist()
        pybullet.setJointMotorControlArray(
            body, joints, pybullet.POSITION_CONTROL, targetPositions=targets, forces=forces
        )
        pybullet.stepSimulation()
    position, _ = pybullet.getBasePositionAndOrientation(body)
    return float(position[0])


def work(pool: Pool) -> Callable[[], int]:
    """Return work: all genomes, distributed over the pool."""
    file = Path(mkdtemp()) / "quadruped.urdf"
    file.write_text(urdf(Quadruped().world))

    def run() -> int:
        return len(pool.starmap(evaluate, [(str(file), genome) for genome in genomes()], chunksize=1))

    return run


def pool(processes: int) -> Pool:
    """Return a pool of processes with a Bullet server each."""
    return get_context("spawn").Pool(processes, pybullet.connect, (pybullet.DIRECT,))
