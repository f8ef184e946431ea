"""The contracts of what moves and of what rates it: controllers, tasks and robots.

A controller drives a walking robot, and an arm of other motors.
"""

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from operator import itemgetter
from typing import TypeAlias

import numpy as np

from gaplab.services.contract.promises import check_repeats
from gaplab.services.core.arrays import NO_READINGS, FloatArray, Genome, Genomes, frozen
from gaplab.services.engines import engines
from gaplab.services.world.controllers.base import Controller
from gaplab.services.world.motions import Loop, Motion, Trajectory
from gaplab.services.world.robots.base import Robot
from gaplab.services.world.robots.quadruped import Quadruped
from gaplab.services.world.sensing import GROUPS, names
from gaplab.services.world.tasks.base import Task
from gaplab.services.world.world import Body, Box, Joint, PDMotor, World

Mover: TypeAlias = Controller | Robot
Rates: TypeAlias = Robot | Task

OBSERVE_S = frozen([0.4, 1.0])
TOGETHER = (1, 2, 7, 64)
"""Numbers of loops that act together."""


def arm() -> World:
    """Return an arm on a fixed base, whose three motors follow a position, a speed and a torque."""
    motors = (
        PDMotor("position", max_torque_nm=10.0, kp=50.0, kd=2.0),
        PDMotor("velocity", max_torque_nm=10.0, kd=2.0),
        PDMotor("torque", max_torque_nm=10.0),
    )
    bodies = [Body("base", 1.0, Box((0.1, 0.1, 0.1)))]
    joints = []
    for number, motor in enumerate(motors):
        bodies.append(Body(f"link_{number}", 0.5, Box((0.05, 0.05, 0.2)), (0.0, 0.0, 0.1), collides=False))
        parent, child = bodies[-2].name, bodies[-1].name
        joints.append(
            Joint(f"joint_{number}", parent, child, (0.0, 0.0, 0.2), (0.0, 1.0, 0.0), motor, start=0.3, swing=0.4)
        )
    return World(bodies=tuple(bodies), joints=tuple(joints), start_height_m=0.5, fixed=True)


def movers(plugin: type[Mover]) -> Iterator[tuple[Mover, World, FloatArray]]:
    """Yield a new robot, or a new controller of each robot, with the robot and the times at which it is observed."""
    if issubclass(plugin, Robot):
        robot = plugin.example()
        yield robot, robot.world, robot.motion(frozen(robot.known)).observe_s
        return
    for world in (Quadruped().world, arm()):
        controller = plugin()
        controller.prepare(world, OBSERVE_S)
        yield controller, world, OBSERVE_S


def names_an_engine_that_runs_it(plugin: type[Robot]) -> None:
    """Names an engine that can run it."""
    robot = plugin.example()
    assert robot.engine in engines, f"its engine {robot.engine!r} is none of {', '.join(engines)}"
    assert engines[robot.engine].runs(robot.world), f"its engine {robot.engine!r} cannot run its world"


def has_its_known_genome_in_its_space(plugin: type[Mover]) -> None:
    """Has a known genome within the bounds of its space."""
    for mover, _, _ in movers(plugin):
        known, space = np.asarray(mover.known), mover.space
        assert known.shape == (space.size,), (
            f"its known genome has the shape {known.shape}, its space {space.size} genes"
        )
        inside = bool(np.all((known >= space.lower) & (known <= space.upper)))
        assert inside, f"its known genome {known.tolist()} is outside its bounds"


def drives_every_actuator(plugin: type[Mover]) -> None:
    """Describes motions with finite targets for every actuator, all observed at the same times."""
    for mover, world, observe_s in movers(plugin):
        for genome in _genomes(mover):
            motion = mover.motion(genome)
            assert np.array_equal(motion.observe_s, observe_s), "observe_s differs between genomes"
            if isinstance(motion, Loop):
                assert np.isfinite(numbers(mover, world, genome[None])).all(), "targets or memories are not finite"
            else:
                _check_targets(motion, len(world.actuators) or 1)


def repeats_itself(plugin: type[Mover]) -> None:
    """Describes the same motion by the same genome, whatever it was asked before."""
    for place, (mover, world, _) in enumerate(movers(plugin)):
        *_, one, other = _genomes(mover)
        questions = {
            "the motion of a genome": partial(_moved, world=world, genome=one),
            "the motion of another genome": partial(_moved, world=world, genome=other),
        }
        advice = "use no random numbers, and keep nothing from one genome for the next"
        check_repeats(partial(_new, plugin, place), questions, advice)


def declares_whether_it_loops(plugin: type[Controller]) -> None:
    """Declares in `loops` whether its motions are Loops, whose groups of observations exist, in their order."""
    for controller, _, _ in movers(plugin):
        motion = controller.motion(controller.known)
        assert isinstance(motion, Loop) == plugin.loops, (
            f"loops is {plugin.loops}, and it returns {type(motion).__name__}"
        )
        if isinstance(motion, Loop):
            ordered = tuple(name for name in GROUPS if name in motion.senses)
            assert motion.senses == ordered, f"senses are {motion.senses}; permitted: names of {GROUPS}, in this order"


def acts_on_each_row_alone(plugin: type[Controller]) -> None:
    """Acts on each loop as if it were alone, to the last bit, whatever loops act at the same time."""
    if not plugin.loops:
        return
    for controller, world, _ in movers(plugin):
        genomes = frozen(controller.space.draw(max(TOGETHER), np.random.default_rng(2)))
        whole = numbers(controller, world, genomes)
        assert np.isfinite(whole).all(), "targets or memories are not finite"
        for count in TOGETHER:
            same = np.array_equal(numbers(controller, world, genomes[:count]), whole[:, :count])
            assert same, f"of {max(TOGETHER)} loops the first {count} differ from {count} alone"
        backwards = numbers(controller, world, genomes[::-1])
        assert np.array_equal(backwards[:, ::-1], whole), "loops differ with their order"


def _new(plugin: type[Mover], place: int) -> Mover:
    return list(movers(plugin))[place][0]


def _genomes(mover: Mover) -> Genomes:
    """Return the known genome, the corners that are the bounds, and drawn ones, `(23, g)`, read-only."""
    space = mover.space
    return frozen(np.vstack([mover.known, space.lower, space.upper, space.draw(20, np.random.default_rng(0))]))


def _moved(mover: Mover, world: World, genome: Genome) -> FloatArray:
    """Return all numbers of a motion as one vector: times of observation, then times and targets, or those of calls."""
    motion = mover.motion(genome)
    times_s = NO_READINGS if isinstance(motion, Loop) else motion.times_s
    found = numbers(mover, world, genome[None])
    return np.concatenate([np.ravel(each) for each in (motion.observe_s, times_s, found)])


def _check_targets(motion: Motion, actuators: int) -> None:
    """Check that a motion has finite targets for each actuator, at times that ascend from 0."""
    expected = (len(motion.times_s), actuators)
    assert np.shape(motion.targets) == expected, f"targets have the shape {np.shape(motion.targets)}, not {expected}"
    assert np.isfinite(motion.targets).all(), "targets are not finite"
    assert motion.times_s[0] == 0.0, f"times_s begin at {motion.times_s[0]}, not at 0"
    assert np.all(np.diff(motion.times_s) > 0), "times_s do not ascend"


CALLS = 12
"""Calls of `act` whose numbers are compared."""


def numbers(mover: Mover, world: World, genomes: Genomes) -> FloatArray:
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
    many = trajectories(observe_s, _world(rates))
    together = np.asarray(rates.fitness(many))
    one_by_one = [[float(rates.fitness(_one(many, row, column))) for column in range(5)] for row in range(4)]
    assert together.shape == (4, 5), f"its fitness of (4, 5) trajectories has the shape {together.shape}"
    assert np.allclose(together, one_by_one), "its fitness of many trajectories differs from that of each"


def has_no_fitness_of_failed_physics(plugin: type[Rates]) -> None:
    """Returns nan for a trajectory of nan."""
    rates, observe_s = _rating(plugin)
    nothing = trajectories(observe_s, _world(rates)).mapped(lambda each: np.full(each.shape[2:], np.nan))
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
    many = trajectories(sensors.times_s, _world(rates))
    values = np.asarray(rates.sense(many))
    expected = (4, 5, len(sensors.times_s), len(sensors.names))
    assert values.shape == expected, f"its readings have the shape {values.shape}, not {expected}"
    assert np.allclose(values[2, 3], rates.sense(_one(many, 2, 3))), "its readings of many differ from those of each"


def _rating(plugin: type[Rates]) -> tuple[Rates, FloatArray]:
    """Return a new robot or task, and the times at which it is observed."""
    if issubclass(plugin, Robot):
        robot = plugin.example()
        return robot, robot.motion(frozen(robot.known)).observe_s
    task = plugin()
    task.prepare(arm())
    return task, task.observe_s


def _world(rates: Rates) -> World:
    return rates.world if isinstance(rates, Robot) else arm()


def trajectories(times_s: FloatArray, world: World) -> Trajectory:
    """Return `(4, 5)` trajectories at times `(t,)` with the joints of a world, read-only."""
    rng = np.random.default_rng(0)
    positions_m = rng.normal(size=(4, 5, len(times_s), 3))
    turns = rng.normal(size=(4, 5, len(times_s), 4))
    orientations = turns / np.linalg.norm(turns, axis=-1, keepdims=True)
    found = Trajectory(frozen(times_s), frozen(positions_m), frozen(orientations))
    joints = [frozen(rng.normal(size=(4, 5, len(times_s), len(world.joints)))) for _ in range(3)]
    commands = frozen(rng.normal(size=(4, 5, len(times_s), len(world.actuators))))
    return replace(found, angles_rad=joints[0], speeds_rad_s=joints[1], torques_nm=joints[2], commands=commands)


def _one(many: Trajectory, row: int, column: int) -> Trajectory:
    return many.mapped(itemgetter((row, column)))
