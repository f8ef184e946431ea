"""What the contracts of several kinds ask: a description, repeated answers, motions, and ratings of them.

Each function raises AssertionError with the reason.
"""

from collections.abc import Callable, Mapping
from typing import Any, TypeAlias, TypeVar

import numpy as np

from gaplab.services.core.arrays import FloatArray, Genome, Genomes, frozen
from gaplab.services.core.space import Space
from gaplab.services.world.controllers.base import Controller
from gaplab.services.world.motions import Loop, Motion, Trajectory
from gaplab.services.world.robots.base import Robot
from gaplab.services.world.sensing import names
from gaplab.services.world.tasks.base import Task
from gaplab.services.world.world import World

P = TypeVar("P")
Rates: TypeAlias = Robot | Task


def check_repeats(make: Callable[[], P], questions: Mapping[str, Callable[[P], FloatArray]], advice: str) -> None:
    """Check that a plug-in answers each question as a new one does, whatever it was asked before.

    One plug-in is asked all questions in turn, twice. Answers are compared to the last bit; nan equals nan.

    Args:
        make: returns a new plug-in.
        questions: functions of a plug-in that return its answer, an array of any shape, by the answer's name.
        advice: what an author can do about a difference.
    """
    answers = {name: ask(make()) for name, ask in questions.items()}
    used = make()
    for name, ask in [*questions.items(), *questions.items()]:
        same = np.array_equal(ask(used), answers[name], equal_nan=True)
        assert same, f"{name} differs when it is asked again: {advice}"


def is_described(plugin: type[Any]) -> None:
    """Has a docstring of its own, whose first line is a sentence; a task also has a unit."""
    unit: str = getattr(plugin, "unit", "")
    assert unit or not issubclass(plugin, Task), "it has no unit"
    assert (plugin.__doc__ or "").strip(), "it has no docstring of its own; say in a sentence what it does"
    summary = plugin.describe().summary
    assert summary.endswith("."), f"its summary in the catalogue is {summary!r}; end it with a full stop"


CALLS = 12
"""Calls of `act` whose numbers are compared."""


def check_targets(motion: Motion, actuators: int) -> None:
    """Check that a motion has finite targets for each actuator, at times that ascend from 0."""
    expected = (len(motion.times_s), actuators)
    assert np.shape(motion.targets) == expected, f"targets have the shape {np.shape(motion.targets)}, not {expected}"
    assert np.isfinite(motion.targets).all(), "targets are not finite"
    assert motion.times_s[0] == 0.0, f"times_s begin at {motion.times_s[0]}, not at 0"
    assert np.all(np.diff(motion.times_s) > 0), "times_s do not ascend"


def check_known(known: Genome, space: Space) -> None:
    """Check that a known genome is within the bounds of its space."""
    known = np.asarray(known)
    assert known.shape == (space.size,), f"its known genome has the shape {known.shape}, its space {space.size} genes"
    inside = bool(np.all((known >= space.lower) & (known <= space.upper)))
    assert inside, f"its known genome {known.tolist()} is outside its bounds"


def numbers(mover: Controller | Robot, world: World, genomes: Genomes) -> FloatArray:
    """Return the numbers of each genome, `(k, n, ...)`: targets; of a loop also memories, of a few calls."""
    loops = [mover.motion(genome) for genome in genomes]
    if not isinstance(loops[0], Loop):
        return np.array([[each.targets for each in loops if not isinstance(each, Loop)]])
    first = loops[0]
    count = len(names(world, first.senses))
    memories = np.array([each.memory for each in loops if isinstance(each, Loop)])
    found = []
    for tick in range(CALLS):
        observations = np.array([_seen(genome, tick, count) for genome in genomes])
        targets, memories = first.act(genomes, observations, memories, tick * first.period_s)
        expected = (len(genomes), len(world.actuators))
        assert np.shape(targets) == expected, f"act returned targets of shape {np.shape(targets)}, not {expected}"
        assert np.shape(memories) == (len(genomes), len(first.memory)), f"act returned {np.shape(memories)} as memories"
        found.append(np.hstack([targets, memories]))
    return np.array(found)


def _seen(genome: Genome, tick: int, count: int) -> FloatArray:
    """Return some observations `(count,)` that belong to a genome and a call."""
    return np.random.default_rng([tick, *np.frombuffer(genome.tobytes(), dtype=np.uint32)]).normal(size=count)


LATE_S = 1e-9
"""Rounding by which the last reading may be later than the end of a rollout."""


def observes_at_times_that_ascend(plugin: type[Rates]) -> None:
    """Observes at ascending times, in float64 arrays that end above 0; reads its sensors at such times until then."""
    rates, observe_s = _rating(plugin)
    _check_seconds("observe_s", observe_s)
    _check_seconds("sensors.times_s", rates.sensors.times_s)
    assert len(observe_s), "observe_s is empty"
    assert observe_s[-1] > 0, f"observe_s ends at {observe_s[-1]}; a rollout lasts longer than 0 s"
    read, end_s = rates.sensors.times_s, observe_s[-1]
    within = not len(read) or read[-1] <= end_s + LATE_S
    assert within, f"its sensors are read at {read.tolist()}, but a rollout ends at {end_s} s"


def _check_seconds(name: str, times_s: FloatArray) -> None:
    """Check that times are an array of float64 that ascends from 0 or later."""
    example = "an array of float64, in seconds, such as np.array([0.0, 2.0])"
    found = f"an array of {times_s.dtype}" if isinstance(times_s, np.ndarray) else f"a {type(times_s).__name__}"
    assert found == "an array of float64", f"{name} is {found}; it must be {example}"
    assert times_s.ndim == 1, f"{name} has the shape {times_s.shape}; it must be {example}"
    assert np.isfinite(times_s).all(), f"{name} is not finite: {times_s.tolist()}"
    assert not len(times_s) or times_s[0] >= 0, f"{name} begins at {times_s[0]} s, before the rollout"
    assert np.all(np.diff(times_s) > 0), f"{name} does not ascend: {times_s.tolist()}"


def rates_many_trajectories_as_each(plugin: type[Rates]) -> None:
    """Returns for many trajectories at once the fitness of each."""
    rates, observe_s = _rating(plugin)
    many = trajectories(observe_s)
    together = np.asarray(rates.fitness(many))
    one_by_one = [[float(rates.fitness(_one(many, row, column))) for column in range(5)] for row in range(4)]
    assert together.shape == (4, 5), f"its fitness of (4, 5) trajectories has the shape {together.shape}"
    assert np.allclose(together, one_by_one), "its fitness of many trajectories differs from that of each"


def has_no_fitness_of_failed_physics(plugin: type[Rates]) -> None:
    """Returns nan for a trajectory of nan."""
    rates, observe_s = _rating(plugin)
    count = len(observe_s)
    nothing = Trajectory(frozen(observe_s), frozen(np.full((count, 3), np.nan)), frozen(np.full((count, 4), np.nan)))
    fitness = float(rates.fitness(nothing))
    assert np.isnan(fitness), f"its fitness of a trajectory of nan is {fitness}"


def reads_its_sensors(plugin: type[Rates]) -> None:
    """Reads each sensor at each of its times, and many trajectories as each."""
    rates, _ = _rating(plugin)
    sensors = rates.sensors
    if not sensors.size:
        return
    can = plugin.sense not in {Task.sense, Robot.sense} or hasattr(rates, "_task")
    assert can, "it has sensors, but no `sense` that reads them"
    noises = np.asarray(sensors.noises)
    assert len(sensors.units) == len(noises) == len(sensors.names), "its sensors lack units or noises"
    assert np.all(noises > 0), f"noises must be above 0, and are {noises.tolist()}"
    periods = np.asarray(sensors.periods)
    assert len(periods) in {0, len(noises)}, "its sensors lack periods"
    assert np.all(periods >= 0), f"periods must be 0 or above, and are {periods.tolist()}"
    many = trajectories(sensors.times_s)
    values = np.asarray(rates.sense(many))
    expected = (4, 5, len(sensors.times_s), len(sensors.names))
    assert values.shape == expected, f"its readings have the shape {values.shape}, not {expected}"
    assert np.allclose(values[2, 3], rates.sense(_one(many, 2, 3))), "its readings of many differ from those of each"


RATING = (
    observes_at_times_that_ascend,
    rates_many_trajectories_as_each,
    has_no_fitness_of_failed_physics,
    reads_its_sensors,
)
"""The checks of robots and tasks, which rate trajectories."""


def _rating(plugin: type[Rates]) -> tuple[Rates, FloatArray]:
    """Return a new robot or task, and the times at which it is observed."""
    if issubclass(plugin, Robot):
        robot = plugin.example()
        return robot, robot.motion(frozen(robot.known)).observe_s
    task = plugin()
    return task, task.observe_s


def trajectories(times_s: FloatArray) -> Trajectory:
    """Return `(4, 5)` trajectories at times `(t,)`, read-only."""
    rng = np.random.default_rng(0)
    positions_m = rng.normal(size=(4, 5, len(times_s), 3))
    turns = rng.normal(size=(4, 5, len(times_s), 4))
    orientations = turns / np.linalg.norm(turns, axis=-1, keepdims=True)
    return Trajectory(frozen(times_s), frozen(positions_m), frozen(orientations))


def _one(many: Trajectory, row: int, column: int) -> Trajectory:
    return Trajectory(many.times_s, many.positions_m[row, column], many.orientations[row, column])
