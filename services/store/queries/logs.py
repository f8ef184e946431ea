"""Repetitions' logs: how a step is stored as a row, and read again to the last bit.

A body has vectors as JSON arrays, in which floats round-trip exactly, and leaves out what is unknown. JSON has no nan
and no infinity: a reading of nan and a squared error of infinity are null.
"""

from collections.abc import Mapping, Sequence
from math import inf, nan
from typing import Any, cast

from sqlalchemy import Row, Table, select
from sqlalchemy.orm import Session

from gaplab.services.core.arrays import NO_GENOMES, NO_READINGS, FloatArray, Genomes, frozen, known
from gaplab.services.core.types import (
    Cost,
    Fit,
    Measured,
    Probed,
    Sample,
    Selected,
    Simulator,
    Step,
    Transferred,
    Tuned,
    may_follow,
    place_of,
)
from gaplab.services.store.models import LOG, BranchRow, StepKind, StepRow

_STEP = cast("Table", StepRow.__table__)


def logs(session: Session, repetitions: Sequence[int]) -> dict[int, tuple[Step, ...]]:
    """Return the log of each of these repetitions."""
    row = StepRow
    found: dict[int, list[Step]] = {each: [] for each in repetitions}
    query = select(*_STEP.columns).where(row.repetition_id.in_(repetitions), row.branch == LOG)
    for each in session.execute(query.order_by(row.repetition_id, row.place)):
        found[each.repetition_id].append(step_of(each))
    return {repetition: tuple(steps) for repetition, steps in found.items()}


def last_step(session: Session, repetition: int) -> Step | None:
    """Return the last step of a log; None of an empty one."""
    row = StepRow
    of_it = select(row).where(row.repetition_id == repetition, row.branch == LOG)
    found = session.scalar(of_it.order_by(row.place.desc()).limit(1))
    return None if found is None else step_of(found)


def is_whole(session: Session, repetition: int, length: int, at_once: int) -> bool:
    """Return whether a log is in order up to the place `length`, and each step, of branches too, is as stored here.

    `at_once` rows are in memory.
    """
    row, count = StepRow, 0
    query = select(*_STEP.columns).where(row.repetition_id == repetition).order_by(row.branch, row.place)
    try:
        for each in session.execute(query, execution_options={"yield_per": at_once}):
            columns = columns_of(step_of(each))
            if any(getattr(each, name) != value for name, value in columns.items()):
                return False
            if each.branch == LOG:
                if not may_follow(step_of(each), count):
                    return False
                count = each.place + 1
    except (KeyError, ValueError, TypeError, AssertionError):  # steps check themselves
        return False
    return count == length


def unknown_branch(session: Session) -> int | None:
    """Return the branch of a step, of any repetition, that is neither the log nor a closed branch; None without any."""
    row, branch = StepRow, BranchRow
    of_it = (branch.repetition_id == row.repetition_id) & (branch.number == row.branch)
    query = select(row.branch).outerjoin(branch, of_it).where(row.branch != LOG, branch.number.is_(None))
    found: int | None = session.scalar(query.limit(1))
    return found


def kind_of(step: Step) -> StepKind:
    """Return the kind of a step."""
    return StepKind(type(step).__name__.lower())


def columns_of(step: Step) -> dict[str, Any]:
    """Return the columns of a step that say what it is; not whose it is, who measured it, and how long it took."""
    cost = getattr(step, "cost", Cost())
    return {
        "kind": kind_of(step),
        "iteration": step.iteration,
        "place": place_of(step),
        "fitness": None,
        "recorded": None,
        "rollouts": int(cost.rollouts),
        "failures": int(cost.failures),
        "saved": int(cost.saved),
    } | _outcome(step)


def _outcome(step: Step) -> dict[str, Any]:
    match step:
        case Selected(told=told):
            return {"body": _found(step) | ({"told": True} if told else {})}
        case Measured(sample=sample):
            return {"fitness": known(sample.fitness), "body": {"genome": sample.genome.tolist()} | _seen(sample)}
        case Tuned(simulators=simulators):
            return {"body": {"simulators": [*map(_packed, simulators)]}}
        case Transferred():
            return {"fitness": known(step.fitness), "body": _found(step)}
        case Probed():
            return {"fitness": known(step.fitness), "recorded": known(step.recorded), "body": _seen(step)}


def _found(step: Selected | Transferred) -> dict[str, Any]:
    members = step.members.tolist()
    return {"genome": step.genome.tolist()} | ({"members": members} if members else {})


def _seen(measured: Sample | Probed) -> dict[str, Any]:
    readings, repeats = [known(each) for each in measured.readings.tolist()], measured.repeats.tolist()
    return ({"readings": readings} if readings else {}) | ({"repeats": repeats} if repeats else {})


def _packed(simulator: Simulator) -> dict[str, Any]:
    interval, fit = simulator.interval, simulator.fit
    packed = {
        "parameters": simulator.parameters.tolist(),
        "squared_error": known(simulator.squared_error),
        "lower": None if interval is None else interval[:, 0].tolist(),
        "upper": None if interval is None else interval[:, 1].tolist(),
        "weight": simulator.weight,
        "held_out_error": simulator.held_out_error,
        "fit": None,
        "noise": None,
    }
    if fit is not None:
        errors = fit.expected_error, fit.surprise, fit.interval_scale, *fit.reading_errors.tolist()
        packed["fit"] = list(map(known, errors))
        packed["noise"] = fit.noise.tolist() or None
    return {name: value for name, value in packed.items() if value is not None or name == "squared_error"}


def step_of(row: StepRow | Row[Any]) -> Step:
    """Return the step that a row describes."""
    body, fitness = row.body, _or(nan, row.fitness)
    cost = Cost(row.rollouts, row.failures, row.saved)
    match row.kind:
        case StepKind.SELECTED:
            told, members = body.get("told", False), _members(body)
            return Selected(row.iteration, frozen(body["genome"]), cost, told, members)
        case StepKind.MEASURED:
            sample = Sample(frozen(body["genome"]), fitness, _vector(body, "readings"), _vector(body, "repeats"))
            return Measured(row.iteration, sample)
        case StepKind.TUNED:
            return Tuned(row.iteration, tuple(map(simulator_of, body["simulators"])), cost)
        case StepKind.TRANSFERRED:
            return Transferred(row.iteration, frozen(body["genome"]), fitness, cost, _members(body))
    seen = _vector(body, "readings"), _vector(body, "repeats")
    return Probed(row.iteration, fitness, _or(nan, row.recorded), *seen, left_out=row.measured_by is None)


def simulator_of(packed: Mapping[str, Any]) -> Simulator:
    """Return a simulator of the body of a tuned step."""
    lower, upper = packed.get("lower"), packed.get("upper")
    return Simulator(
        parameters=frozen(packed["parameters"]),
        squared_error=_or(inf, packed["squared_error"]),
        interval=None if lower is None or upper is None else frozen(list(zip(lower, upper, strict=True))),
        weight=packed.get("weight"),
        held_out_error=packed.get("held_out_error"),
        fit=_fit_of(packed.get("fit"), packed.get("noise", ())),
    )


def _fit_of(stored: Sequence[float | None] | None, noise: Sequence[float]) -> Fit | None:
    if stored is None or None in stored[:3]:
        return None
    expected, surprise, scale, *errors = [_or(nan, each) for each in stored]
    return Fit(expected, surprise, scale, frozen(errors), frozen(noise))


def _members(body: Mapping[str, Any]) -> Genomes:
    return frozen(body["members"]) if "members" in body else NO_GENOMES


def _vector(body: Mapping[str, Any], name: str) -> FloatArray:
    return frozen(body[name]) if name in body else NO_READINGS


def _or(missing: float, value: float | None) -> float:
    return missing if value is None else value
