"""What a plug-in of one's own is written with: a strategy, robot, tunable, optimizer or engine, each in one file.

Put the file into the folder that GAPLAB_PLUGINS names, and start the service: docs/how-to says more of each kind.
"""

from schemas.base import Frozen as Frozen
from schemas.base import Real as Real
from services.core.arrays import Fitnesses as Fitnesses
from services.core.arrays import FloatArray as FloatArray
from services.core.arrays import Genome as Genome
from services.core.arrays import Genomes as Genomes
from services.core.arrays import frozen as frozen
from services.core.optimizers.base import Optimizer as Optimizer
from services.core.robots.base import Robot as Robot
from services.core.scoring import simulator_weights as simulator_weights
from services.core.scoring import uniqueness_penalty as uniqueness_penalty
from services.core.scoring import weighted_deviation as weighted_deviation
from services.core.scoring import weighted_mean as weighted_mean
from services.core.strategies.base import EnsembleOptions as EnsembleOptions
from services.core.strategies.base import Search as Search
from services.core.strategies.base import Strategy as Strategy
from services.core.tunables.base import MaterialTunable as MaterialTunable
from services.core.tunables.base import Tunable as Tunable
from services.core.types import Belief as Belief
from services.core.types import Sample as Sample
from services.core.types import Simulator as Simulator
from services.core.types import Space as Space
from services.core.world import Body as Body
from services.core.world import Box as Box
from services.core.world import Joint as Joint
from services.core.world import Material as Material
from services.core.world import Motion as Motion
from services.core.world import Motor as Motor
from services.core.world import Sphere as Sphere
from services.core.world import Trajectory as Trajectory
from services.core.world import World as World
from services.engines.base import Engine as Engine
