"""The safety forecast of a spec: what the believed simulators expect of a controller before a robot runs it."""

from collections.abc import Callable

from gaplab.schemas.resolved import ResolvedSpec
from gaplab.schemas.safety import Safety
from gaplab.services.core.arrays import FloatArray, Genome, Parameters
from gaplab.services.core.robots.base import Robot
from gaplab.services.core.safety import MOST_SIMULATORS, Extremes, extremes, recording_times, safety
from gaplab.services.specs.simulation import Simulation


class SafetyForecast:
    """The safety forecast of an experiment with a physical robot, which has a body."""

    def __init__(self, spec: ResolvedSpec, robot: Robot, simulation: Simulation) -> None:
        self._limits, self._engine = spec.reality.limits, spec.engine.name
        self._robot, self._simulation = robot, simulation

    def __call__(self, genome: Genome, parameters: Parameters, progress: Callable[[], None] = lambda: None) -> Safety:
        """Return what simulators `(m, p)`, the best first, expect of a genome `(g,)`; the first 20 are asked."""
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


def forecast_of(spec: ResolvedSpec, robot: Robot, simulation: Simulation) -> SafetyForecast | None:
    """Return the forecast of a spec; None if its reality is simulated, or its robot has no body."""
    if spec.reality.kind != "physical" or not robot.world.bodies:
        return None
    return SafetyForecast(spec, robot, simulation)
