"""What encoders cost: rollouts of the quadruped of which all joints are read at 50 Hz, against the same without.

Rates are by seconds of the processor.
"""

from time import process_time

from benchmarks.engines import GENOMES, ROBOT, SWITCHING, TUNED, Work, genomes, through_simulate
from benchmarks.measure import Row, compared
from gaplab.services.engines.base import Engine
from gaplab.services.engines.mujoco import MuJoCo
from gaplab.services.engines.physx import PhysX
from gaplab.services.engines.pybullet import PyBullet
from gaplab.services.specs.simulation import Simulation
from gaplab.services.world.controllers import controllers
from gaplab.services.world.tasks.walk import Walk, WalkOptions
from gaplab.services.world.tunables import tunables

ENGINES = (PyBullet, MuJoCo, PhysX)
READ = WalkOptions(sensors=("angles", "speeds", "torques"), every_s=0.02)
WAYS = {"one genome a call": False, f"{GENOMES} genomes a call": True}


def sensed(engine: Engine, *, batch: bool) -> Work:
    """Return work: the rollouts of `through_simulate`, with readings of all joints."""
    robot = ROBOT.driven_by(controllers.create(ROBOT.usual_controller), Walk(READ))
    simulate, drawn = Simulation(robot, engine, [tunables[name]() for name in TUNED]), genomes()
    return lambda: sum(len(simulate.sense(each, SWITCHING)) for each in ([drawn] if batch else drawn[:, None]))


def rows(rounds: int) -> list[Row]:
    """Measure the engines that are installed, in turn."""
    competitors, pairs = dict[str, Work](), []
    for kind in (each for each in ENGINES if each.available()):
        for way, batch in WAYS.items():
            bare = f"{kind.name}, {way}"
            competitors |= {bare: through_simulate(kind(), batch=batch), f"{bare}, read": sensed(kind(), batch=batch)}
            pairs.append((f"{bare}, read", bare, "≥ 0.91"))
    return compared(competitors, pairs, rounds, process_time)
