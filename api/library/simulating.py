"""`gaplab.simulate`: controllers in simulators of one's choice, in this process."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import groupby
from typing import Any, TypeAlias

import numpy as np

from gaplab.api.library.robots import AnyRobot, Named, settings
from gaplab.schemas.base import Real
from gaplab.schemas.plugin import PluginRef
from gaplab.schemas.records import SimulatorRead
from gaplab.schemas.spec import SharedSettings
from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.errors import InvalidSpec, Violation
from gaplab.services.engines.base import Engine
from gaplab.services.specs.assembly import edits_of, engine_of
from gaplab.services.specs.blame import refusing_specs
from gaplab.services.specs.defaults import default_engine
from gaplab.services.specs.measured import genome_violations
from gaplab.services.specs.resolution import usable
from gaplab.services.specs.robots import Driven, robot_of
from gaplab.services.specs.simulation import Simulation
from gaplab.services.specs.violations import engine_violations, parameter_violations
from gaplab.services.world.motions import Trajectory
from gaplab.services.world.robots.base import Robot

Values: TypeAlias = Mapping[str, float] | SimulatorRead | None
"""A simulator: the value of each tunable, or what the client returns; None for the robot as it is."""


class _Asked(SharedSettings):
    genomes: tuple[tuple[Real, ...], ...] = ()
    values: tuple[dict[str, Real], ...] = ()


@dataclass(frozen=True, eq=False)
class Simulated:
    """What n controllers do in m simulators, as the service computes it to the last bit; nan where the physics failed.

    Attributes:
        fitness: `(n, m)`, in `robot.unit`.
        readings: `(n, m, times, sensors)`, in the units of `robot.sensors`, which has their times and names.
        robot: what was simulated.
    """

    fitness: FloatArray
    readings: FloatArray = field(repr=False)
    robot: Robot = field(repr=False)
    _genomes: FloatArray = field(repr=False)
    _simulators: Sequence[tuple[Simulation, FloatArray]] = field(repr=False)

    def trajectory(self, genome: int = 0, simulator: int = 0) -> Trajectory:
        """Return the motion of a controller in a simulator, by their numbers, fifty times a second; it is computed now.

        Its leading axis are the bodies of `robot.world`; the base alone, of an engine that tells no angles of joints.

        Raises:
            InvalidSpec: the robot has no body.
        """
        from gaplab.services.replay.rollout import frame_times, poses_of

        if not self.robot.world.bodies:
            message = f"the {self.robot.label} has no body, so it has no motion"
            raise InvalidSpec([Violation("/robot", self.robot.label, message, "a robot with a body")])
        chosen, (simulation, parameters) = self._genomes[genome], self._simulators[simulator]
        times_s = frame_times(float(self.robot.motion(chosen).observe_s[-1]))
        _, positions_m, orientations = poses_of(*simulation.record(chosen, parameters, times_s))
        return Trajectory(times_s, positions_m.swapaxes(0, 1), orientations.swapaxes(0, 1))


@refusing_specs()
def simulate(
    robot: AnyRobot,
    genomes: Any,  # noqa: ANN401 - numbers in whatever holds them
    values: Values | Sequence[Values] = None,
    *,
    engine: Named = None,
    controller: Named = None,
    task: Named = None,
) -> Simulated:
    """Return what controllers do in simulators, computed in this process.

        found = gaplab.simulate("a1.json", genomes, {"mass(trunk)": 5.1, "dynamic_friction": 0.7}, engine="mujoco")

    Args:
        robot: its name, its robot file, URDF or MJCF, or a spec; errors are also those of `read_robot`.
        genomes: `(n, g)`, or one of them, `(g,)`.
        values: value of each tunable, or a simulator as the client returns it, or several; None: the robot as it is.
        engine: left out: that of the spec, or the robot's; so are `controller` and `task`.
        controller: what turns a genome into a motion.
        task: what rates it.

    Raises:
        InvalidSpec: with every violation: its place among the arguments, the value, and what is permitted.
    """
    rows = np.asarray(genomes, dtype=object).tolist()
    simulators = values if isinstance(values, Sequence) else [values]
    given = {
        "genomes": rows if rows and isinstance(rows[0], list) else [rows],
        "values": [each.parameters if isinstance(each, SimulatorRead) else each or {} for each in simulators],
    }
    asked = settings(_Asked, robot, engine=engine, controller=controller, task=task, **given)
    made = robot_of(Driven(asked.robot, asked.controller, asked.task))
    ref = asked.engine or PluginRef(name=default_engine(made))
    if violations := list(_violations(asked, made, usable(ref, made, "/engine"))):
        raise InvalidSpec(violations)
    genomes, columns = np.array(asked.genomes), list[tuple[Simulation, FloatArray]]()
    outcomes = [np.empty((len(genomes), 0, 1 + made.sensors.size))]
    for names, alike in groupby(asked.values, key=tuple):
        parameters = np.array([list(each.values()) for each in alike], dtype=np.float64)
        simulation = Simulation(made, engine_of(ref), edits_of(names))
        columns += [(simulation, row) for row in parameters]
        outcomes.append(simulation.sense(genomes, parameters))
    every = np.concatenate(outcomes, axis=1)
    return Simulated(every[..., 0], made.sensors.values(every[..., 1:]), made, genomes, columns)


def _violations(asked: _Asked, robot: Robot, engine: type[Engine]) -> Iterator[Violation]:
    yield from engine_violations(robot, {engine: "/engine"})
    for place, values in enumerate(asked.values):
        yield from parameter_violations(values, robot, engine, ("values", place))
    for place, genome in enumerate(asked.genomes):
        found = genome_violations(genome, robot.label, robot.space)
        yield from (each.moved("/genome", f"/genomes/{place}") for each in found)
