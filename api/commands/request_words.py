"""Requests for measurements in words: a table of them, one with its answers, and warnings about its controller."""

import json
from collections.abc import Iterator, Sequence

from rich.markup import escape
from rich.table import Table

from gaplab.api.commands.json_output import echo
from gaplab.api.commands.tables import table
from gaplab.schemas.measurements import AnswerRead, AnswerState, RequestRead, RequestState

_WANTED = (RequestState.OPEN, RequestState.TAKEN, RequestState.STUCK)


def request_table(items: Sequence[RequestRead], *, with_answers: bool) -> Table:
    """Return a table of requests, perhaps with the measurements that answer each."""
    columns = ("request", "experiment", "repetition", "iteration", "repeats", "bench", "state")
    rows = map(_row, items)
    if not with_answers:
        return table(columns, rows)
    answers = ("\n".join(escape(answer_words(each, item.unit)) for each in item.answers) for item in items)
    return table((*columns, "measurements"), ((*row, cell) for row, cell in zip(rows, answers, strict=True)))


def request_words(found: RequestRead) -> Iterator[str]:
    """Yield what a request asks for, a line each, and its answers."""
    place = f"{found.kind.value} of iteration {found.iteration}, repetition {found.repetition}"
    yield f"{found.id} is {found.state.value}: {place} of {found.experiment_name} ({found.experiment})"
    yield f"  repeats: {found.repeats}, fitness in {found.unit}"
    yield f"  genome: {json.dumps(found.genome)}"
    yield from (f"  {answer_words(answer, found.unit)}" for answer in found.answers)


def answer_words(answer: AnswerRead, unit: str) -> str:
    """Return an answer with its id and its state: the values, or why there are none."""
    if answer.values is None:
        return f"{answer.id} {answer.state.value}: failed, by {answer.operator}: {answer.failed}"
    values = ", ".join(f"{value:.6g}" for value in answer.values)
    return f"{answer.id} {answer.state.value}: {values} {unit} by {answer.operator}"


def stored_words(answer: AnswerRead) -> str:
    """Return a sentence about an answer that the service has stored, and how a conflict is decided."""
    stored = f"Measurement {answer.id} is stored: {answer.state.value}."
    if answer.state is not AnswerState.CONFLICT:
        return stored
    decision = f"`gaplab decide {answer.id} this --reason WHY`, or `other` in place of `this`"
    return f"{stored} It came late or second, so a person decides which one counts: {decision}"


def print_safety(found: RequestRead) -> None:
    """Print what to do before a run, and what simulators expect; on standard error what is beyond limits or unknown."""
    if found.state not in _WANTED:
        return
    for line in filter(None, (found.needs, found.between_repeats, *found.expected)):
        echo(f"  {line}")
    for warning in (*found.safety.beyond, *found.safety.unknown) if found.safety else ():
        echo(f"warning: {warning}", err=True)


def _row(found: RequestRead) -> tuple[str, ...]:
    beyond = found.safety and found.safety.beyond and found.state in _WANTED
    state = found.state.value + (f" by {escape(found.taken_by)}" if found.taken_by else "")
    return (
        found.id,
        escape(found.experiment_name),
        f"{found.repetition}",
        f"{found.iteration} ({found.kind.value})",
        f"{found.repeats}",
        escape(found.bench),
        f"{state}, beyond its limits" if beyond else state,
    )
