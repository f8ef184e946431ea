"""Whether the service kept its word: what was acknowledged against what is in the database. It changes nothing.

Each check takes the history and the evidence and gives a sentence for each violation.
"""

from collections import Counter, defaultdict
from collections.abc import Iterator
from typing import Any

from gaplab.schemas.lifecycle import MOVES, State
from gaplab.schemas.resolved import ResolvedSpec
from gaplab.schemas.spec import ExperimentSpec, StudySpec
from gaplab.services.specs.resolution import resolve
from tests.soak.bench_checker import measurements
from tests.soak.drive_checker import drives, held
from tests.soak.evidence import on_a_bench, undisturbed
from tests.soak.misbehaviour import at_fault

GIVEN_UP = "lost 5 times without progress"
"""Why the service may fail a repetition whose worker dies again and again; it is counted, and shown in the table."""


def violations(history: Any, evidence: Any, expected: Any = undisturbed) -> Any:
    """Everything that is wrong; nothing, if the service kept its word.

    Args:
        history: what clients were told.
        evidence: what the database has.
        expected: digests of an undisturbed repetition of a spec.
    """
    return [
        *submissions(history, evidence),
        *answers(history, evidence),
        *verbs(history, evidence),
        *ends(evidence),
        *results(history, evidence, expected),
        *epochs(evidence),
        *drives(evidence.commands),
        *measurements(history, evidence),
        *held(evidence),
        *evidence.complaints,
    ]


def submissions(history: Any, evidence: Any) -> Iterator[Any]:
    """Each acknowledged one is there exactly once, each other at most once, and nothing else is."""
    names = Counter(evidence.studies.values())
    asked = {record.body["name"]: record for record in history if record.verb == "submit"}
    found = {each.id: each for each in evidence.experiments}
    for name, record in asked.items():
        there = names.pop(name, 0)
        if there > 1 or (record.acknowledged and there != 1):
            told = "acknowledged" if record.acknowledged else f"answered with {record.status}"
            yield f"{name}: {told}, and there {there} times"
        elif record.acknowledged:
            yield from _as_submitted(record, found, evidence.studies, _extensions(history))
        elif there and record.status is not None and record.status < 500:
            yield f"{name}: refused with {record.status}, and yet there"
    for name in names:
        yield f"{name}: nobody submitted it"


def _extensions(history: Any) -> Any:
    return {record.id for record in history if record.verb == "extend"}


def _as_submitted(record: Any, found: Any, studies: Any, extended: Any) -> Iterator[Any]:
    name, answer = record.body["name"], record.answer
    kind = StudySpec if record.path == "/studies" else ExperimentSpec
    wanted, ids = resolve(kind.model_validate(record.body)), [one["id"] for one in answer.get("experiments", [answer])]
    if answer["id"] not in studies:
        yield f"{name}: the study {answer['id']} that was acknowledged is not there"
    if len(ids) != len(wanted):
        yield f"{name}: {len(ids)} experiments instead of {len(wanted)}"
    for each, spec in zip(ids, wanted, strict=False):
        if each in found:
            yield from (f"{name}: {wrong}" for wrong in _unlike(found[each], spec, larger=each in extended))
        else:
            yield f"{name}: the experiment {each} that was acknowledged is not there"


def _unlike(experiment: Any, spec: Any, larger: Any) -> Iterator[Any]:
    there = ResolvedSpec.model_validate(experiment.spec)
    spec = spec.model_copy(update={"priority": there.priority})  # a column keeps it
    if larger:
        spec = spec.model_copy(update={"iterations": there.iterations, "repetitions": there.repetitions})
    if there != spec:
        yield f"the experiment {experiment.id} has another spec than was submitted"
    if [each.number for each in experiment.repetitions] != list(range(there.repetitions)):
        yield f"the experiment {experiment.id} has other repetitions than 0 to {there.repetitions - 1}"


def answers(history: Any, evidence: Any) -> Iterator[Any]:
    """No request fails inside the service, and what was acknowledged is never said not to exist."""
    for record in history:
        if record.status == 500:
            yield f"{record.verb} {record.path}: the service failed: {record.answer.get('detail')}"
        if record.status == 404:
            yield f"{record.verb} {record.path}: acknowledged before, and said not to exist"


def verbs(history: Any, evidence: Any) -> Iterator[Any]:
    """Each acknowledged one took effect."""
    found = {each.id: each for each in evidence.experiments}
    moves = defaultdict(list)
    for move in evidence.moves:
        moves[move.repetition].append(move)
    for record in history:
        if record.verb in EFFECTS and record.acknowledged and record.id in found:
            experiment = found[record.id]
            own = [move for each in experiment.repetitions for move in moves[each.id]]
            if not EFFECTS[record.verb](record, experiment, own, history):
                yield f"{record.path}: acknowledged, and without effect: it is {experiment.state}"


def _cancelled(record: Any, experiment: Any, moves: Any, history: Any) -> Any:
    later = [move for move in moves if move.at > record.answered_at and move.steps != move.steps_was]
    return experiment.state == State.CANCELLED and not later


def _held(*ends: Any) -> Any:
    """Nothing of it is begun until somebody may have asked for that."""

    def held(record: Any, experiment: Any, moves: Any, history: Any) -> bool:
        asked = [each.sent_at for each in history if each.verb in ends and each.id == record.id]
        until = min((at for at in asked if at > record.sent_at), default=float("inf"))
        return not any(_claims(move) and record.answered_at < move.at < until for move in moves)

    return held


def _extended(record: Any, experiment: Any, moves: Any, history: Any) -> Any:
    return all(experiment.spec[name] >= total for name, total in record.body.items())


def _claims(move: Any) -> Any:
    return move.state == State.RUNNING and move.was != State.RUNNING


EFFECTS = {"cancel": _cancelled, "stop": _held("extend"), "pause": _held("resume", "extend"), "extend": _extended}


def ends(evidence: Any) -> Iterator[Any]:
    """Nothing is stuck, and an experiment ends as its repetitions do."""
    for experiment in evidence.experiments:
        states = {each.state for each in experiment.repetitions}
        if not State(experiment.state).ended:
            yield f"{experiment.id} is stuck: {experiment.state}"
        for each in experiment.repetitions:
            if not State(each.state).ended:
                yield f"{experiment.id}/{each.number} is stuck: {each.state}"
        if experiment.state == State.COMPLETED and State.COMPLETED not in states:
            yield f"{experiment.id} is COMPLETED, and none of its repetitions is"
    for check, state in evidence.checks.items():
        if not State(state).ended:
            yield f"the sensitivity check {check} is stuck: {state}"


def results(history: Any, evidence: Any, expected: Any) -> Iterator[Any]:
    """No log has holes, and each has the numbers of an undisturbed one: all of them, if it was completed.

    Experiments that are themselves at fault may have failed.
    """
    cut_short = {record.id for record in history if record.verb == "stop"}
    for experiment in evidence.experiments:
        for each in experiment.repetitions:
            where = f"{experiment.id}/{each.number}"
            if each.places != tuple(range(each.steps)):
                yield f"{where}: {each.steps} steps are counted, and there are {list(each.places)}"
            if at_fault(experiment.spec):
                continue
            if each.state == State.FAILED and not (each.error or "").startswith(GIVEN_UP):
                yield f"{where}: failed: {each.error}"
            whole = expected(experiment.spec, each.number)
            if each.log != whole[: len(each.log)]:
                step = next(
                    place
                    for place, (one, other) in enumerate(zip(each.log, (*whole, None), strict=False))
                    if one != other
                )
                yield f"{where}: step {step} is another than without faults"
            elif each.state == State.COMPLETED and len(each.log) != len(whole) and experiment.id not in cut_short:
                yield f"{where}: COMPLETED with {len(each.log)} of {len(whole)} steps"


def epochs(evidence: Any) -> Iterator[Any]:
    """One winner an epoch, no step by anybody else, and no forbidden move."""
    winners, steps = {}, Counter()  # type: ignore[var-annotated]
    measured = {each.id for one in evidence.experiments if on_a_bench(one.spec) for each in one.repetitions}
    for move in evidence.moves:
        where = f"move {move.id} of repetition {move.repetition}"
        of_steps = _of_steps(move, winners, steps, by_answers=move.repetition in measured)
        yield from (f"{where}: {wrong}" for wrong in (*_of_state(move, winners), *of_steps))
        steps[move.repetition] = move.steps
    for experiment in evidence.experiments:
        for each in experiment.repetitions:
            if each.steps != steps[each.id]:
                yield f"{experiment.id}/{each.number}: {each.steps} steps, and {steps[each.id]} by its moves"


def _of_state(move: Any, winners: Any) -> Iterator[Any]:
    claimed = _claims(move)
    if move.was != move.state and State(move.state) not in MOVES[State(move.was)]:
        yield f"from {move.was} to {move.state}"
    if move.epoch != move.epoch_was + claimed:
        yield f"from epoch {move.epoch_was} to {move.epoch}"
    if claimed and (move.repetition, move.epoch) in winners:
        yield f"epoch {move.epoch} has two winners"
    if claimed:
        winners[move.repetition, move.epoch] = move.owner


def _of_steps(move: Any, winners: Any, steps: Any, by_answers: Any) -> Iterator[Any]:
    """Steps are added by the winner of the epoch; on a bench also by an answer, and taken away by a correction."""
    by_answer = by_answers and move.owner is None
    if move.steps_was != steps[move.repetition] or (move.steps < move.steps_was and not by_answer):
        yield f"from {move.steps_was} to {move.steps} steps, after {steps[move.repetition]}"
    if move.steps > move.steps_was and not by_answer and winners.get((move.repetition, move.epoch)) != move.owner:
        yield f"steps by {move.owner}, whose epoch it is not"
