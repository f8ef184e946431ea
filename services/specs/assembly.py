"""Assembly: from a resolved spec to the simulation and the reality of its repetitions."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import cache, lru_cache, partial
from types import ModuleType

import numpy as np

from gaplab.schemas.plugin import PluginRef
from gaplab.schemas.resolved import ResolvedSpec, ResolvedTunable
from gaplab.schemas.sensitivity import Checked
from gaplab.services.core import external_plugins
from gaplab.services.core.arrays import Fitnesses, FloatArray, Genome, Genomes, Outcomes, Parameters, frozen
from gaplab.services.core.discrepancies import discrepancies
from gaplab.services.core.errors import PluginBroken, RealityFailed, gather
from gaplab.services.core.loop import Setting
from gaplab.services.core.optimizers import optimizers
from gaplab.services.core.robots import robots
from gaplab.services.core.robots.base import Robot
from gaplab.services.core.sensitivity import Subject
from gaplab.services.core.space import Space
from gaplab.services.core.strategies import strategies
from gaplab.services.core.tunables import tunables
from gaplab.services.core.tunables.base import Tunable
from gaplab.services.core.tuners import tuners
from gaplab.services.core.types import Budget, Outcome
from gaplab.services.core.world import Recording, Trajectory, World
from gaplab.services.engines import engines
from gaplab.services.engines.base import Engine

WORLDS_KEPT = 4096


class Simulation:
    """A Simulate of one robot on one engine, in worlds that tunables edit."""

    def __init__(self, robot: Robot, engine: Engine, edits: Sequence[Tunable]) -> None:
        self._robot = robot
        self._engine = engine
        self._edits = tuple(edits)
        self._world = lru_cache(maxsize=WORLDS_KEPT)(self._edited)

    def __call__(self, genomes: Genomes, parameters: Parameters) -> Fitnesses:
        """Return the `(n, m)` fitnesses of genomes `(n, g)` in simulators `(m, p)`; nan where the physics failed.

        An infinite fitness counts as failed physics.
        """
        worlds = [self._world(tuple(row)) for row in parameters.tolist()]
        motions = [self._robot.motion(genome) for genome in genomes]
        return self._fitnesses(self._engine.rollouts(worlds, motions), len(genomes), len(parameters))

    def sense(self, genomes: Genomes, parameters: Parameters) -> Outcomes:
        """Return fitness and readings `(n, m, 1 + q)`: the fitness of a call, then each reading over its noise.

        A robot without sensors has no readings.
        """
        sensors = self._robot.sensors
        worlds = [self._world(tuple(row)) for row in parameters.tolist()]
        motions = [self._robot.motion(genome) for genome in genomes]
        observed_s = motions[0].observe_s
        often_s = np.union1d(observed_s, sensors.times_s)
        seen = self._engine.rollouts(worlds, [replace(motion, observe_s=often_s) for motion in motions])
        fitnesses = self._fitnesses(_at(seen, observed_s), len(genomes), len(parameters))
        if not sensors.size:
            return fitnesses[..., None]
        values = self._robot.sense(_at(seen, sensors.times_s))
        expected = (len(genomes), len(parameters), len(sensors.times_s), len(sensors.names))
        if np.shape(values) != expected:
            found = f"robot {self._robot.name!r} returned readings of shape {np.shape(values)}"
            raise PluginBroken(f"{found}; permitted: {expected}")
        failed = np.isnan(fitnesses)[..., None]
        return np.concatenate([fitnesses[..., None], np.where(failed, np.nan, sensors.standardised(values))], axis=-1)

    def _fitnesses(self, seen: Trajectory, genomes: int, simulators: int) -> Fitnesses:
        fitnesses = self._robot.fitness(seen)
        if np.shape(fitnesses) != (genomes, simulators):
            expected = f"the fitness of {genomes} genomes in {simulators} simulators"
            raise PluginBroken(f"robot {self._robot.name!r} returned {np.shape(fitnesses)} numbers for {expected}")
        return np.where(np.isfinite(fitnesses), fitnesses, np.nan)

    def record(self, genome: Genome, parameters: FloatArray, times_s: FloatArray) -> tuple[World, Recording]:
        """Return the world of a simulator `(p,)`, and the rollout of a genome in it, recorded at times `(k,)` too."""
        world = self._world(tuple(parameters.tolist()))
        return world, self._engine.record(world, self._robot.motion(genome), times_s)

    def _edited(self, values: tuple[float, ...]) -> World:
        world = self._robot.world
        for tunable, value in zip(self._edits, values, strict=True):
            world = tunable.edit(world, value)
        return world


def _at(seen: Trajectory, times_s: FloatArray) -> Trajectory:
    """Return the observations at some of the times of a trajectory."""
    where = np.searchsorted(seen.times_s, times_s)
    return Trajectory(times_s, seen.positions_m[..., where, :], seen.orientations[..., where, :])


class HiddenReality:
    """A simulation with hidden parameters.

    Args:
        simulation: the simulation on reality's engine.
        parameters: `(p,)`, the hidden parameters.
    """

    def __init__(self, simulation: Simulation, parameters: FloatArray) -> None:
        self._simulation = simulation
        self._parameters = parameters[None, :]

    def ask(self, question: Callable[[Genomes, Parameters], FloatArray], genomes: Genomes) -> FloatArray:
        """Return what the simulation answers about genomes `(n, g)` in reality, `(n, 1, ...)`.

        Raises:
            RealityFailed: its code raised an error.
        """
        try:
            return question(genomes, self._parameters)
        except (Exception, SystemExit) as error:
            raise RealityFailed("reality failed") from error


class MeasuredReality(HiddenReality):
    """A Reality that is a simulation with hidden parameters."""

    def __call__(self, genome: Genome) -> Outcome:
        """Return fitness and readings of a genome `(g,)` in reality; nan if the physics failed."""
        fitness, *readings = self.ask(self._simulation.sense, genome[None, :])[0, 0]
        return Outcome(float(fitness), frozen(readings))


class EvolutionInReality(HiddenReality):
    """A Simulate for the direct baseline: every simulator is reality."""

    def __call__(self, genomes: Genomes, parameters: Parameters) -> Fitnesses:
        """Return the fitnesses of genomes `(n, g)` in reality, `(n, m)`; the m simulators do not matter."""
        return np.repeat(self.ask(self._simulation, genomes), len(parameters), axis=1)


def setting(spec: ResolvedSpec, repetition: int) -> Setting:
    """Return the setting of one repetition.

    Args:
        spec: spec of the experiment.
        repetition: the number of the repetition, from 0.
    """
    robot = robots.create(spec.robot)
    strategy = strategies.create(spec.strategy)
    edits = edits_of(ref.name for ref in spec.tunables)
    truth, real = reality_of(spec, robot)
    engine = engine_of(spec.engine)
    simulation = Simulation(robot, engine, edits)
    return Setting(
        simulate=EvolutionInReality(real, truth) if strategy.in_reality else simulation,
        sense=simulation.sense,
        reality=MeasuredReality(real, truth),
        strategy=strategy,
        optimizer=optimizers.create(spec.optimizer),
        genomes=robot.space,
        parameters=parameters_of(spec.tunables),
        known=robot.known,
        budget=Budget(**spec.budget.model_dump(exclude={"preset"})),
        iterations=spec.iterations if strategy.takes_samples else 0,
        seed=spec.seed,
        repetition=repetition,
        batch_size=lambda: engine.batch,
        discrepancy=discrepancies.create(spec.discrepancy),
        tuner=tuners.create(spec.tuner),
        held_out=spec.held_out,
        reading_times_s=robot.sensors.reading_times_s,
        names=tuple(ref.name for ref in spec.tunables),
    )


def subject(checked: Checked) -> Subject:
    """Return what a sensitivity check simulates."""
    robot = robots.create(checked.robot)
    edits = edits_of(ref.name for ref in checked.tunables)
    return Subject(
        simulate=Simulation(robot, engine_of(checked.engine), edits),
        genomes=robot.space,
        known=robot.known,
        parameters=parameters_of(checked.tunables),
        names=tuple(ref.name for ref in checked.tunables),
    )


def reality_of(spec: ResolvedSpec, robot: Robot) -> tuple[FloatArray, Simulation]:
    """Return the hidden parameters `(p,)` of reality, and the simulation on its engine."""
    edits = edits_of(spec.reality.parameters)
    truth = np.array(list(spec.reality.parameters.values()))
    return truth, Simulation(robot, engine_of(spec.reality.engine), edits)


def edits_of(names: Iterable[str]) -> list[Tunable]:
    """Return the tunables of these names.

    Raises:
        InvalidSpec: a tunable is not installed here.
    """
    return [tunables.create(PluginRef(name=name), "/tunables") for name in names]


def refuse_missing(spec: ResolvedSpec, *, reality: bool = False) -> None:
    """Check that the plug-ins that a stored spec simulates with are installed here.

    Args:
        spec: spec of the experiment.
        reality: also check the plug-ins of reality.

    Raises:
        InvalidSpec: a plug-in is missing; perhaps its file was removed.
    """
    needed = [(spec.engine, "/engine"), *([(spec.reality.engine, "/reality/engine")] if reality else [])]
    names = [*(ref.name for ref in spec.tunables), *(spec.reality.parameters if reality else ())]
    gather(
        lambda: robots.check(spec.robot, "/robot"),
        *(partial(engines.check, ref, pointer) for ref, pointer in needed),
        lambda: edits_of(names),
    )


def engine_of(ref: PluginRef) -> Engine:
    """Return the engine: one instance in this process for equal options, which keeps its worlds loaded.

    Raises:
        InvalidSpec: it is not available here.
    """
    return _warm_engine(external_plugins.package(), ref.model_dump_json())


@cache
def _warm_engine(_package: ModuleType | None, ref: str) -> Engine:
    return engines.create(PluginRef.model_validate_json(ref))


def parameters_of(refs: Sequence[ResolvedTunable]) -> Space:
    """Return the space of simulators between the bounds of the tunables."""
    return Space.box([ref.lower for ref in refs], [ref.upper for ref in refs])
