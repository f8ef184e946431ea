"""Replays: a measured controller in its simulator and in reality, computed anew at the time of asking."""

from dataclasses import dataclass

from gaplab.schemas.records import MeasurementKind
from gaplab.schemas.replays import ControllerKind, Replay
from gaplab.schemas.spec import ExperimentSpec
from gaplab.services.core.errors import Conflict, InvalidSpec, NotFound, Violation
from gaplab.services.core.robots import robots
from gaplab.services.replay.process import Key, Physics
from gaplab.services.replay.rollout import Film, film
from gaplab.services.specs.assembly import refuse_missing
from gaplab.services.specs.resolution import is_direct, spec_of
from gaplab.services.store.models import ExperimentRow
from gaplab.services.store.queries import experiments, replays
from gaplab.services.store.session import Session, Store

_ASKED_AS = {ControllerKind.SAMPLE: MeasurementKind.SAMPLE, ControllerKind.TRANSFER: MeasurementKind.PROBE}


@dataclass(frozen=True)
class Wanted:
    """Which controller, in which simulator.

    Attributes:
        repetition: its number, from 0.
        iteration: that measured the sample, or transferred the controller.
        kind: a sample, or the transferred controller.
        simulator: the iteration whose best simulator it is shown in; None is the one that it was chosen in: a
            transferred controller's own, and of a sample that of the iteration before.
    """

    repetition: int = 0
    iteration: int = 0
    kind: ControllerKind = ControllerKind.TRANSFER
    simulator: int | None = None


def replay(store: Store, physics: Physics, experiment_id: str, wanted: Wanted) -> Replay:
    """The motion of the controller in both worlds; raises as `replay_json` does."""
    return Replay.model_validate_json(replay_json(store, physics, experiment_id, wanted))


def replay_json(store: Store, physics: Physics, experiment_id: str, wanted: Wanted) -> bytes:
    """A Replay as JSON.

    Reality is shown of what was measured there, and only of that: the motion of a controller that reality has answered
    about, not its parameters.

    Raises:
        NotFound: no such experiment, or it will never have such a repetition or iteration.
        Conflict: reality has not answered yet, or the simulator is not tuned yet.
        InvalidSpec: a robot without a body, or what it is simulated with has gone from here.
        EngineUnavailable: an engine is not installed here.
        EngineInterrupted: the physics died.
        LimitReached: others were asking for too long.
    """
    with store.reading() as session:
        row = experiments.get_experiment(session, experiment_id)
        spec = spec_of(row.spec)
        _refuse_impossible(row, spec, wanted)
        asked = _film(session, row, spec, wanted)
    key: Key = ("replay", row.id, wanted.repetition, wanted.iteration, wanted.kind, asked.simulator)
    found: bytes | None = physics.memory.get(key)
    if found is None:
        refuse_missing(spec, reality=asked.known)
        found = physics.ask(film, asked)
        physics.memory.keep(key, found, len(found))
    return found


def _refuse_impossible(row: ExperimentRow, spec: ExperimentSpec, wanted: Wanted) -> None:
    if not robots.create(spec.robot).world.bodies:
        message = f"the robot {spec.robot.name!r} has no body, so there is nothing to be seen moving"
        raise InvalidSpec([Violation("id", row.id, message, "an experiment with a robot that has a body")])
    first = 1 if wanted.kind is ControllerKind.SAMPLE else 0
    _refuse_outside("repetition", wanted.repetition, 0, row.spec["repetitions"])
    _refuse_outside(f"iteration with a {wanted.kind}", wanted.iteration, first, row.iterations)
    if wanted.simulator is not None:
        _refuse_outside("tuned simulator of iteration", wanted.simulator, 0, 0 if is_direct(spec) else row.iterations)


def _refuse_outside(what: str, number: int, first: int, end: int) -> None:
    if not first <= number < end:
        there = f"{first} to {end - 1}" if end > first else "none"
        msg = f"the experiment has no {what} {number}; there is {there}"
        raise NotFound(msg)


def _film(session: Session, row: ExperimentRow, spec: ExperimentSpec, wanted: Wanted) -> Film:
    found = replays.measured_controller(session, row.id, wanted.repetition, wanted.iteration, _ASKED_AS[wanted.kind])
    if found is None:
        msg = f"reality has not been asked yet about the {_name(wanted)}; look again later"
        raise Conflict(msg)
    own = wanted.iteration - (1 if wanted.kind is ControllerKind.SAMPLE else 0)
    simulator = None if is_direct(spec) else own if wanted.simulator is None else wanted.simulator
    return Film(
        experiment=row.id,
        repetition=wanted.repetition,
        iteration=wanted.iteration,
        kind=wanted.kind,
        spec=spec.model_dump_json(),
        genome=tuple(found.genome),
        simulator=simulator,
        parameters=None if simulator is None else _best(session, row.id, wanted.repetition, simulator),
        simulated=found.simulated if simulator == own else None,
        real=found.real,
        known=None not in row.spec["reality"]["parameters"].values(),
    )


def _best(session: Session, experiment: str, repetition: int, iteration: int) -> tuple[float, ...]:
    found = replays.tuned_parameters(session, experiment, repetition, iteration)
    if not found:
        msg = f"no simulator of iteration {iteration} of repetition {repetition} is tuned yet; look again later"
        raise Conflict(msg)
    return tuple(found[0])


def _name(wanted: Wanted) -> str:
    what = "sample" if wanted.kind is ControllerKind.SAMPLE else "transferred controller"
    return f"{what} of iteration {wanted.iteration} of repetition {wanted.repetition}"
