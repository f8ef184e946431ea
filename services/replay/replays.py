"""Replays: the motion of a measured controller in its simulator and in reality, and robots at their start."""

from dataclasses import replace
from hashlib import sha256

from gaplab.schemas.records import MeasurementKind
from gaplab.schemas.replays import ControllerKind, Replay, RobotShapes
from gaplab.schemas.resolved import ResolvedSpec
from gaplab.services.core.errors import Conflict, InvalidSpec, NotFound, Violation
from gaplab.services.experiments import stored_robots
from gaplab.services.experiments.views import hidden
from gaplab.services.replay.process import Key, RolloutProcess
from gaplab.services.replay.rollout import LAST, ReplayChoice, ReplayRequest, compute_replay
from gaplab.services.replay.sent_specs import sent
from gaplab.services.replay.shapes import at_start
from gaplab.services.specs.assembly import refuse_missing
from gaplab.services.specs.resolution import is_computed, is_direct, takes_samples
from gaplab.services.specs.robots import robot_of
from gaplab.services.specs.stored_specs import spec_of
from gaplab.services.store.models import ExperimentRow
from gaplab.services.store.queries import experiments, replays
from gaplab.services.store.session import Session, Store
from gaplab.services.world.robot_files import stored_robot_file
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
    world = own if own is not None else stored_robot_file(stored_robots.robot_text(store, name)).world
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
