"""The simulation of a robot on an engine, in worlds that tunables edit; and what it forecasts for a physical robot."""

from collections.abc import Callable, Hashable, Sequence
from dataclasses import replace
from functools import lru_cache, partial
from operator import itemgetter
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from gaplab.schemas.measurements import Safety
from gaplab.schemas.resolved import ResolvedSpec
from gaplab.services.core.arrays import Fitnesses, FloatArray, Genome, Genomes, Outcomes, Parameters, frozen
from gaplab.services.core.errors import PluginBroken
from gaplab.services.engines.base import Engine
from gaplab.services.world.controllers.parts import middles
from gaplab.services.world.kinematics import started
from gaplab.services.world.motions import Loop, Motion, Recording, Trajectory, commands_at
from gaplab.services.world.robots.base import Robot
from gaplab.services.world.safety import MOST_SIMULATORS, Extremes, extremes, recording_times, safety
from gaplab.services.world.sensing import QUIET, biases, disturbed, truly_begun
from gaplab.services.world.tunables.base import Tunable
from gaplab.services.world.world import World

WORLDS_KEPT = 4096

Places: TypeAlias = slice | NDArray[np.int_]
"""Indices into the times of a trajectory."""


class Simulation:
    """A Simulate of one robot on one engine, in worlds that tunables edit."""

    def __init__(self, robot: Robot, engine: Engine, edits: Sequence[Tunable]) -> None:
        self._robot = robot
        self._engine = engine
        edited = partial(_edited, robot.world, sorted(enumerate(edits), key=lambda placed: placed[1].order))
        self._world = lru_cache(maxsize=WORLDS_KEPT)(edited)  # it does not refer to this object, and ends with it

    def __call__(self, genomes: Genomes, parameters: Parameters) -> Fitnesses:
        """Return the `(n, m)` fitnesses of genomes `(n, g)` in simulators `(m, p)`; nan where the physics failed.

        An infinite fitness counts as failed physics.
        """
        worlds = [self._world(tuple(row)) for row in parameters.tolist()]
        motions = [self._motion(genome) for genome in genomes]
        return self._fitnesses(self._rollouts(genomes, worlds, motions), len(genomes), worlds)

    def sense(self, genomes: Genomes, parameters: Parameters) -> Outcomes:
        """Return fitness and readings `(n, m, 1 + q)`: the fitness of a call, then each reading over its noise.

        A robot without sensors has no readings.
        """
        sensors = self._robot.sensors
        worlds = [self._world(tuple(row)) for row in parameters.tolist()]
        motions = [self._motion(genome) for genome in genomes]
        times = _all_times(*(frozen(each).tobytes() for each in (motions[0].observe_s, sensors.times_s)))
        longer = [motion.observed_at(times.all_s) for motion in motions]
        seen = self._rollouts(genomes, worlds, longer)
        fitnesses = self._fitnesses(_at(seen, times.observed), len(genomes), worlds)
        if not sensors.size:
            return fitnesses[..., None]
        values = self._robot.sense(replace(_at(seen, times.sensed), worlds=worlds))
        expected = (len(genomes), len(parameters), len(sensors.times_s), len(sensors.names))
        if np.shape(values) != expected:
            found = f"robot {self._robot.label!r} returned readings of shape {np.shape(values)}"
            raise PluginBroken(f"{found}; permitted: {expected}")
        if any(world.biases for world in worlds):
            values = values + np.array([biases(world, sensors.names) for world in worlds])[:, None]
        outcomes = np.empty((len(genomes), len(parameters), 1 + sensors.size))
        outcomes[..., 0], outcomes[..., 1:] = fitnesses, sensors.standardised(values)
        for row, motion in zip(outcomes, motions, strict=True):
            if isinstance(motion, Motion) and motion.until_s < sensors.times_s[-1]:
                row[:, 1:][:, sensors.reading_times_s > motion.until_s] = 0.0
        failed = np.isnan(fitnesses)
        if np.count_nonzero(failed):
            outcomes[failed] = np.nan
        return outcomes

    def _fitnesses(self, seen: Trajectory, genomes: int, worlds: Sequence[World]) -> Fitnesses:
        fitnesses = np.asarray(self._robot.fitness(replace(seen, worlds=worlds)), dtype=np.float64)
        if np.shape(fitnesses) != (genomes, len(worlds)):
            expected = f"the fitness of {genomes} genomes in {len(worlds)} simulators"
            raise PluginBroken(f"robot {self._robot.label!r} returned {np.shape(fitnesses)} numbers for {expected}")
        return np.where(np.isfinite(fitnesses), fitnesses, np.nan)

    def record(self, genome: Genome, parameters: FloatArray, times_s: FloatArray) -> tuple[World, Recording]:
        """Return the world of a simulator `(p,)`, and the rollout of a genome in it, recorded at times `(k,)` too."""
        world = self.world(parameters)
        motion = self._motion(genome)
        (sent,) = _disturbed(world, [motion], genome[None])
        found = self._engine.record(world, sent, times_s)
        return world, replace(found, trajectory=self._with_commands(found.trajectory, [motion], 0))

    def _motion(self, genome: Genome) -> Motion | Loop:
        motion = self._robot.motion(genome)
        return motion.observed_at(motion.observe_s, joints=True) if self._robot.joints else motion

    def _with_commands(self, seen: Trajectory, motions: Sequence[Motion | Loop], place: Any) -> Trajectory:  # noqa: ANN401 - an index
        """Return trajectories with the commands of motions, at a place among these, if the robot needs joints."""
        if not self._robot.joints:
            return seen
        if seen.angles_rad is None:
            needs = f"which the {self._robot.label} needs"
            raise PluginBroken(f"the engine {self._engine.name!r} tells no angles of joints, {needs}")
        commands = [each for motion in motions if (each := commands_at(motion, seen.times_s)) is not None]
        return replace(seen, commands=np.array(commands)[place]) if commands else seen

    def world(self, parameters: FloatArray) -> World:
        """Return the world of a simulator `(p,)`."""
        return self._world(tuple(parameters.tolist()))

    def _rollouts(self, genomes: Genomes, worlds: Sequence[World], motions: Sequence[Motion | Loop]) -> Trajectory:
        """Return the trajectories `(n, m, ...)`, with commands if the robot needs joints."""
        return self._with_commands(self._simulated(genomes, worlds, motions), motions, np.s_[:, None])

    def _simulated(self, genomes: Genomes, worlds: Sequence[World], motions: Sequence[Motion | Loop]) -> Trajectory:
        """Return the trajectories without commands; the worlds whose motions are alike are simulated together."""
        groups: dict[Hashable, list[int]] = {}
        read = any(isinstance(each, Motion) and each.read for each in motions)
        for column, world in enumerate(worlds):
            groups.setdefault((world.noise, _late_steps(world), world.biases if read else ()), []).append(column)
        if len(groups) == 1:
            return self._engine.rollouts(worlds, _disturbed(worlds[0], motions, genomes))
        found: dict[int, Trajectory] = {}
        for alike in groups.values():
            chosen = [worlds[column] for column in alike]
            seen = self._engine.rollouts(chosen, _disturbed(chosen[0], motions, genomes))
            for place, column in enumerate(alike):
                found[column] = seen.mapped(itemgetter((slice(None), place)))
        return Trajectory.stacked([found[column] for column in range(len(worlds))], axis=1)


def _edited(world: World, edits: Sequence[tuple[int, Tunable]], values: tuple[float, ...]) -> World:
    for place, edit in edits:
        world = edit.edit(world, values[place])
    return world


def _disturbed(world: World, motions: Sequence[Motion | Loop], genomes: Genomes) -> Sequence[Motion | Loop]:
    """Return what an engine is to run of motions: with biases of the start, noise and an offset of time of a world."""
    if world.biases:
        motions = [truly_begun(world, motion) for motion in motions]
    if world.noise != QUIET:
        motions = [disturbed(world, motion, genome) for motion, genome in zip(motions, genomes, strict=True)]
    return [_late(world, motion) for motion in motions] if _late_steps(world) else motions


def _late_steps(world: World) -> int:
    return round(world.time_offset_s / world.time_step_s)


def _late(world: World, motion: Motion | Loop) -> Motion | Loop:
    """Return a motion whose commands begin as many time steps later as the world says; a loop has its own clock.

    Before the first, motors hold the robot at its start. Of commands that would come before time 0, the last one holds
    then.
    """
    if isinstance(motion, Loop):
        return motion
    times_s = motion.times_s + _late_steps(world) * world.time_step_s
    if times_s[0] > 0:
        targets = np.vstack([middles(started(world, motion)), motion.targets])
        return replace(motion, times_s=frozen([0.0, *times_s]), targets=frozen(targets))
    first = int(np.searchsorted(times_s, 0.0, side="right")) - 1
    return replace(motion, times_s=frozen([0.0, *times_s[first + 1 :]]), targets=motion.targets[first:])


class _Times(NamedTuple):
    """Times of a rollout, and the places among them of the motion's observations and of the sensors' readings."""

    all_s: FloatArray
    observed: Places
    sensed: Places


@lru_cache
def _all_times(observed: bytes, sensed: bytes) -> _Times:
    """Return all times of observation, from the bytes of ascending times in seconds."""
    observed_s, sensed_s = np.frombuffer(observed), np.frombuffer(sensed)
    all_s = np.union1d(observed_s, sensed_s)
    return _Times(frozen(all_s), _places(all_s, observed_s), _places(all_s, sensed_s))


def _places(all_s: FloatArray, times_s: FloatArray) -> Places:
    """Return the places of some of the times; a slice where they are equally far apart, which copies nothing."""
    places = np.searchsorted(all_s, times_s)
    steps = np.unique(np.diff(places))
    if len(steps) == 1 and steps[0] > 0:
        return slice(int(places[0]), int(places[-1]) + 1, int(steps[0]))
    return places


def _at(seen: Trajectory, places: Places) -> Trajectory:
    return seen.mapped(itemgetter((..., places, slice(None))), times_s=seen.times_s[places])


class SafetyForecast:
    """The safety forecast of an experiment with a physical robot, which has a body."""

    def __init__(self, spec: ResolvedSpec, robot: Robot, simulation: Simulation) -> None:
        self._limits, self._engine = spec.reality.limits, spec.engine.name
        self._robot, self._simulation = robot, simulation

    def __call__(self, genome: Genome, parameters: Parameters, progress: Callable[[], None] = lambda: None) -> Safety:
        """Return the forecast of simulators `(m, p)`, the best first, for a genome `(g,)`; the first 20 are run."""
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
