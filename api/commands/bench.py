"""Commands for a robot on a bench: what to measure, answers by hand, corrections, and the loop of a driver."""

import json
import re
import signal
from collections.abc import Iterable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Literal, cast

import typer
from rich.markup import escape
from rich.table import Table
from typer.core import TyperCommand

from gaplab.api.clients.bench import Details
from gaplab.api.clients.client import Client
from gaplab.api.clients.drivers import DriverBroken, Robot, load, measure
from gaplab.api.clients.errors import if_found
from gaplab.api.commands.app import BENCH, Answer, AsJson, ExperimentId, Url, app, command, connect
from gaplab.api.commands.exit_codes import CommandError, Exit
from gaplab.api.commands.json_output import echo, print_result
from gaplab.api.commands.questions import confirmed
from gaplab.api.commands.tables import table
from gaplab.schemas.corrections import Consequences
from gaplab.schemas.measurements import AnswerRead, AnswerState, RequestRead, RequestState
from gaplab.schemas.traces import TracesRead
from gaplab.services.csv_tables import finite

RequestId = Annotated[str, typer.Argument(metavar="REQUEST", help="a request, as `gaplab requests` lists it")]
AnswerId = Annotated[str, typer.Argument(metavar="MEASUREMENT", help="a measurement, as `gaplab requests ID` lists it")]
_VALUES = typer.Argument(metavar="VALUE", help="fitness of each repeat")
Numbers = Annotated[list[str] | None, _VALUES]
Failed = Annotated[str | None, typer.Option("--failed", help="why there are no values")]
Reason = Annotated[str, typer.Option("--reason", help="reason, which is stored")]
Operator = Annotated[str | None, typer.Option("--operator", help="person who measured")]
By = Annotated[str | None, typer.Option("--operator", help="person who decides")]
Yes = Annotated[bool, typer.Option("--yes", help="send the values without a question, even if they are unlikely")]
DryRun = Annotated[bool, typer.Option("--dry-run", help="only print what would follow; store nothing")]

_WANTED = (RequestState.OPEN, RequestState.TAKEN, RequestState.STUCK)
_NEGATIVE = re.compile(r"-\.?\d")


class ValuesCommand(TyperCommand):
    """A command that takes -0.3 as a number; other commands take it as the option -0."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:  # noqa: ANN401 - in a private module of Typer
        """Parse arguments; a space before a negative number, which `float` ignores, says that it is not an option."""
        return super().parse_args(ctx, [f" {each}" if _NEGATIVE.match(each) else each for each in args])


@command(BENCH)
def requests(
    client: Client,
    id: Annotated[str | None, typer.Argument(metavar="ID", help="an experiment, or a request to read whole")] = None,
    bench: Annotated[str | None, typer.Option(help="only requests of this bench")] = None,
    all_: Annotated[bool, typer.Option("--all", help="also requests that are measured, failed or withdrawn")] = False,
    as_json: AsJson = False,
) -> None:
    """List the measurements that experiments wait for, or read one request with its answers."""
    if id is not None:
        with if_found():
            _print_request(client.bench.request(id), as_json=as_json)
            return
    read = client.bench.history if all_ else client.bench.pending
    items = read(id, bench=bench)
    nothing = "" if items or as_json else _nothing(client, id, bench, all_=all_)
    print_result(items, nothing or _request_table(items, with_answers=all_), as_json=as_json)


@command(BENCH)
def motion(
    client: Client,
    id: RequestId,
    form: Annotated[Literal["csv", "json", "ros2"], typer.Option("--format", help="ros2: a JointTrajectory")] = "csv",
    as_json: AsJson = False,
) -> None:
    """Print the motion that a request asks for."""
    echo(client.bench.motion(id, "json" if as_json else form), nl=False)


@command(BENCH, cls=ValuesCommand)
def measured(  # noqa: PLR0913, PLR0917 - each is an option of the command
    client: Client,
    id: RequestId,
    values: Numbers = None,
    failed: Failed = None,
    note: Annotated[str | None, typer.Option("--note")] = None,
    operator: Operator = None,
    yes: Yes = False,
) -> Answer:
    """Answer a request by hand: with the fitness of each repeat, or --failed and why."""
    measured, details = _numbers(values), _given(failed=failed, note=note, operator=operator)
    details["confirmed"] = yes or confirmed(client.bench.doubts(id, measured, **details))
    found = client.bench.answer(id, measured, **details)
    return Answer(found, _stored_words(found))


@command(BENCH)
def traces(  # noqa: PLR0913, PLR0917 - each is an option of the command
    client: Client,
    id: RequestId,
    files: Annotated[
        list[Path],
        typer.Argument(help="recorded motion: CSV, MCAP, Parquet, or a LeRobot data set; one for each repeat"),
    ],
    topic: Annotated[str | None, typer.Option(help="topic in MCAP of the base's pose, or of the joints")] = None,
    body: Annotated[str | None, typer.Option(help="child_frame_id of the base, if it has several")] = None,
    episode: Annotated[int | None, typer.Option(help="number of the episode of a LeRobot data set")] = None,
    columns: Annotated[
        list[str] | None,
        typer.Option(
            "--map", metavar="JOINT=COLUMN", help="a joint's columns, and how they count: 'elbow=E [-deg @ 90]'"
        ),
    ] = None,
    answer: Annotated[bool, typer.Option("--answer", help="answer the request with them")] = False,
    lag_s: Annotated[
        list[float] | None, typer.Option("--lag", help="when the motion began on the clock of each recording, s")
    ] = None,
    operator: Operator = None,
    yes: Yes = False,
) -> Answer:
    """Compute fitness and readings from recordings of a motion, and answer its request with --answer."""
    if operator and not answer:
        raise typer.BadParameter("it names who answers; add --answer", param_hint="--operator")
    joints = dict(pair(each) for each in columns or ())
    attach = partial(client.bench.attach_trace, columns=joints, topic=topic, body=body, episode=episode)
    stored = [attach(file).id for file in files]
    said = client.bench.traces(id, stored, lag_s)
    if not answer:
        return Answer(said, _words_of(said))
    if said.doubts and not yes and not confirmed(said.doubts):
        raise CommandError("nothing was sent; if the traces are right, add --yes", Exit.CONFLICT)
    details: Details = {"traces": stored, "lags_s": [each.lag_s for each in said.traces], "confirmed": True}
    found = client.bench.answer(id, **_given(operator=operator) | details)
    return Answer(found, _words_of(said), _stored_words(found))


@command(BENCH, cls=ValuesCommand)
def correct(  # noqa: PLR0913, PLR0917 - each is an option of the command
    client: Client,
    id: AnswerId,
    reason: Reason,
    values: Numbers = None,
    failed: Failed = None,
    operator: By = None,
    dry_run: DryRun = False,
) -> Answer:
    """Replace the values of a measurement; what was computed from them is computed again."""
    right, details = _numbers(values), _given(failed=failed, operator=operator)
    return _consequences(client.bench.correct(id, right, reason=reason, dry_run=dry_run, **details), dry_run=dry_run)


@command(BENCH)
def void(client: Client, id: AnswerId, reason: Reason, operator: By = None, dry_run: DryRun = False) -> Answer:
    """Declare a measurement invalid; its controller is requested again."""
    return _consequences(client.bench.void(id, reason=reason, operator=operator, dry_run=dry_run), dry_run=dry_run)


@command(BENCH)
def decide(
    client: Client,
    id: AnswerId,
    counts: Annotated[Literal["this", "other"], typer.Argument(help="which of the two measurements counts")],
    reason: Reason,
    operator: By = None,
    dry_run: DryRun = False,
) -> Answer:
    """Decide about a measurement in conflict: let it count in place of the other, or dismiss it."""
    found = client.bench.decide(id, counts, reason=reason, operator=operator, dry_run=dry_run)
    return _consequences(found, dry_run=dry_run)


@command(BENCH)
def reopen(
    client: Client,
    id: RequestId,
    reason: Annotated[str | None, typer.Option(help="why the take of somebody else ends, like a dead phone")] = None,
    operator: By = None,
) -> Answer:
    """Open a request again that was taken too often without an answer; with a reason, one that somebody has taken."""
    found = client.bench.reopen(id, reason=reason, operator=operator)
    return Answer(found, f"Request {found.id} is {found.state.value}.")


def pair(text: str, option: str = "--map", form: str = "JOINT=COLUMN, like 'elbow=Elbow [deg]'") -> tuple[str, str]:
    """Return name and value of `NAME=VALUE`; a BadParameter that says the form if it is not that."""
    name, equals, value = text.partition("=")
    if not (name and equals):
        raise typer.BadParameter(f"{text!r} is not {form}", param_hint=option)
    return name.strip(), value.strip()


def _given(**details: str | None) -> Details:
    return cast("Details", {name: each for name, each in details.items() if each})


def _words_of(found: TracesRead) -> str:
    lines = [
        f"{value:.6g} {found.unit}; the motion begins at {trace.lag_s:.3f} s"
        + ("" if trace.match is None else f" ({'after rest, ' if trace.after_rest else ''}match {trace.match:.2f})")
        for value, trace in zip(found.values, found.traces, strict=True)
    ]
    return "\n".join([*lines, *(f"doubtful: {each}" for each in found.doubts)])


def _print_request(found: RequestRead, *, as_json: bool) -> None:
    print_result(found, *_request_words(found), as_json=as_json)
    if not as_json:
        _print_safety(found)


def _nothing(client: Client, experiment: str | None, bench: str | None, *, all_: bool) -> str:
    """Return why a list of requests is empty, and what would be listed."""
    place = "" if bench is None else f" on the bench {bench!r}"
    if bench is not None:
        asked = {each.bench for each in client.bench.history(experiment)}
        if bench not in asked:
            names = f"; benches with requests: {', '.join(sorted(asked))}" if asked else ""
            return f"Nothing was asked for{place}{names}."
    if all_:
        return f"Nothing was asked for{place} yet."
    command = f"gaplab requests {experiment or ''}".rstrip()
    return f"Nothing is to be measured{place}; `{command} --all` lists what was."


def _consequences(found: Consequences, *, dry_run: bool) -> Answer:
    return Answer(found, f"{'It would be done' if dry_run else 'Done'}: {found.words}.")


def _numbers(values: Iterable[str] | None) -> list[float] | None:
    """Return measured values as numbers; None if there are none.

    Raises:
        typer.BadParameter: a value is not a finite number; its place is counted from 1.
    """
    found = list[float]()
    for place, text in enumerate(map(str.strip, values or ()), start=1):
        if (number := finite(text)) is None:
            raise typer.BadParameter(f"value {place}: {text!r} is not a finite number, like 0.41", param_hint="VALUE")
        found.append(number)
    return found or None


def _request_table(items: Sequence[RequestRead], *, with_answers: bool) -> Table:
    """Return a table of requests, perhaps with the measurements that answer each."""
    columns = ("request", "experiment", "repetition", "iteration", "repeats", "bench", "state")
    rows = map(_row, items)
    if not with_answers:
        return table(columns, rows)
    answers = ("\n".join(escape(_answer_words(each, item.unit)) for each in item.answers) for item in items)
    return table((*columns, "measurements"), ((*row, cell) for row, cell in zip(rows, answers, strict=True)))


def _request_words(found: RequestRead) -> Iterator[str]:
    """Yield what a request asks for, a line each, and its answers."""
    place = f"{found.kind.value} of iteration {found.iteration}, repetition {found.repetition}"
    yield f"{found.id} is {found.state.value}: {place} of {found.experiment_name} ({found.experiment})"
    yield f"  repeats: {found.repeats}, fitness in {found.unit}"
    yield f"  genome: {json.dumps(found.genome)}"
    yield from (f"  {_answer_words(answer, found.unit)}" for answer in found.answers)


def _answer_words(answer: AnswerRead, unit: str) -> str:
    """Return an answer with its id and its state: the values, or why there are none."""
    if answer.values is None:
        return f"{answer.id} {answer.state.value}: failed, by {answer.operator}: {answer.failed}"
    values = ", ".join(f"{value:.6g}" for value in answer.values)
    return f"{answer.id} {answer.state.value}: {values} {unit} by {answer.operator}"


def _stored_words(answer: AnswerRead) -> str:
    """Return a sentence about an answer that the service has stored, and how a conflict is decided."""
    stored = f"Measurement {answer.id} is stored: {answer.state.value}."
    if answer.state is not AnswerState.CONFLICT:
        return stored
    decision = f"`gaplab decide {answer.id} this --reason WHY`, or `other` in place of `this`"
    return f"{stored} It came late or second, so a person decides which one counts: {decision}"


def _print_safety(found: RequestRead) -> None:
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


@app.command(rich_help_panel=BENCH)
def drive(  # noqa: PLR0913, PLR0917 - each is an option of the command
    id: ExperimentId,
    driver: Annotated[Path, typer.Option(help="Python file with the class Driver: connect, run, stop")],
    journal: Annotated[Path | None, typer.Option(help="file that keeps answers until the service has them")] = None,
    limit_s: Annotated[float | None, typer.Option("--limit-s", min=0.001, help="longest time of one run, s")] = None,
    lease_s: Annotated[
        float, typer.Option("--lease-s", min=1, help="seconds without a heartbeat before others may take over")
    ] = 60.0,
    within_limits: Annotated[
        bool, typer.Option("--within-limits", help="end before a controller that is expected to exceed a limit")
    ] = False,
    url: Url = None,
) -> None:
    """Measure what an experiment asks for with a driver, until the experiment has ended."""
    _stop_at_signals()
    kept = journal or driver.with_name(f"{driver.stem}-{id}.journal")
    try:
        robot = Robot(load(driver))
        with connect(url) as client:
            client.experiment(id)
            robot.connect()
            try:
                for task in client.requests(id, lease_s=lease_s, journal=kept):
                    _announce(task.request, within_limits=within_limits)
                    measure(task, robot, limit_s, lambda sentence: echo(f"  {sentence}"))
            finally:
                robot.stop()
    except DriverBroken as error:
        raise CommandError(str(error), Exit.FAILED) from error
    echo("The experiment has ended.")


def _stop_at_signals() -> None:
    """Stop in order also if the terminal closes or the machine shuts down; a signal that a shell ignores stays so."""
    for each in (signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT):
        if signal.getsignal(each) is not signal.SIG_IGN:
            signal.signal(each, signal.default_int_handler)


def _announce(request: RequestRead, *, within_limits: bool) -> None:
    """Print what is to be measured, with warnings about its safety.

    Raises:
        CommandError: the motion is expected to exceed a limit of the robot, and `within_limits` is set.
    """
    place = f"repetition {request.repetition}, iteration {request.iteration}, {request.kind.value}"
    echo(f"{request.id}: {place}")
    _print_safety(request)
    if within_limits and request.safety and request.safety.beyond:
        msg = f"request {request.id} is beyond its limits, so it was not measured; without --within-limits it is"
        raise CommandError(msg, Exit.CONFLICT)
