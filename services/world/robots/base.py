"""The contract of a robot: a world, and what drives and rates it by default."""

from collections.abc import Mapping
from copy import copy
from dataclasses import replace
from types import MappingProxyType
from typing import Any, ClassVar, Self

import numpy as np

from gaplab.schemas.base import Frozen
from gaplab.schemas.plugin import PluginRef
from gaplab.services.core.arrays import FloatArray, Genome
from gaplab.services.core.errors import InvalidSpec, Violation
from gaplab.services.core.registry import Plugin
from gaplab.services.core.space import Space
from gaplab.services.world.controllers import controllers
from gaplab.services.world.controllers.base import Controller
from gaplab.services.world.kinematics import from_start, observes_base
from gaplab.services.world.motions import Loop, Motion, Trajectory
from gaplab.services.world.sensing import Sensors as Sensors
from gaplab.services.world.tasks import tasks
from gaplab.services.world.tasks.base import Task
from gaplab.services.world.world import World


class Robot(Plugin):
    """A morphology, with a controller that drives it and a task that rates it.

    Most robots set `world`, `usual_controller` and `usual_task`. A robot that brings a controller and a task of its
    own, like a function, has neither of these: it sets `unit`, `space` and `known`, and overrides `motion` and
    `fitness`.

    Attributes:
        engine: the engine that runs it when a spec names none.
        world: the robot in reality: its nominal world, whose coefficients are the default hidden truth.
        usual_controller: controller of a spec that names none; None if it brings its own.
        usual_task: task of a spec that names none; None if it brings its own.
        usual_tunables: labels of the tunables of a spec that names none; empty for those of every spec.
        designed: hand-designed genomes of middling fitness, by the name of their controller.
        unit: unit of its fitness.
        space: space of its genomes.
        known: `(g,)`, a hand-designed genome.
        sensors: what is read during a rollout; by default nothing.
        joints: whether `fitness` or `sense` need the joints of trajectories.
        label: name that people know it by.
    """

    engine: ClassVar[str]
    unit: str
    world: World
    usual_controller: PluginRef | None = None
    usual_task: PluginRef | None = None
    usual_tunables: tuple[str, ...] = ()
    designed: Mapping[str, Genome] = MappingProxyType({})
    space: Space
    known: Genome
    sensors: Sensors = Sensors()
    joints: bool = False
    label: str
    _controller: Controller
    _task: Task

    def __init__(self, options: Frozen | None = None) -> None:
        super().__init__(options)
        self.label = self.name
        self.build()
        if self.usual_controller is not None and self.usual_task is not None:
            usual = controllers.create(self.usual_controller, "/robot"), tasks.create(self.usual_task, "/robot")
            self._perform(*usual)

    def build(self) -> None:
        """Set what depends on the options, like `world` or `usual_task`; by default nothing does."""

    @classmethod
    def example(cls) -> "Robot":
        """Return a robot of this class, for the catalogue and the checks of the contract."""
        return cls()

    def driven_by(self, controller: Controller, task: Task) -> Self:
        """Return this robot, driven by a controller and rated by a task; both are new, and serve that robot alone."""
        robot = copy(self)
        robot._perform(controller, task)
        return robot

    def _perform(self, controller: Controller, task: Task) -> None:
        if task.commanded and controller.loops:
            message = (
                f"{task.name} needs the commands in advance, and those of {controller.name} depend on what it observes"
            )
            raise InvalidSpec([Violation("/task", task.name, message, "another task, or a controller without a loop")])
        task.prepare(self.world)
        controller.prepare(self.world, task.observe_s)
        self._controller, self._task = controller, task
        self.unit, self.sensors, self.joints = task.unit, task.sensors, task.joints
        self.space = controller.space
        known = self.designed.get(controller.name)
        fits = known is not None and known.shape == controller.known.shape
        self.known = known if known is not None and fits else controller.known

    def motion(self, genome: Genome) -> Motion | Loop:
        """Return the motion that the genome `(g,)` describes."""
        return self._controller.motion(genome)

    def fitness(self, trajectory: Trajectory) -> FloatArray:
        """Return `(...)`: the fitness of each trajectory, maximised; nan where the physics failed."""
        return self._task.fitness(trajectory)

    def sense(self, trajectory: Trajectory) -> FloatArray:
        """Return `(..., r, s)`: what the sensors say, in their units, of trajectories observed at `sensors.times_s`.

        By default they are those of the task, which sees a base that begins turned as level at the start. A robot with
        a task of its own that has sensors overrides it.
        """
        if self._task.turned and observes_base(self.world):
            trajectory = replace(trajectory, orientations=from_start(self.world, trajectory.orientations))
        return self._task.sense(trajectory)

    def rated(
        self, times_s: FloatArray, angles: Mapping[str, FloatArray], genome: Genome | None = None
    ) -> float | tuple[float, FloatArray]:
        """Return the fitness of a recorded motion on a fixed base, with readings `(r, s)` if the robot has sensors.

        Args:
            times_s: `(k,)`, ascending: seconds from the start of the motion.
            angles: `(k,)` of each joint by its name, rad, or m if it slides; of those left out, they stay at the start.
            genome: `(g,)`: the controller; without it, the fitness of a task that needs commands is nan.

        Raises:
            ValueError: the base moves, a joint is unknown, or the record ends before the last observation.
        """
        from gaplab.services.world.logs import Trace  # with SciPy, which rollouts do not need
        from gaplab.services.world.traces import placed

        motion, joints = None if genome is None else self.motion(genome), self.world.joints
        observe_s = self.motion(self.known).observe_s
        unknown = sorted(angles.keys() - {joint.name for joint in joints})
        if not self.world.fixed or unknown or times_s[-1] < observe_s[-1]:
            why = (
                f"it needs a fixed base, joints that it has, not {unknown}, and a record of {observe_s[-1]:g} s or more"
            )
            raise ValueError(f"the motion of the {self.label} does not follow from these angles: {why}")
        rows = [angles.get(joint.name, np.full(len(times_s), joint.start)) for joint in joints]
        trace = Trace(times_s, angles_rad=np.array(rows).T)
        fitness = float(self.fitness(placed(trace, 0.0, observe_s, self.world, motion)))
        if not self.sensors.size:
            return fitness
        return fitness, self.sense(placed(trace, 0.0, self.sensors.times_s, self.world, motion))

    @property
    def loops(self) -> bool:
        """Whether its controller observes while it acts, so that its motions are Loops."""
        return self.usual_controller is not None and self._controller.loops

    @property
    def is_function(self) -> bool:
        """Whether the robot is a function of one gene: its curve can be drawn, and it has no body to replay."""
        return not self.world.bodies and self.space.size == 1

    @classmethod
    def details(cls) -> dict[str, Any]:
        """Return the engine and the details of the robot, for the catalogue."""
        return {"engine": cls.engine, **cls.told(cls.example())}

    @staticmethod
    def told(robot: "Robot") -> dict[str, Any]:
        """Return the details of a robot for the catalogue, except its engine."""
        return {
            "controller": _as_json(robot.usual_controller),
            "task": _as_json(robot.usual_task),
            "unit": robot.unit,
            "genes": robot.space.size,
            "tunables": list(robot.usual_tunables),
            "function": robot.is_function,
            "bodies": len(robot.world.bodies),
            **robot.sensors.details(),
        }


def _as_json(ref: PluginRef | None) -> dict[str, Any] | None:
    return None if ref is None else ref.model_dump(mode="json")
