"""The rollouts of a replay: one controller in its simulator and in reality."""

from dataclasses import dataclass, replace

import numpy as np

from gaplab.schemas.replays import ControllerKind, Framing, Interval, Replay, ReplayReadings, ReplayWorld
from gaplab.services.core.arrays import FloatArray, nearest
from gaplab.services.replay.process import SentSpec, received
from gaplab.services.replay.shapes import extent_of, feet_of, framing_of, labels, observed_of, shapes_of
from gaplab.services.specs.assembly import reality_of, simulation_of
from gaplab.services.specs.robots import robot_of
from gaplab.services.world.kinematics import TOUCHING_M, body_poses, clearances_m
from gaplab.services.world.motions import Recording
from gaplab.services.world.robots.base import Robot, Sensors
from gaplab.services.world.world import World

FRAMES_PER_S = 50
LONGEST_S = 20.0
"""Longest part of a motion that is shown; a motion may last ten minutes."""

AROUND_FRAMES = 5
"""A speed is the mean over this many frames before and after."""


LAST = -1
"""Stands for the last iteration whose controller was measured."""


@dataclass(frozen=True)
class ReplayChoice:
    """The choice of a controller and of a simulator.

    Attributes:
        iteration: the iteration that measured the controller; `LAST` for the last one that did.
        simulator: the iteration whose best simulator is used; None for the simulator that chose the controller: of the
            same iteration for a transferred controller, of the iteration before for a sample.
    """

    repetition: int = 0
    iteration: int = LAST
    kind: ControllerKind = ControllerKind.TRANSFER
    simulator: int | None = None


@dataclass(frozen=True)
class ReplayRequest:
    """Everything a subprocess needs to compute a replay, in plain values.

    Attributes:
        simulator: the iteration of the simulator; None if the controller evolved in reality itself.
        parameters: parameters of the simulator.
        simulated: the stored fitness in the simulator, if there is one.
        real: the stored fitness in reality.
        readings: the stored readings in reality, if there are any.
        known: whether reality can be shown: the spec has its parameters, and it is not hardware.
        revealed: whether its shapes and its slope are shown; those of the robot as it is, as long as reality is hidden.
    """

    experiment: str
    choice: ReplayChoice
    spec: SentSpec
    genome: tuple[float, ...]
    simulator: int | None
    parameters: tuple[float, ...] | None
    simulated: float | None
    real: float | None
    readings: tuple[float | None, ...] | None
    known: bool
    revealed: bool = True


def compute_replay(request: ReplayRequest) -> bytes:
    """Return the Replay as JSON, computed with the plug-ins as their files are now.

    Raises:
        EngineUnavailable: the library of an engine is not installed.
    """
    spec, choice = received(request.spec), request.choice
    robot = robot_of(spec)
    genome = np.array(request.genome)
    observed = robot.motion(genome).observe_s
    times = frame_times(min(LONGEST_S, observed[-1]))
    simulation = reality = readings = None
    if request.parameters is not None:
        simulate = simulation_of(spec, robot)
        world, recording = simulate.record(genome, np.array(request.parameters), times)
        simulation = _shown(robot, spec.engine.name, world, recording, request.simulated)
        readings = simulate.sense(genome[None, :], np.array([request.parameters]))[0, 0, 1:]
    if request.known and spec.reality.engine is not None:
        truth, real = reality_of(spec, robot)
        world, recording = real.record(genome, truth, times)
        drawn = world if request.revealed else robot.world
        reality = _shown(robot, spec.reality.engine.name, drawn, recording, request.real)
    computed = Replay(
        experiment=request.experiment,
        repetition=choice.repetition,
        iteration=choice.iteration,
        kind=choice.kind,
        simulator=request.simulator,
        robot=robot.label,
        unit=robot.unit,
        bodies=tuple(body.name for body in robot.world.bodies),
        feet=labels(robot.world),
        observed=observed_of(robot.world),
        framing=_framing(simulation, reality),
        times_s=tuple(times.tolist()),
        counted_s=(float(observed[0]), float(observed[-1])),
        simulation=simulation,
        reality=reality,
        readings=_sensed(robot.sensors, readings, request.readings),
    )
    return computed.model_dump_json().encode()


def _sensed(
    sensors: Sensors, simulated: FloatArray | None, real: tuple[float | None, ...] | None
) -> ReplayReadings | None:
    """Return the readings in both worlds, in the sensors' units; None if the robot has no sensors."""
    if not sensors.size:
        return None
    measured = None if real is None or len(real) != sensors.size else np.array(real, dtype=float)
    if measured is not None and simulated is not None:
        measured = nearest(measured, simulated, sensors.reading_periods)
    return ReplayReadings(
        sensors=sensors.names,
        units=sensors.units,
        noises=tuple(sensors.noises.tolist()),
        times_s=tuple(sensors.times_s.tolist()),
        simulation=None if simulated is None or np.isnan(simulated).all() else _values(sensors, simulated),
        reality=None if measured is None else _values(sensors, measured),
    )


def _values(sensors: Sensors, readings: FloatArray) -> tuple[tuple[float | None, ...], ...]:
    rows = _rounded(sensors.values(readings).T, 6).tolist()
    return tuple(tuple(None if np.isnan(value) else value for value in row) for row in rows)


def _shown(robot: Robot, engine: str, world: World, recording: Recording, recorded: float | None) -> ReplayWorld:
    fitness = float(robot.fitness(recording.trajectory))
    found = ReplayWorld(
        engine=engine, fitness=None, recorded=recorded, shapes=shapes_of(world), slope_rad=world.slope_rad
    )
    if not np.isfinite(fitness) or not np.all(np.isfinite(recording.poses)):
        return found
    bare, positions, orientations = poses_of(world, recording)
    followed = positions[:, observed_of(bare)]
    return found.model_copy(
        update={
            "fitness": fitness,
            "shapes": shapes_of(bare),
            "positions_m": _rows(positions, 3),
            "orientations": _rows(orientations, 4),
            "heights_m": tuple(_rounded(followed[:, 2], 3).tolist()),
            "speeds_m_s": tuple(_rounded(_speeds(recording, followed), 3).tolist()),
            "contacts": tuple(
                _contacts(bare, foot, positions, orientations, recording.times_s) for foot in feet_of(bare)
            ),
        }
    )


def frame_times(end_s: float) -> FloatArray:
    """Return the times `(k,)` of the frames of a motion."""
    return np.asarray(np.arange(int(end_s * FRAMES_PER_S + 1e-6) + 1) / FRAMES_PER_S)


def poses_of(world: World, recording: Recording) -> tuple[World, FloatArray, FloatArray]:
    """Return what is known of a world, and positions `(k, bodies, 3)` and orientations `(k, bodies, 4)` of its bodies.

    If the engine tells no angles of joints, that is the base alone.
    """
    angles = recording.angles_rad
    if angles is None:
        world = replace(world, bodies=world.bodies[:1], joints=(), observed="", origin=None, edits=frozenset())
        angles = np.zeros((len(recording.times_s), 0))
    return world, *body_poses(world, recording.poses, angles)


def _framing(*worlds: ReplayWorld | None) -> Framing:
    for world in worlds:
        if world is not None and world.positions_m:
            positions = np.array(world.positions_m[0]).reshape(-1, 3)
            return framing_of(*extent_of(world.shapes, positions, np.array(world.orientations[0]).reshape(-1, 4)))
    return Framing()


def _speeds(recording: Recording, positions: FloatArray) -> FloatArray:
    """Return the speed of positions `(frames, 3)` over ground, `(frames,)` in m/s, towards the end of the motion."""
    travelled = recording.trajectory.positions_m[-1, :2] - recording.trajectory.positions_m[0, :2]
    way = positions[:, :2] @ (travelled / max(float(np.linalg.norm(travelled)), 1e-12))
    frames = np.arange(len(way))
    before, after = np.maximum(frames - AROUND_FRAMES, 0), np.minimum(frames + AROUND_FRAMES, len(way) - 1)
    return np.asarray(
        (way[after] - way[before]) / np.maximum(recording.times_s[after] - recording.times_s[before], 1e-12)
    )


def _contacts(
    world: World, foot: int, positions: FloatArray, orientations: FloatArray, times_s: FloatArray
) -> tuple[Interval, ...]:
    """Return the intervals in which the foot is on the ground; a frame holds until the next."""
    down = clearances_m(world.bodies[foot], positions[:, foot], orientations[:, foot]) < TOUCHING_M
    edges = np.flatnonzero(np.diff(np.concatenate([[0], down.astype(int), [0]])))
    ends = np.append(times_s, times_s[-1])[edges].tolist()
    return tuple(zip(ends[0::2], ends[1::2], strict=True))


def _rows(values: FloatArray, size: int) -> tuple[tuple[float, ...], ...]:
    """Flatten `(frames, bodies, size)`: positions are rounded to the millimetre, quaternions to 1e-4."""
    flat = _rounded(values.reshape(len(values), -1), 3 if size == 3 else 4)
    return tuple(map(tuple, flat.tolist()))


def _rounded(values: FloatArray, digits: int) -> FloatArray:
    return np.round(values, digits) + 0.0  # no negative zeros
