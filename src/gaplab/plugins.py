"""Names for your own plug-ins, each in one file.

A plug-in is a strategy, robot, controller, task, tunable, optimizer, engine, discrepancy or tuner.

Put the file into a folder that GAPLAB_PLUGINS names, and start the service. docs/how-to describes each kind.
"""

from gaplab.schemas.base import Frozen as Frozen
from gaplab.schemas.base import Real as Real
from gaplab.schemas.plugin import PluginRef as PluginRef
from gaplab.services.core.arrays import Fitnesses as Fitnesses
from gaplab.services.core.arrays import FloatArray as FloatArray
from gaplab.services.core.arrays import Genome as Genome
from gaplab.services.core.arrays import Genomes as Genomes
from gaplab.services.core.arrays import Outcomes as Outcomes
from gaplab.services.core.arrays import Parameters as Parameters
from gaplab.services.core.arrays import frozen as frozen
from gaplab.services.core.discrepancies.base import Discrepancy as Discrepancy
from gaplab.services.core.errors import TryAgain as TryAgain
from gaplab.services.core.optimizers.base import Optimizer as Optimizer
from gaplab.services.core.optimizers.base import Population as Population
from gaplab.services.core.scoring import scaled_uniqueness_penalty as scaled_uniqueness_penalty
from gaplab.services.core.scoring import simulator_weights as simulator_weights
from gaplab.services.core.scoring import uniqueness_penalty as uniqueness_penalty
from gaplab.services.core.scoring import weighted_deviation as weighted_deviation
from gaplab.services.core.scoring import weighted_mean as weighted_mean
from gaplab.services.core.space import Space as Space
from gaplab.services.core.strategies.base import DiverseOptions as DiverseOptions
from gaplab.services.core.strategies.base import Search as Search
from gaplab.services.core.strategies.base import Strategy as Strategy
from gaplab.services.core.strategies.base import Untuned as Untuned
from gaplab.services.core.tuners.base import Tuner as Tuner
from gaplab.services.core.tuners.base import TuningTask as TuningTask
from gaplab.services.core.types import Belief as Belief
from gaplab.services.core.types import Sample as Sample
from gaplab.services.core.types import Simulator as Simulator
from gaplab.services.engines import engines as engines
from gaplab.services.engines.base import Engine as Engine
from gaplab.services.world.controllers.base import Controller as Controller
from gaplab.services.world.motions import Act as Act
from gaplab.services.world.motions import Loop as Loop
from gaplab.services.world.motions import Motion as Motion
from gaplab.services.world.motions import Trajectory as Trajectory
from gaplab.services.world.robots import robots as robots
from gaplab.services.world.robots.base import Robot as Robot
from gaplab.services.world.robots.base import Sensors as Sensors
from gaplab.services.world.tasks.base import Task as Task
from gaplab.services.world.tunables.base import IN_PLACE as IN_PLACE
from gaplab.services.world.tunables.base import MaterialTunable as MaterialTunable
from gaplab.services.world.tunables.base import Tunable as Tunable
from gaplab.services.world.world import Body as Body
from gaplab.services.world.world import Box as Box
from gaplab.services.world.world import Capsule as Capsule
from gaplab.services.world.world import Cylinder as Cylinder
from gaplab.services.world.world import Hull as Hull
from gaplab.services.world.world import Inertia as Inertia
from gaplab.services.world.world import Joint as Joint
from gaplab.services.world.world import Material as Material
from gaplab.services.world.world import Motor as Motor
from gaplab.services.world.world import Noise as Noise
from gaplab.services.world.world import Part as Part
from gaplab.services.world.world import PDMotor as PDMotor
from gaplab.services.world.world import Sphere as Sphere
from gaplab.services.world.world import World as World
