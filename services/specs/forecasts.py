"""The safety forecast of a spec: what the believed simulators expect of a controller before a robot runs it."""

from collections.abc import Callable
from typing import Protocol

from gaplab.schemas.resolved import ResolvedSpec
from gaplab.schemas.safety import Safety
from gaplab.services.core.arrays import FloatArray, Genome, Parameters
from gaplab.services.core.motions import Recording
from gaplab.services.core.robots.base import Robot
from gaplab.services.core.safety import MOST_SIMULATORS, Extremes, extremes, recording_times, safety
from gaplab.services.core.world import World


class RecordsRollouts(Protocol):
    """A simulation that records rollouts."""

    def record(self, genome: Genome, parameters: FloatArray, times_s: FloatArray) -> tuple[World, Recording]:
        """Return the world of a simulator `(p,)`, and the recorded rollout of a genome `(g,)` in it."""
        ...


class SafetyForecast:
    """The safety forecast of an experiment with a physical robot.

    Args:
        spec: spec of the experiment.
        robot: its robot, which has a body.
        simulation: simulation of the robot.
    """

    def __init__(self, spec: ResolvedSpec, robot: Robot, simulation: RecordsRollouts) -> None:
        self._limits, self._engine = spec.reality.limits, spec.engine.name
        self._robot, self._simulation = robot, simulation

    def __call__(self, genome: Genome, parameters: Parameters, progress: Callable[[], None] = lambda: None) -> Safety:
        """Return what simulators `(m, p)`, the best first, expect of a genome `(g,)`; the first 20 are asked.

        Args:
            genome: controller to run.
            parameters: simulators.
            progress: called after each rollout.
        """
        rollouts, errors = list[Extremes](), set[str]()
        for simulator in parameters[:MOST_SIMULATORS]:
            try:
                rollouts.append(self._extremes(genome, simulator))
            except Exception as error:  # noqa: BLE001 - a plug-in may raise anything, and the request goes on
                rollouts.append(Extremes())
                errors.add(f"{type(error).__name__}: {error}"[:300])
            progress()
        found = safety(rollouts, self._limits, self._engine)
        return found.model_copy(update={"unknown": (*found.unknown, *sorted(errors))})

    def _extremes(self, genome: Genome, simulator: FloatArray) -> Extremes:
        motion = self._robot.motion(genome)
        times_s = recording_times(motion, self._robot.world)
        world, recording = self._simulation.record(genome, simulator, times_s)
        return extremes(world, motion, recording, float(self._robot.fitness(recording.trajectory)))


def forecast_of(spec: ResolvedSpec, robot: Robot, simulation: RecordsRollouts) -> SafetyForecast | None:
    """Return the forecast of a spec; None if its reality is simulated, or its robot has no body."""
    if spec.reality.kind != "physical" or not robot.world.bodies:
        return None
    return SafetyForecast(spec, robot, simulation)
