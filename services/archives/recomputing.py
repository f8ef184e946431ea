"""Recomputation of one repetition of an archive, compared with its stored steps."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from math import inf
from time import time
from typing import Any

import numpy as np

from gaplab.schemas.archives import Outcome, RepetitionRerun
from gaplab.services.core import robot_library
from gaplab.services.core.loop import repetition
from gaplab.services.core.ports import Reality
from gaplab.services.core.stored_specs import spec_of
from gaplab.services.core.types import Measured, Probed, Step, Transferred
from gaplab.services.engines import engines
from gaplab.services.specs.assembly import setting


@dataclass(frozen=True)
class Recorded:
    """A repetition as an archive has it.

    Attributes:
        experiment: id of its experiment.
        name: name of its experiment.
        number: number of the repetition, from 0.
        spec: stored spec of the experiment.
        log: steps of the repetition.
        robots: texts of the robot files that the spec needs, for a process that does not know them.
        until: time in seconds since 1970 after which no further step is computed.
    """

    experiment: str
    name: str
    number: int
    spec: Mapping[str, Any]
    log: tuple[Step, ...]
    robots: tuple[str, ...] = ()
    until: float = inf


def rerun(recorded: Recorded) -> RepetitionRerun:
    """Recompute a repetition, and compare it step by step until one differs.

    Any error is the reason why the repetition is not computed, and ends no other one.
    """
    same, reason = 0, None
    outcome: Outcome = "same"
    try:
        if (reason := _obstacle(recorded)) is not None:
            outcome = "not computed"
        else:
            for stored, step in zip(recorded.log, _computed(recorded), strict=False):
                if time() > recorded.until:
                    reason = "the time was over"
                    break
                if (found := difference(stored, step)) is not None:
                    kind = type(stored).__name__.lower()
                    outcome, reason = "different", f"step {same + 1} ({kind}, iteration {stored.iteration}): {found}"
                    break
                same += 1
            else:
                if same < len(recorded.log):
                    outcome, reason = "different", f"it ends here after {same} steps"
            outcome = outcome if same or outcome == "different" else "not computed"
    except (Exception, SystemExit) as error:  # noqa: BLE001 - a plug-in may raise anything
        outcome, reason = "not computed", f"{type(error).__name__}: {error}"
    return result_of(recorded, outcome, same, reason)


def result_of(recorded: Recorded, outcome: Outcome, steps: int, reason: str | None) -> RepetitionRerun:
    """Return how the recomputation of a repetition ended."""
    return RepetitionRerun(
        experiment=recorded.experiment,
        name=recorded.name,
        repetition=recorded.number,
        outcome=outcome,
        steps=steps,
        stored_steps=len(recorded.log),
        reason=reason,
    )


def _computed(recorded: Recorded) -> Iterator[Step]:
    robot_library.learn(recorded.robots)
    found = setting(spec_of(recorded.spec), recorded.number)
    if recorded.spec["reality"]["kind"] == "physical":
        found = replace(found, reality=_stored_answers(recorded.log))
    return repetition(found)


def _stored_answers(log: Sequence[Step]) -> Reality:
    """Return a reality that answers about each genome of a log as the robot on the bench did."""
    answers, transferred = {}, None
    for step in log:
        match step:
            case Transferred(genome=genome):
                transferred = genome
            case Measured(sample=sample):
                answers[sample.genome.tobytes()] = sample.fitness, sample.readings, sample.repeats
            case Probed(left_out=False) if transferred is not None:
                answers[transferred.tobytes()] = step.fitness, step.readings, step.repeats
    return lambda genome: answers[genome.tobytes()]  # type: ignore[return-value] # with the repeats, as from a bench


def _obstacle(recorded: Recorded) -> str | None:
    """Return why a repetition cannot be computed here; None if it can."""
    reality = recorded.spec["reality"]
    if any(value is None for value in reality["parameters"].values()):
        return "the archive hides parameters of reality"
    for name in {each["name"] for each in (recorded.spec["engine"], reality["engine"]) if each}:
        if name not in engines:
            return f"the engine {name!r} is not installed here"
        if not engines[name].available():
            return f"the engine {name!r} is not installed here: {engines[name].install}"
        if not engines[name].repeatable:
            return f"the engine {name!r} measures a robot, and a measurement cannot be repeated"
    return None


def difference(stored: Step, computed: Step) -> str | None:
    """Return the first number that differs, with both values; None if all numbers have the same bits.

    The fit of simulators is compared if the archive knows it: those of earlier versions do not.
    """
    if type(stored) is not type(computed):
        return f"it is {type(computed).__name__} here, and {type(stored).__name__} in the archive"
    before = dict(_numbers(stored))
    now = {place: number for place, number in _numbers(computed) if place in before or ".fit." not in place}
    for place in before | now:
        here, there = (repr(numbers[place]) if place in numbers else "absent" for numbers in (now, before))
        if here != there:  # the shortest text of a number tells all of its bits
            return f"{place} is {here} here, and {there} in the archive"
    return None


def _numbers(value: object, place: str = "") -> Iterator[tuple[str, float]]:
    """Yield every number in a step with its place, like `simulators[0].squared_error`."""
    if is_dataclass(value):
        for field in fields(value):
            yield from _numbers(getattr(value, field.name), f"{place}.{field.name}" if place else field.name)
    elif isinstance(value, tuple | np.ndarray):
        for index, item in enumerate(value):
            yield from _numbers(item, f"{place}[{index}]")
    elif value is not None:
        yield place, float(value)  # type: ignore[arg-type] # steps have numbers only
