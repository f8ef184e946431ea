"""Evaluation of traces: the task computes fitness and readings of a physical robot from its recorded motion."""

from collections.abc import Mapping, Sequence
from math import isfinite

import numpy as np

from gaplab.schemas.measurements import MeasurementSpec
from gaplab.schemas.records import MeasurementKind
from gaplab.schemas.traces import TraceRead, TracesRead, TracesSpec
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
from gaplab.services.world.logs import Trace, read_trace
from gaplab.services.world.motions import commands_at
from gaplab.services.world.robots.base import Robot
from gaplab.services.world.traces import TooShort, align, placed, unlikely


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
    robot, read, wrong = robot_of(received(sent_spec)), dict[str, Trace](), list[Violation]()
    for digest in dict.fromkeys(spec.traces):
        text, pointer = files[digest].decode("utf-8", "replace"), f"/traces/{spec.traces.index(digest)}"
        try:
            read[digest] = read_trace(text, pointer, robot.world)
        except InvalidSpec as error:
            wrong += error.violations
    if wrong:
        return tuple(wrong)
    try:
        expected, _ = expected_motion(sent_spec, genes, parameters)
        return evaluated(robot, frozen(genes), [read[digest] for digest in spec.traces], expected, spec)
    except InvalidSpec as error:
        return error.violations


def measured_by_traces(store: Store, process: RolloutProcess, request: str, spec: MeasurementSpec) -> TracesRead | None:
    """Return fitness and readings by the traces of an answer; None if it has none. Errors: as `evaluate_traces`."""
    if spec.traces is None:
        return None
    return evaluate_traces(store, process, request, TracesSpec(traces=spec.traces, lags_s=spec.lags_s), answer=True)


def expected_motion(sent_spec: SentSpec, genes: Sequence[float], parameters: Sequence[float]) -> tuple[Trace, float]:
    """Return motion and fitness as `expected_in` does, in a simulator of a spec."""
    spec = received(sent_spec)
    robot = robot_of(spec)
    simulation = simulation_of(spec, robot)
    return expected_in(simulation, robot, np.array(genes), np.array(parameters))


def expected_in(
    simulation: Simulation, robot: Robot, genome: FloatArray, parameters: FloatArray
) -> tuple[Trace, float]:
    """Return the motion and the fitness of a genome in a simulator; nan if the physics failed."""
    end_s = float(robot.motion(genome).observe_s[-1])
    times = np.unique(np.append(frame_times(end_s), end_s))
    _, recording = simulation.record(genome, parameters, times)
    motion = Trace(times, recording.poses[:, :3], recording.poses[:, 3:], recording.angles_rad)
    return motion, float(robot.fitness(recording.trajectory))


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
    motion, sensors, world = robot.motion(genome), robot.sensors, robot.world
    for place, (digest, trace) in enumerate(zip(spec.traces, traces, strict=True)):
        try:
            found = align(trace, expected, lags[place], motion)
        except TooShort as error:
            violations.append(Violation(f"/traces/{place}", digest, f"the trace does not contain the motion: {error}"))
            continue
        values.append(float(robot.fitness(placed(trace, found.lag_s, motion.observe_s, world, motion))))
        if not isfinite(values[-1]):
            message = f"the {robot.label} computes no finite fitness from this trace{_lacks(trace, robot)}"
            violations.append(Violation(f"/traces/{place}", digest, message))
        if sensors.size:
            seen = robot.sense(placed(trace, found.lag_s, sensors.times_s, world, motion))
            readings.append(tuple(tuple(map(known, row)) for row in seen.tolist()))
        aligned.append(TraceRead.filled_from(found, attachment=digest))
        sent = commands_at(motion, np.clip(trace.times_s - found.lag_s, 0.0, None))
        doubts += [f"trace {place + 1}: {what}" for what in unlikely(trace, expected, found, world, sent)]
    if violations:
        raise InvalidSpec(violations)
    return TracesRead(
        values=tuple(values),
        unit=robot.unit,
        readings=tuple(readings) if sensors.size else None,
        traces=tuple(aligned),
        doubts=tuple(doubts),
    )


def _lacks(trace: Trace, robot: Robot) -> str:
    """Return what a robot's code may miss in a trace; "" if it has everything."""
    lacking = ["the pose of the base"] if trace.positions_m is None and not robot.world.fixed else []
    needs_joints = robot.joints or robot.world.fixed or not observes_base(robot.world)
    lacking += ["the angles of its joints"] if needs_joints and trace.angles_rad is None else []
    return f", which lacks {' and '.join(lacking)}" if lacking else ""
