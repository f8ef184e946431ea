"""Assembly: from a resolved spec to the simulation and the reality of its repetitions."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import cache, lru_cache, partial

import numpy as np

from gaplab.schemas.plugin import PluginRef
from gaplab.schemas.resolved import ResolvedSpec, ResolvedTunable
from gaplab.schemas.sensitivity import Checked
from gaplab.services.core.answers import Answers
from gaplab.services.core.arrays import Fitnesses, FloatArray, Genome, Genomes, Parameters, frozen
from gaplab.services.core.discrepancies import discrepancies
from gaplab.services.core.errors import GaplabError, gather
from gaplab.services.core.loop import Setting
from gaplab.services.core.optimizers import optimizers
from gaplab.services.core.ports import Reality, Sense, Simulate, physical_reality
from gaplab.services.core.space import Space
from gaplab.services.core.strategies import strategies
from gaplab.services.core.tuners import tuners
from gaplab.services.core.tuning import Misfit
from gaplab.services.core.types import Budget, Outcome
from gaplab.services.engines import engines
from gaplab.services.engines.base import Engine
from gaplab.services.findings.sensitivity import Subject
from gaplab.services.specs.measured import samples_of
from gaplab.services.specs.recorded import RecordedReality, is_recorded
from gaplab.services.specs.resolution import hardware_of
from gaplab.services.specs.robots import robot_of
from gaplab.services.specs.simulation import Simulation, forecast_of
from gaplab.services.world.robots.base import Robot
from gaplab.services.world.tunables.base import Tunable
from gaplab.services.world.tunables.labels import tunable_of

WARM_ENGINES = 4
"""Most engines that a process keeps; each keeps worlds, of 34 MB each in Bullet. A repetition has two at most."""


class RealityFailed(GaplabError):
    """The code of reality raised the error that is this one's cause; its message may name hidden parameters."""


class HiddenReality:
    """A simulation on reality's engine, with hidden parameters `(p,)`."""

    def __init__(self, simulation: Simulation, parameters: FloatArray) -> None:
        self._simulation = simulation
        self._parameters = parameters[None, :]

    def ask(self, question: Callable[[Genomes, Parameters], FloatArray], genomes: Genomes) -> FloatArray:
        """Return fitness or outcomes of genomes `(n, g)` in reality, `(n, 1, ...)`.

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
    """Return the setting of a repetition of an experiment, by its number, from 0."""
    robot = robot_of(spec)
    strategy = strategies.create(spec.strategy)
    engine, simulation = engine_of(spec.engine), simulation_of(spec, robot)
    simulate, reality = _realities(spec, robot, simulation, in_reality=strategy.in_reality)
    found = Setting(
        simulate=simulate,
        sense=simulation.sense,
        reality=reality,
        strategy=strategy,
        optimizer=optimizers.create(spec.optimizer),
        controller_optimizer=optimizers.create(spec.controller_optimizer),
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
        reading_periods=robot.sensors.reading_periods,
        names=tuple(ref.name for ref in spec.tunables),
        probes=spec.reality.probes,
        known_samples=samples_of(spec),
        forecast=forecast_of(spec, robot, simulation),
        noise=spec.reality.noise or 0.0,
        noise_unit=spec.reality.noise_unit or 0.0,
    )
    return _recorded(found, spec, robot) if is_recorded(spec) else found


def _recorded(found: Setting, spec: ResolvedSpec, robot: Robot) -> Setting:
    """Return a setting whose reality is recorded; a strategy that takes no samples is given all recordings at once."""
    reality = RecordedReality(spec, robot.sensors, found.repetition)
    as_it_is = Simulation(robot, engine_of(spec.engine), [])

    @cache
    def untuned() -> float:
        answers = Answers(as_it_is, sense=as_it_is.sense, periods=found.reading_periods)
        misfit = Misfit(answers, reality.tests, found.discrepancy, found.reading_times_s)
        return float(misfit.of(np.empty((1, 0)))[0])

    return replace(
        found,
        reality=reality,
        candidates=reality.candidates,
        tests=reality.tests,
        untuned=untuned,
        commands=reality.commands,
        known_samples=() if found.strategy.takes_samples else reality.all_samples,
    )


def simulated(spec: ResolvedSpec) -> tuple[Simulate, Sense]:
    """Return the same `simulate` and `sense` as `setting`, without an engine of reality that these do not use.

    So a process that only simulates opens no hardware.
    """
    robot = robot_of(spec)
    simulation = simulation_of(spec, robot)
    if not strategies[spec.strategy.name].in_reality or is_recorded(spec):
        return simulation, simulation.sense
    assert hardware_of(spec) is None, "a strategy that evolves in reality is refused for hardware"
    return _realities(spec, robot, simulation, in_reality=True)[0], simulation.sense


def simulation_of(spec: ResolvedSpec | Checked, robot: Robot) -> Simulation:
    """Return the simulation of a robot on the engine of a spec, in simulators of its tunables."""
    return Simulation(robot, engine_of(spec.engine), edits_of(ref.name for ref in spec.tunables))


def _realities(
    spec: ResolvedSpec, robot: Robot, simulation: Simulation, *, in_reality: bool
) -> tuple[Simulate, Reality]:
    """Return the ways to evaluate a controller in simulation and in reality."""
    if spec.reality.kind != "simulated":
        return simulation, physical_reality  # recordings take its place
    truth, real = reality_of(spec, robot)
    return EvolutionInReality(real, truth) if in_reality else simulation, MeasuredReality(real, truth)


def subject(checked: Checked) -> Subject:
    """Return the subject of a sensitivity check: its simulation, controllers and tunables."""
    robot = robot_of(checked)
    return Subject(
        simulate=simulation_of(checked, robot),
        genomes=robot.space,
        known=robot.known,
        parameters=parameters_of(checked.tunables),
        names=tuple(ref.name for ref in checked.tunables),
    )


def reality_of(spec: ResolvedSpec, robot: Robot) -> tuple[FloatArray, Simulation]:
    """Return the hidden parameters `(p,)` of a simulated reality, and the simulation on its engine."""
    assert spec.reality.engine is not None, "a physical reality has no engine"
    truth = np.array(list(spec.reality.parameters.values()))
    return truth, Simulation(robot, engine_of(spec.reality.engine), edits_of(spec.reality.parameters))


def edits_of(names: Iterable[str]) -> list[Tunable]:
    """Return the tunables of these labels.

    Raises:
        InvalidSpec: a tunable is not installed here.
    """
    return [tunable_of(name, "/tunables") for name in names]


def refuse_missing(spec: ResolvedSpec, *, reality: bool = False) -> None:
    """Check that the plug-ins that a stored spec simulates with, or also those of reality, are installed here.

    Raises:
        InvalidSpec: a plug-in is missing; perhaps its file was removed.
    """
    needed = [(spec.engine, "/engine")]
    if reality and spec.reality.engine is not None:
        needed.append((spec.reality.engine, "/reality/engine"))
    names = [*(ref.name for ref in spec.tunables), *(spec.reality.parameters if reality else ())]
    gather(
        lambda: robot_of(spec),
        *(partial(engines.check, ref, pointer) for ref, pointer in needed),
        lambda: edits_of(names),
    )


def engine_of(ref: PluginRef) -> Engine:
    """Return the engine: one instance in this process for equal options, which keeps its worlds loaded.

    Raises:
        InvalidSpec: it is not available here.
    """
    return _warm_engine(ref.model_dump_json())


@lru_cache(maxsize=WARM_ENGINES)
def _warm_engine(ref: str) -> Engine:
    return engines.create(PluginRef.model_validate_json(ref))


def parameters_of(refs: Sequence[ResolvedTunable]) -> Space:
    """Return the space of simulators between the bounds of the tunables."""
    return Space.box([ref.lower for ref in refs], [ref.upper for ref in refs])
