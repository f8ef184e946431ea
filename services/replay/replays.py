"""What is computed when it is asked for: replays, robots at their start, and predictions.

A replay is the motion of a measured controller in its simulator and in reality; a prediction the fitness of a sample in
simulation, before and after tuning on it.
"""

from collections.abc import Sequence
from dataclasses import replace
from hashlib import sha256
from time import monotonic

import numpy as np

from gaplab.schemas.records import MeasurementKind
from gaplab.schemas.replays import ControllerKind, Prediction, Predictions, Replay, RobotShapes
from gaplab.schemas.resolved import ResolvedSpec
from gaplab.services.core.arrays import known
from gaplab.services.core.errors import Conflict, InvalidSpec, NotFound, Violation
from gaplab.services.experiments import stored_files
from gaplab.services.experiments.views import hidden
from gaplab.services.replay.process import AnswerCache, Key, RolloutProcess, SentSpec, received, sent
from gaplab.services.replay.rollout import LAST, ReplayChoice, ReplayRequest, compute_replay
from gaplab.services.replay.shapes import at_start
from gaplab.services.specs.assembly import refuse_missing, simulation_of
from gaplab.services.specs.resolution import is_computed, is_direct, takes_samples
from gaplab.services.specs.robots import robot_of, unit
from gaplab.services.specs.stored_specs import spec_of
from gaplab.services.store.models import ExperimentRow
from gaplab.services.store.queries import experiments, replays
from gaplab.services.store.queries.replays import TunedSample
from gaplab.services.store.session import Session, Store
from gaplab.services.world.robot_files import RobotFile
from gaplab.services.world.robot_library import label_of
from gaplab.services.world.robots import robots

_MEASURED_AS = {ControllerKind.SAMPLE: MeasurementKind.SAMPLE, ControllerKind.TRANSFER: MeasurementKind.PROBE}


def replay(store: Store, process: RolloutProcess, experiment_id: str, choice: ReplayChoice) -> Replay:
    """Return the motion of the controller in both worlds; raises as `replay_json` does."""
    return Replay.model_validate_json(replay_json(store, process, experiment_id, choice))


def replay_json(store: Store, process: RolloutProcess, experiment_id: str, choice: ReplayChoice) -> bytes:
    """Return a Replay as JSON.

    It shows the motion in reality of a controller that was measured there, and never the parameters of reality. A
    controller that the physical robot is to run next is shown in its simulator alone.

    Raises:
        NotFound: the experiment does not exist, or will never have this repetition or iteration.
        Conflict: the controller is not measured yet, or the simulator is not tuned yet.
        InvalidSpec: the robot has no body, or a plug-in of the experiment is no longer installed.
        EngineUnavailable: the library of an engine is not installed.
        EngineInterrupted: the physics ended its process.
        LimitReached: earlier requests took too long.
    """
    with store.reading() as session:
        row = experiments.get_experiment(session, experiment_id)
        spec = spec_of(row.spec)
        choice = _with_iteration(session, row, choice)
        _refuse_impossible(row, spec, choice)
        request = _request(session, row, spec, choice)
    key: Key = ("replay", sha256(repr(request).encode()).hexdigest())
    found: bytes | None = process.answers.get(key)
    if found is None:
        refuse_missing(spec, reality=request.known)
        found = process.call(compute_replay, request, plugins=request.spec.plugins)
        process.answers.keep(key, found, len(found))
    return found


def robot_shapes(store: Store, name: str) -> RobotShapes:
    """Return a robot, of the catalogue or from a file, by its name or the hash of its file, as it stands at the start.

    Raises:
        NotFound: no usable robot has this name or hash, or it has no body.
    """
    own = robots[name].example().world if name in robots else None
    world = own if own is not None else RobotFile.stored(stored_files.robot_text(store, name)).world
    if not world.bodies:
        raise NotFound(f"the robot {name!r} has no body, so it has no shapes")
    return at_start(world)


def _with_iteration(session: Session, row: ExperimentRow, choice: ReplayChoice) -> ReplayChoice:
    """Return the choice with its iteration; for the last, if none is measured yet, the first."""
    if choice.iteration != LAST:
        return choice
    last = replays.last_measured(session, row.id, choice.repetition, _MEASURED_AS[choice.kind])
    return replace(choice, iteration=_first(choice.kind) if last is None else last)


def _first(kind: ControllerKind) -> int:
    return 1 if kind is ControllerKind.SAMPLE else 0


def _refuse_impossible(row: ExperimentRow, spec: ResolvedSpec, choice: ReplayChoice) -> None:
    if not robot_of(spec).world.bodies:
        message = f"the robot {label_of(spec.robot)!r} has no body, so it has no motion to replay"
        raise InvalidSpec([Violation("id", row.id, message, "an experiment with a robot that has a body")])
    if row.recorded and choice.kind is not ControllerKind.SAMPLE:
        raise NotFound("its reality is recorded, so nothing was transferred; permitted: kind=sample")
    first = _first(choice.kind)
    _refuse_outside("repetition", choice.repetition, 0, row.spec["repetitions"])
    _refuse_outside(f"iteration with a {choice.kind}", choice.iteration, first, row.iterations)
    if choice.simulator is not None:
        _refuse_outside("tuned simulator of iteration", choice.simulator, 0, 0 if is_direct(spec) else row.iterations)


def _refuse_outside(what: str, number: int, first: int, end: int) -> None:
    if not first <= number < end:
        permitted = f"from {first} to {end - 1}" if end > first else "none"
        raise NotFound(f"the experiment has no {what} {number}; permitted: {permitted}")


def _request(session: Session, row: ExperimentRow, spec: ResolvedSpec, choice: ReplayChoice) -> ReplayRequest:
    which = row.id, choice.repetition, choice.iteration, _MEASURED_AS[choice.kind]
    found = replays.measured_controller(session, *which) or replays.requested_controller(session, *which)
    if found is None:
        raise Conflict(f"the {_name(choice)} has not been measured in reality yet; try again later")
    own = choice.iteration - (choice.kind is ControllerKind.SAMPLE)
    simulator = None if is_direct(spec) else own if choice.simulator is None else choice.simulator
    return ReplayRequest(
        experiment=row.id,
        choice=choice,
        spec=sent(spec),
        genome=tuple(found.genome),
        simulator=simulator,
        parameters=None if simulator is None else _best(session, row.id, choice.repetition, simulator),
        simulated=found.simulated if simulator == own and takes_samples(spec) else None,
        real=found.real,
        readings=None if found.readings is None else tuple(found.readings),
        known=None not in row.spec["reality"]["parameters"].values() and is_computed(spec),
        revealed=row.id not in hidden(session, [row]),
    )


def _best(session: Session, experiment: str, repetition: int, iteration: int) -> tuple[float, ...]:
    found = replays.tuned_parameters(session, experiment, repetition, iteration)
    if not found:
        msg = f"no simulator of iteration {iteration} of repetition {repetition} is tuned yet; try again later"
        raise Conflict(msg)
    return tuple(found[0])


def _name(choice: ReplayChoice) -> str:
    what = "sample" if choice.kind is ControllerKind.SAMPLE else "transferred controller"
    return f"{what} of iteration {choice.iteration} of repetition {choice.repetition}"


SECONDS = 2.0
"""Time limit of the rollouts of one request; the rest stays pending."""

MOST_AT_ONCE = 2_000
"""Samples that are sent to the process in one request."""

SIZE_BYTES = 300
"""Approximate size of a cached prediction."""

MOST_KEPT = 20_000
"""Samples of one experiment that are predicted: those of its first repetitions.

The cache then has room for eight such experiments. An experiment of the paper has 400 samples.
"""

Fitness = float | None
Pair = tuple[Fitness, Fitness]
"""Fitness before and after tuning."""


def predictions(store: Store, process: RolloutProcess, experiment_id: str, *, seconds: float = SECONDS) -> Predictions:
    """Return the predictions of an experiment's samples that are computed so far.

    Each request computes more of them, early iterations first, for `seconds`. The rest counts as pending: repeat the
    request. Samples beyond `MOST_KEPT` are left out.

    Raises:
        NotFound: no such experiment.
        InvalidSpec: its robot, its engine or a tunable is no longer installed.
        EngineUnavailable: the library of its engine is not installed.
        EngineInterrupted: the physics ended its process.
        LimitReached: earlier requests took too long.
    """
    with store.reading() as session:
        row = experiments.get_experiment(session, experiment_id)
        every = replays.tuned_samples(session, row)
    samples = every[:MOST_KEPT]
    spec = spec_of(row.spec)
    sent_spec = sent(spec)
    unknown = [each for each in samples if process.answers.get(_key(row.id, each)) is None]
    unknown.sort(key=lambda each: (each.iteration, each.repetition))
    if unknown:
        refuse_missing(spec)
        pairs = process.call(predict, sent_spec, unknown[:MOST_AT_ONCE], seconds, plugins=sent_spec.plugins)
        for sample, pair in zip(unknown, pairs, strict=False):
            process.answers.keep(_key(row.id, sample), pair, SIZE_BYTES)
    items = _items(row.id, samples, process.answers)
    return Predictions(
        experiment=row.id,
        unit=unit(spec),
        items=items,
        pending=len(samples) - len(items),
        left_out=len(every) - len(samples),
    )


def predict(spec: SentSpec, samples: Sequence[TunedSample], seconds: float) -> list[Pair]:
    """Return the fitness of samples before and after tuning: of the first, and of as many others as time permits."""
    read = received(spec)
    robot = robot_of(read)
    simulate = simulation_of(read, robot)
    found: list[Pair] = []
    until = monotonic() + seconds
    for sample in samples:
        parameters = np.array([sample.before or sample.after, sample.after])
        before, after = simulate(np.array([sample.genome]), parameters)[0].tolist()
        found.append((known(before) if sample.before else None, known(after)))
        if monotonic() > until:
            break
    return found


def _items(experiment: str, samples: Sequence[TunedSample], answers: AnswerCache) -> tuple[Prediction, ...]:
    pairs: list[Pair | None] = [answers.get(_key(experiment, each)) for each in samples]
    return tuple(
        Prediction(
            repetition=sample.repetition,
            iteration=sample.iteration,
            simulated_before=pair[0],
            simulated_after=pair[1],
            fitness=sample.fitness,
        )
        for sample, pair in zip(samples, pairs, strict=True)
        if pair is not None
    )


def _key(experiment: str, sample: TunedSample) -> Key:
    """Return the key of a prediction; a correction may change the sample of an iteration and its simulators."""
    computed_from = repr((sample.genome, sample.before, sample.after))
    return "prediction", experiment, sample.repetition, sample.iteration, sha256(computed_from.encode()).hexdigest()
