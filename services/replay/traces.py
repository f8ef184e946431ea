"""Evaluation of traces: the task computes fitness and readings of a physical robot from its recorded motion."""

from collections.abc import Mapping, Sequence
from math import isfinite

import numpy as np

from gaplab.schemas.measurements import MeasurementSpec
from gaplab.schemas.records import MeasurementKind
from gaplab.schemas.traces import AlignedTrace, TracesRead, TracesSpec
from gaplab.services.core.arrays import FloatArray, frozen, known
from gaplab.services.core.errors import Conflict, InvalidSpec, Violation
from gaplab.services.replay.process import RolloutProcess, SentSpec, received, sent
from gaplab.services.replay.rollout import frame_times
from gaplab.services.specs.assembly import simulation_of
from gaplab.services.specs.robots import robot_of
from gaplab.services.specs.simulation import Simulation
from gaplab.services.specs.stored_specs import spec_of
from gaplab.services.store.models import ExperimentRow
from gaplab.services.store.queries import attachments, replays, requests
from gaplab.services.store.session import Session, Store
from gaplab.services.world.kinematics import observes_base
from gaplab.services.world.motions import Trajectory
from gaplab.services.world.robots.base import Robot
from gaplab.services.world.traces import Alignment, TooShort, Trace, align, placed, read_trace, unlikely
from gaplab.services.world.world import World

LONGEST_PLOT_S = 20.0
"""Longest part of a motion whose alignment is shown."""


def evaluate_traces(
    store: Store, process: RolloutProcess, request: str, spec: TracesSpec, *, answer: bool = False
) -> TracesRead:
    """Return fitness and readings by traces of a request's motion, one for each repeat; nothing is stored.

    Raises:
        NotFound: the request does not exist.
        Conflict: the request belongs to a closed branch.
        InvalidSpec: a trace is not stored, is not a trace, or does not contain the motion; all errors are named.
        EngineUnavailable: the library of the engine is not installed.
        EngineInterrupted: the physics ended its process.
        LimitReached: earlier requests took too long.
    """
    with store.reading() as session:
        row, repetition = requests.get(session, request)
        experiment = session.get_one(ExperimentRow, repetition.experiment_id)
        resolved = spec_of(experiment.spec)
        refuse_other_bodies(robot_of(resolved).world)
        _check(session, spec, resolved.reality.repeats, answer=answer)
        tuned = row.iteration - (row.kind is MeasurementKind.SAMPLE)
        simulators = replays.tuned_parameters(session, experiment.id, repetition.number, tuned)
        genome = tuple(row.genome)
    if not simulators:
        raise Conflict(f"request {request} is no longer needed: a correction closed its branch")
    sent_spec = sent(resolved)
    asked = sent_spec, genome, tuple(simulators[0]), spec
    found = process.call(said_by_files, *asked, load=lambda: _contents(store, spec.traces), plugins=sent_spec.plugins)
    if not isinstance(found, TracesRead):
        raise InvalidSpec(found)
    return found


def said_by_files(
    sent_spec: SentSpec,
    genes: Sequence[float],
    parameters: Sequence[float],
    spec: TracesSpec,
    files: Mapping[str, bytes],
) -> TracesRead | tuple[Violation, ...]:
    """Return fitness and readings by traces of a genome, beside the motion in a simulator of a spec; or their errors.

    `files` are contents by hash; each is read once, however often the spec names it.
    """
    robot = robot_of(received(sent_spec))
    try:
        read = {
            digest: read_trace(files[digest].decode("utf-8", "replace"), f"/traces/{spec.traces.index(digest)}")
            for digest in dict.fromkeys(spec.traces)
        }
        times_s, poses, _ = expected_motion(sent_spec, genes, parameters)
        expected = Trace(times_s, poses[:, :3], poses[:, 3:])
        return evaluated(robot, frozen(genes), [read[digest] for digest in spec.traces], expected, spec)
    except InvalidSpec as error:
        return error.violations


def measured_by_traces(store: Store, process: RolloutProcess, request: str, spec: MeasurementSpec) -> TracesRead | None:
    """Return fitness and readings by the traces of an answer; None if it has none. Errors: as `evaluate_traces`."""
    if spec.traces is None:
        return None
    return evaluate_traces(store, process, request, TracesSpec(traces=spec.traces, lags_s=spec.lags_s), answer=True)


def expected_motion(
    sent_spec: SentSpec, genes: Sequence[float], parameters: Sequence[float]
) -> tuple[FloatArray, FloatArray, float]:
    """Return times, poses and fitness as `expected_in` does, in a simulator of a spec."""
    spec = received(sent_spec)
    robot = robot_of(spec)
    simulation = simulation_of(spec, robot)
    return expected_in(simulation, robot, np.array(genes), np.array(parameters))


def expected_in(
    simulation: Simulation, robot: Robot, genome: FloatArray, parameters: FloatArray
) -> tuple[FloatArray, FloatArray, float]:
    """Return times `(k,)`, poses `(k, 7)` and fitness of a genome in a simulator; nan if the physics failed."""
    end_s = float(robot.motion(genome).observe_s[-1])
    times = np.unique(np.append(frame_times(end_s), end_s))
    _, recording = simulation.record(genome, parameters, times)
    return times, recording.poses, float(robot.fitness(recording.trajectory))


def refuse_other_bodies(world: World) -> None:
    """Refuse traces, which are of a base, for a robot whose task rates another body, or whose base cannot move.

    Raises:
        InvalidSpec: the motion that counts is not that of a base that moves.
    """
    if world.fixed or not observes_base(world):
        body = world.observed or world.bodies[0].name
        message = f"a trace is of a base that moves, but the motion that counts here is that of {body!r}; give values"
        raise InvalidSpec([Violation("/traces", None, message)])


def _check(session: Session, spec: TracesSpec, repeats: int, *, answer: bool) -> None:
    """Refuse traces that are not stored, another number of them than of repeats, and another number of lags.

    Raises:
        InvalidSpec: with every violation.
    """
    violations = attachments.missing(session, spec.traces, "/traces")
    if len(spec.traces) > repeats or (answer and len(spec.traces) < repeats):
        message = f"an answer has one trace for each repeat: {repeats}, not {len(spec.traces)}"
        violations.append(Violation("/traces", f"traces: {len(spec.traces)}", message, f"exactly {repeats}"))
    if spec.lags_s is not None and len(spec.lags_s) != len(spec.traces):
        message = f"there is one lag for each trace: {len(spec.traces)}, not {len(spec.lags_s)}"
        violations.append(Violation("/lags_s", f"lags: {len(spec.lags_s)}", message, f"exactly {len(spec.traces)}"))
    if violations:
        raise InvalidSpec(violations)


def _contents(store: Store, traces: Sequence[str]) -> dict[str, bytes]:
    """Return the contents of stored traces by hash."""
    with store.reading() as session:
        return {digest: attachments.content_of(session, digest) for digest in set(traces)}


def evaluated(
    robot: Robot, genome: FloatArray, traces: Sequence[Trace], expected: Trace, spec: TracesSpec
) -> TracesRead:
    """Return fitness and readings by traces of a genome `(g,)`, beside the expected motion.

    Raises:
        InvalidSpec: a trace does not contain the motion; all errors are named.
    """
    aligned, values, readings, violations, doubts = [], list[float](), [], list[Violation](), list[str]()
    lags = spec.lags_s or (None,) * len(traces)
    observe_s, sensors = robot.motion(genome).observe_s, robot.sensors
    for place, (digest, trace) in enumerate(zip(spec.traces, traces, strict=True)):
        try:
            found = align(trace, expected, lags[place])
        except TooShort as error:
            violations.append(Violation(f"/traces/{place}", digest, f"the trace does not contain the motion: {error}"))
            continue
        values.append(float(robot.fitness(placed(trace, found.lag_s, observe_s, robot.world))))
        if not isfinite(values[-1]):
            message = f"the {robot.label} computes no finite fitness from this trace"
            violations.append(Violation(f"/traces/{place}", digest, message))
        if sensors.size:
            seen = robot.sense(placed(trace, found.lag_s, sensors.times_s, robot.world))
            readings.append(tuple(tuple(map(known, row)) for row in seen.tolist()))
        aligned.append(_beside(digest, trace, expected, found, robot.world))
        doubts += [f"trace {place + 1}: {what}" for what in unlikely(trace, expected, found)]
    if violations:
        raise InvalidSpec(violations)
    return TracesRead(
        values=tuple(values),
        unit=robot.unit,
        readings=tuple(readings) if sensors.size else None,
        traces=tuple(aligned),
        doubts=tuple(doubts),
    )


def _beside(digest: str, trace: Trace, expected: Trace, alignment: Alignment, world: World) -> AlignedTrace:
    """Return a trace beside the expected motion."""
    times = expected.times_s[expected.times_s <= LONGEST_PLOT_S]
    known = bool(np.all(np.isfinite(expected.positions_m)))
    seen, wanted = placed(trace, alignment.lag_s, times, world), placed(expected, 0.0, times, world) if known else None
    return AlignedTrace(
        attachment=digest,
        lag_s=alignment.lag_s,
        match=alignment.match,
        after_rest=alignment.after_rest,
        times_s=tuple(times.tolist()),
        heights_m=_heights(seen),
        distances_m=_distances(seen),
        expected_heights_m=None if wanted is None else _heights(wanted),
        expected_distances_m=None if wanted is None else _distances(wanted),
    )


def _heights(seen: Trajectory) -> tuple[float, ...]:
    return tuple(np.round(seen.positions_m[:, 2], 4).tolist())


def _distances(seen: Trajectory) -> tuple[float, ...]:
    return tuple(np.round(np.linalg.norm(seen.positions_m[:, :2], axis=1), 4).tolist())
