"""What a process of physics computes for a replay: one controller in both worlds, as JSON."""

from dataclasses import dataclass

import numpy as np

from gaplab.schemas.replays import ControllerKind, Interval, Replay, ReplayWorld
from gaplab.schemas.spec import ExperimentSpec
from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.kinematics import TOUCHING_M, body_poses, clearances_m
from gaplab.services.core.robots import robots
from gaplab.services.core.robots.base import Robot
from gaplab.services.core.world import Recording, World
from gaplab.services.replay.shapes import feet_of, labels, shapes_of
from gaplab.services.specs.assembly import Simulation, edits_of, engine_of, reality_of

FRAMES_PER_S = 50
LONGEST_S = 20.0
"""That is shown; a motion may be ten minutes long."""

AROUND_FRAMES = 5
"""A speed is taken from so many frames before to so many after."""


@dataclass(frozen=True)
class Film:
    """What is to be filmed; plain, for it goes to another process.

    Attributes:
        experiment: of which all of it is.
        repetition: the controller's.
        iteration: the controller's.
        kind: the controller's.
        spec: resolved, as JSON.
        genome: the controller's.
        simulator: the iteration of the simulator; None if the controller evolved in reality itself.
        parameters: the simulator's.
        simulated: the stored fitness in the simulator, if there is one.
        real: the stored fitness in reality.
        known: whether reality's parameters are in the spec.
    """

    experiment: str
    repetition: int
    iteration: int
    kind: ControllerKind
    spec: str
    genome: tuple[float, ...]
    simulator: int | None
    parameters: tuple[float, ...] | None
    simulated: float | None
    real: float | None
    known: bool


def film(asked: Film) -> bytes:
    """The Replay as JSON.

    Raises:
        EngineUnavailable: an engine is not installed here.
    """
    spec = ExperimentSpec.model_validate_json(asked.spec)
    robot = robots.create(spec.robot)
    genome = np.array(asked.genome)
    observed = robot.motion(genome).observe_s
    times = np.arange(int(min(LONGEST_S, observed[-1]) * FRAMES_PER_S + 1e-6) + 1) / FRAMES_PER_S
    simulation = reality = None
    if asked.parameters is not None:
        simulate = Simulation(robot, engine_of(spec.engine), edits_of(ref.name for ref in spec.tunables))
        world, seen = simulate.record(genome, np.array(asked.parameters), times)
        simulation = _shown(robot, spec.engine.name if spec.engine else "", world, seen, asked.simulated)
    if asked.known:
        truth, real = reality_of(spec, robot)
        world, seen = real.record(genome, truth, times)
        reality = _shown(robot, spec.reality.engine.name if spec.reality.engine else "", world, seen, asked.real)
    return (
        Replay(
            experiment=asked.experiment,
            repetition=asked.repetition,
            iteration=asked.iteration,
            kind=asked.kind,
            simulator=asked.simulator,
            robot=robot.name,
            unit=robot.unit,
            bodies=tuple(body.name for body in robot.world.bodies),
            feet=labels(robot.world),
            times_s=tuple(times.tolist()),
            counted_s=(float(observed[0]), float(observed[-1])),
            simulation=simulation,
            reality=reality,
        )
        .model_dump_json()
        .encode()
    )


def _shown(robot: Robot, engine: str, world: World, seen: Recording, recorded: float | None) -> ReplayWorld:
    fitness = float(robot.fitness(seen.trajectory))
    if not np.isfinite(fitness) or not np.all(np.isfinite(seen.poses)):
        return ReplayWorld(engine=engine, fitness=None, recorded=recorded, shapes=shapes_of(world))
    told = seen.angles_rad is not None
    bare = world if told else _base_alone(world)
    angles = seen.angles_rad if told else np.zeros((len(seen.times_s), 0))
    positions, orientations = body_poses(bare, seen.poses, np.asarray(angles))
    return ReplayWorld(
        engine=engine,
        fitness=fitness,
        recorded=recorded,
        shapes=shapes_of(bare),
        positions_m=_rows(positions, 3),
        orientations=_rows(orientations, 4),
        heights_m=tuple(_rounded(seen.poses[:, 2], 3).tolist()),
        speeds_m_s=tuple(_rounded(_speeds(seen), 3).tolist()),
        contacts=tuple(_contacts(bare, foot, positions, orientations, seen.times_s) for foot in feet_of(bare)),
    )


def _base_alone(world: World) -> World:
    return World(bodies=world.bodies[:1], material=world.material, start_height_m=world.start_height_m)


def _speeds(seen: Recording) -> FloatArray:
    """`(k,)`: over ground, towards where the last observation saw the base from where the first did."""
    travelled = seen.trajectory.positions_m[-1, :2] - seen.trajectory.positions_m[0, :2]
    way = seen.poses[:, :2] @ (travelled / max(float(np.linalg.norm(travelled)), 1e-12))
    frames = np.arange(len(way))
    before, after = np.maximum(frames - AROUND_FRAMES, 0), np.minimum(frames + AROUND_FRAMES, len(way) - 1)
    return np.asarray((way[after] - way[before]) / np.maximum(seen.times_s[after] - seen.times_s[before], 1e-12))


def _contacts(
    world: World, foot: int, positions: FloatArray, orientations: FloatArray, times_s: FloatArray
) -> tuple[Interval, ...]:
    """From when to when the foot is on the ground; a frame stands for the time until the next."""
    down = clearances_m(world.bodies[foot], positions[:, foot], orientations[:, foot]) < TOUCHING_M
    edges = np.flatnonzero(np.diff(np.concatenate([[0], down.astype(int), [0]])))
    ends = np.append(times_s, times_s[-1])[edges].tolist()
    return tuple(zip(ends[0::2], ends[1::2], strict=True))


def _rows(values: FloatArray, size: int) -> tuple[tuple[float, ...], ...]:
    """By frame, the numbers of all bodies in turn: to the millimetre, and quaternions to 1e-4."""
    flat = _rounded(values.reshape(len(values), -1), 3 if size == 3 else 4)
    return tuple(map(tuple, flat.tolist()))


def _rounded(values: FloatArray, digits: int) -> FloatArray:
    return np.round(values, digits) + 0.0  # no negative zeros
