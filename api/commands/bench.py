"""Commands for a robot on a bench: what to measure, answers by hand, and corrections."""

import re
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Any, Literal, cast

import typer
from typer.core import TyperCommand

from gaplab.api.clients.bench import Details
from gaplab.api.clients.client import Client
from gaplab.api.clients.errors import if_found
from gaplab.api.commands.app import BENCH, AsJson, Url, app, connect
from gaplab.api.commands.exit_codes import CommandError, Exit
from gaplab.api.commands.json_output import echo, print_result
from gaplab.api.commands.questions import confirmed
from gaplab.api.commands.request_words import print_safety, request_table, request_words, stored_words
from gaplab.schemas.measurements import Consequences, RequestRead
from gaplab.schemas.traces import TracesRead
from gaplab.services.csv_tables import finite

RequestId = Annotated[str, typer.Argument(metavar="REQUEST", help="a request, as `gaplab requests` lists it")]
AnswerId = Annotated[str, typer.Argument(metavar="MEASUREMENT", help="a measurement, as `gaplab requests ID` lists it")]
_VALUES = typer.Argument(metavar="VALUE", help="fitness of each repeat", show_default=False)
Numbers = Annotated[list[str] | None, _VALUES]
Failed = Annotated[str | None, typer.Option("--failed", help="why there are no values", show_default=False)]
Reason = Annotated[str, typer.Option("--reason", help="reason, which is stored")]
Operator = Annotated[str | None, typer.Option("--operator", help="person who measured", show_default=False)]
By = Annotated[str | None, typer.Option("--operator", help="person who decides", show_default=False)]
Yes = Annotated[bool, typer.Option("--yes", help="send the values without a question, even if they are unlikely")]
DryRun = Annotated[bool, typer.Option("--dry-run", help="only print what would follow; store nothing")]

_NEGATIVE = re.compile(r"-\.?\d")


class ValuesCommand(TyperCommand):
    """A command that takes -0.3 as a number; other commands take it as the option -0."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:  # noqa: ANN401 - in a private module of Typer
        """Parse arguments; a space before a negative number, which `float` ignores, says that it is not an option."""
        return super().parse_args(ctx, [f" {each}" if _NEGATIVE.match(each) else each for each in args])


@app.command(rich_help_panel=BENCH)
def requests(
    id: Annotated[
        str | None,
        typer.Argument(metavar="ID", help="an experiment, or a request to read whole", show_default=False),
    ] = None,
    bench: Annotated[
        str | None, typer.Option("--bench", help="only requests of this bench", show_default=False)
    ] = None,
    all_: Annotated[bool, typer.Option("--all", help="also requests that are measured, failed or withdrawn")] = False,
    as_json: AsJson = False,
    url: Url = None,
) -> None:
    """List the measurements that experiments wait for, or read one request with its answers."""
    with connect(url) as client:
        if id is not None:
            with if_found():
                _print_request(client.bench.request(id), as_json=as_json)
                return
        read = client.bench.history if all_ else client.bench.pending
        items = read(id, bench=bench)
        nothing = "" if items or as_json else _nothing(client, id, bench, all_=all_)
    print_result(items, nothing or request_table(items, with_answers=all_), as_json=as_json)


@app.command(rich_help_panel=BENCH)
def motion(
    id: RequestId,
    form: Annotated[Literal["csv", "json", "ros2"], typer.Option("--format", help="ros2: a JointTrajectory")] = "csv",
    as_json: AsJson = False,
    url: Url = None,
) -> None:
    """Print the motion that a request asks for."""
    with connect(url) as client:
        echo(client.bench.motion(id, "json" if as_json else form), nl=False)


@app.command("measured", cls=ValuesCommand, rich_help_panel=BENCH)
def measured(  # noqa: PLR0913, PLR0917 - each is an option of the command
    id: RequestId,
    values: Numbers = None,
    failed: Failed = None,
    note: Annotated[str | None, typer.Option("--note", show_default=False)] = None,
    operator: Operator = None,
    yes: Yes = False,
    as_json: AsJson = False,
    url: Url = None,
) -> None:
    """Answer a request by hand: with the fitness of each repeat, or --failed and why."""
    measured, details = _numbers(values), _given(failed=failed, note=note, operator=operator)
    with connect(url) as client:
        sure = yes or confirmed(client.bench.doubts(id, measured, **details))
        details["confirmed"] = sure
        found = client.bench.answer(id, measured, **details)
    print_result(found, stored_words(found), as_json=as_json)


@app.command("traces", rich_help_panel=BENCH)
def traces(  # noqa: PLR0913, PLR0917 - each is an option of the command
    id: RequestId,
    files: Annotated[list[Path], typer.Argument(help="recorded motion of the base, CSV or MCAP; one for each repeat")],
    topic: Annotated[
        str | None, typer.Option("--topic", help="topic of the base's pose in MCAP", show_default=False)
    ] = None,
    body: Annotated[
        str | None, typer.Option("--body", help="child_frame_id of the base, if it has several", show_default=False)
    ] = None,
    answer: Annotated[bool, typer.Option("--answer", help="answer the request with them")] = False,
    lag_s: Annotated[
        list[float] | None,
        typer.Option("--lag", help="when the motion began on the clock of each recording, s", show_default=False),
    ] = None,
    operator: Operator = None,
    yes: Yes = False,
    as_json: AsJson = False,
    url: Url = None,
) -> None:
    """Compute fitness and readings from recordings of a motion, and answer its request with --answer."""
    if operator and not answer:
        raise typer.BadParameter("it names who answers; add --answer", param_hint="--operator")
    with connect(url) as client:
        stored = [client.bench.attach_trace(file, topic, body).id for file in files]
        said = client.bench.traces(id, stored, lag_s)
        if not answer:
            print_result(said, _words_of(said), as_json=as_json)
            return
        if said.doubts and not yes and not confirmed(said.doubts):
            raise CommandError("nothing was sent; if the traces are right, add --yes", Exit.CONFLICT)
        details: Details = {"traces": stored, "lags_s": [each.lag_s for each in said.traces], "confirmed": True}
        found = client.bench.answer(id, **_given(operator=operator) | details)
    print_result(found, f"{_words_of(said)}\n{stored_words(found)}", as_json=as_json)


@app.command("correct", cls=ValuesCommand, rich_help_panel=BENCH)
def correct(  # noqa: PLR0913, PLR0917 - each is an option of the command
    id: AnswerId,
    reason: Reason,
    values: Numbers = None,
    failed: Failed = None,
    operator: By = None,
    dry_run: DryRun = False,
    as_json: AsJson = False,
    url: Url = None,
) -> None:
    """Replace the values of a measurement; what was computed from them is computed again."""
    right, details = _numbers(values), _given(failed=failed, operator=operator)
    with connect(url) as client:
        found = client.bench.correct(id, right, reason=reason, dry_run=dry_run, **details)
    _print_consequences(found, dry_run=dry_run, as_json=as_json)


@app.command("void", rich_help_panel=BENCH)
def void(
    id: AnswerId,
    reason: Reason,
    operator: By = None,
    dry_run: DryRun = False,
    as_json: AsJson = False,
    url: Url = None,
) -> None:
    """Declare a measurement invalid; its controller is requested again."""
    with connect(url) as client:
        found = client.bench.void(id, reason=reason, operator=operator, dry_run=dry_run)
    _print_consequences(found, dry_run=dry_run, as_json=as_json)


@app.command("decide", rich_help_panel=BENCH)
def decide(  # noqa: PLR0913, PLR0917 - each is an option of the command
    id: AnswerId,
    counts: Annotated[Literal["this", "other"], typer.Argument(help="which of the two measurements counts")],
    reason: Reason,
    operator: By = None,
    dry_run: DryRun = False,
    as_json: AsJson = False,
    url: Url = None,
) -> None:
    """Decide about a measurement in conflict: let it count in place of the other, or dismiss it."""
    with connect(url) as client:
        found = client.bench.decide(id, counts, reason=reason, operator=operator, dry_run=dry_run)
    _print_consequences(found, dry_run=dry_run, as_json=as_json)


@app.command("reopen", rich_help_panel=BENCH)
def reopen(
    id: RequestId,
    reason: Annotated[
        str | None, typer.Option(help="why the take of somebody else ends, like a dead phone", show_default=False)
    ] = None,
    operator: By = None,
    as_json: AsJson = False,
    url: Url = None,
) -> None:
    """Open a request again that was taken too often without an answer; with a reason, one that somebody has taken."""
    with connect(url) as client:
        found = client.bench.reopen(id, reason=reason, operator=operator)
    print_result(found, f"Request {found.id} is {found.state.value}.", as_json=as_json)


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
    print_result(found, *request_words(found), as_json=as_json)
    if not as_json:
        print_safety(found)


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


def _print_consequences(found: Consequences, *, dry_run: bool, as_json: bool) -> None:
    print_result(found, f"{'It would be done' if dry_run else 'Done'}: {found.words}.", as_json=as_json)


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
