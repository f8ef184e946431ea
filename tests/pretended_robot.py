"""A pretended robot: physics of an engine in a process of its own, with the faults of a real bench.

It is a driver for `gaplab drive`, and knows nothing of the experiment but the motions that it is sent. The variable
PRETENDED_ROBOT has its settings as JSON.
"""

import json
import os
import time
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.random import default_rng

from gaplab import MeasurementFailed
from gaplab.api.clients.driving import DriverMotion
from gaplab.schemas.plugin import PluginRef
from gaplab.services.core.arrays import frozen
from gaplab.services.specs.assembly import engine_of
from gaplab.services.world.motions import Motion
from gaplab.services.world.robots import robots
from gaplab.services.world.world import Material

SETTINGS = "PRETENDED_ROBOT"


@dataclass(frozen=True)
class Settings:
    """What the robot is, and what is wrong with it.

    Attributes:
        robot: name of the robot.
        engine: engine of its physics.
        material: friction and restitution of its feet on its floor.
        noise: standard deviation of the noise of a measured fitness, in its unit.
        latency_s: pause of each run.
        wear: share of dynamic friction that each run costs.
        battery: runs of a full battery; it then stops once, and is charged. 0: it never ends.
        sag: share of all targets' amplitude that an empty battery costs.
        falls: probability that a run cannot be measured.
        seed: of its noise.
        journal: file that counts its runs, so that wear outlives the process; "" for none.
    """

    robot: str = "quadruped"
    engine: str = "physx"
    material: Material = field(default_factory=Material)
    noise: float = 0.0
    latency_s: float = 0.0
    wear: float = 0.0
    battery: int = 0
    sag: float = 0.0
    falls: float = 0.0
    seed: int = 0
    journal: str = ""

    @classmethod
    def of_environment(cls) -> "Settings":
        """Return the settings of the environment."""
        found = json.loads(os.environ.get(SETTINGS, "{}"))
        return cls(**found | {"material": Material(**found.get("material", {}))})


class Driver:
    """Runs a motion in the engine, and returns the fitness that a person would measure."""

    def __init__(self, settings: Settings | None = None) -> None:
        self._settings = settings or Settings.of_environment()
        self._runs = 0

    def connect(self) -> None:
        """Load the engine."""
        self._robot = robots.create(PluginRef(name=self._settings.robot))
        self._engine = engine_of(PluginRef(name=self._settings.engine))
        if self._settings.journal and os.path.exists(self._settings.journal):
            self._runs = os.path.getsize(self._settings.journal)

    def run(self, motion: DriverMotion) -> float:
        """Run a motion.

        Raises:
            MeasurementFailed: it fell, or the battery was empty.
        """
        given = self._settings
        time.sleep(given.latency_s)
        run, rng = self._count(), default_rng([given.seed, self._runs])
        left = 1.0 - (run % given.battery) / given.battery if given.battery else 1.0
        if rng.random() < given.falls:
            raise MeasurementFailed("it fell off the table")
        worn = given.material.dynamic_friction * (1.0 - given.wear) ** run
        world = replace(self._robot.world, material=replace(given.material, dynamic_friction=worn))
        targets = np.array(motion.targets) * (1.0 - given.sag * (1.0 - left))
        trajectory = self._engine.rollouts(
            [world], [Motion(frozen(motion.times_s), frozen(targets), frozen(motion.observe_s))]
        )
        fitness = float(self._robot.fitness(trajectory)[0, 0])
        if not np.isfinite(fitness):
            raise MeasurementFailed("the physics failed")
        return fitness + float(rng.normal(0.0, given.noise)) if given.noise else fitness

    def stop(self) -> None:
        """Do nothing: a pretended robot stands still between runs."""

    def _count(self) -> int:
        """Count a run, and return the number of runs before it."""
        self._runs += 1
        if self._settings.journal:
            with open(self._settings.journal, "ab") as file:
                file.write(b".")
        return self._runs - 1
