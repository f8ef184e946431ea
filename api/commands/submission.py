"""Commands that submit a spec, and those that show what becomes of it."""

import json
import sys
from collections.abc import Mapping
from pathlib import Path
from shlex import quote
from typing import Annotated, Any, NoReturn

import typer
from rich.markup import escape

from gaplab.api.clients.client import Client
from gaplab.api.clients.confirmation import confirm, sentence
from gaplab.api.clients.errors import format_of
from gaplab.api.clients.figures import FORMATS
from gaplab.api.clients.progress import state_text
from gaplab.api.clients.screen import console
from gaplab.api.commands import completion, tables
from gaplab.api.commands.app import SPECS, AsJson, Id, Yes, command, print_warnings
from gaplab.api.commands.exit_codes import CommandError, Exit
from gaplab.api.commands.json_output import echo, print_json, print_result
from gaplab.api.commands.questions import keyboard
from gaplab.schemas.estimates import EstimateRead
from gaplab.schemas.events import EventKind, EventRead
from gaplab.schemas.lifecycle import State
from gaplab.schemas.records import StudyRead
from gaplab.services.findings.tables import sensitivity as effects

SpecFile = Annotated[str, typer.Argument(metavar="SPEC", help="a JSON file, or - for standard input")]


@command(SPECS)
def run(
    spec: Annotated[
        str,
        typer.Argument(metavar="SPEC", help="a JSON file, or - for standard input; an archive or a database goes on"),
    ],
    out: Annotated[
        list[Path] | None,
        typer.Option("--out", "-o", help=f"file: an archive (.zip) or a figure ({', '.join(FORMATS)}); repeatable"),
    ] = None,
    workers: Annotated[int | None, typer.Option(min=1, help="processes; left out: one for each core")] = None,
    as_json: AsJson = False,
) -> None:
    """Compute a study here, without a service: the numbers are the same. Print its curves and the verdict."""
    from gaplab.api.library import running  # computes here

    archives = [file for file in out or [] if format_of(file, (*FORMATS, "zip")) == "zip"]
    given = read_spec(spec) if spec == "-" else spec
    try:
        result = running.run(given, workers=workers, progress=True)
    except running.Interrupted as stopped:
        kept = [stopped.result.save(file) for file in archives] or [stopped.result.path]
        msg = f"interrupted; what is complete is in {kept[0]}, and `gaplab run {quote(str(kept[0]))}` goes on"
        raise CommandError(msg, Exit.INTERRUPTED) from None
    for file in out or []:
        result.save(file) if file in archives else result.figure().save(file)
    curves = result.client.curves(result.id)
    if not as_json:
        console().print(tables.curves(curves), *tables.baselines(curves), *result.verdict.sentences)
    _print_end(result.study, as_json=as_json)


@command(SPECS)
def submit(
    client: Client,
    spec: SpecFile,
    watch: Annotated[bool, typer.Option("--watch", help="show the progress until it ends")] = False,
    yes: Yes = False,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="print the complete spec and the estimated cost; submit nothing")
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Submit a study; a spec that names one strategy is that of a single experiment.

    The estimated cost is shown first, on standard error. Above an hour, a person at a terminal is asked.
    """
    content = read_spec(spec)
    if dry_run:
        _print_estimate(client.estimate(content), as_json=as_json)
        return
    record = submit_confirmed(client, content, yes=yes)
    if not (as_json and watch):
        print_result(record, record.id, as_json=as_json)
    if watch:
        _watch(client, record.id, as_json=as_json)


def submit_confirmed(client: Client, spec: Mapping[str, Any], *, yes: bool) -> StudyRead:
    """Show the estimated cost of a spec, ask a person at a terminal if it is long, and submit it.

    Raises:
        NotSubmitted: the person declined.
    """
    with keyboard() as ask:
        agreed = confirm(client.estimate(spec), None if yes else ask)
    return client.send(spec, confirm_cost=yes or agreed)


def _print_estimate(estimate: EstimateRead, *, as_json: bool) -> None:
    if as_json:
        print_json(estimate)
        return
    print_json(estimate.specs[0] if len(estimate.specs) == 1 else estimate.specs)
    echo(f"{sentence(estimate)}. Nothing was submitted.", err=True)


@command(SPECS)
def watch(
    client: Client,
    id: Id,
    every: Annotated[float, typer.Option(min=0.1, max=3600, help="seconds between requests")] = 1.0,
    patience: Annotated[float, typer.Option(min=0, help="longest time in seconds without a service")] = 600.0,
    as_json: AsJson = False,
) -> None:
    """Watch a study until it ends: live curves and repetitions in a terminal, lines in a log."""
    _watch(client, id, as_json=as_json, curves=True, every_s=every, patience_s=patience)


@command(SPECS)
def sensitivity(client: Client, spec: SpecFile, as_json: AsJson = False) -> None:
    """Check the tunables of a spec: whether they change fitness, how much, and how smoothly."""
    check = client.check(read_spec(spec))
    if as_json or check.state is State.COMPLETED:
        print_result(check, *tables.shown(effects(check, check.spec.robot.name)), *check.warnings, as_json=as_json)
    if check.state is not State.COMPLETED:
        raise CommandError(f"the check {check.id} ended as {check.state}: {check.reason}", Exit.FAILED)


def _watch(client: Client, id: str, *, as_json: bool, **options: Any) -> None:  # noqa: ANN401 - those of `show`
    """Show the progress until the end, then the result; exit with an error if an experiment did not complete."""
    try:
        record = client.show(id, console(stderr=as_json), **options)
    except KeyboardInterrupt:
        msg = f"the service continues with it; `gaplab watch {id}` shows the progress again"
        raise CommandError(msg, Exit.INTERRUPTED) from None
    _print_end(record, as_json=as_json)


def _print_end(record: StudyRead, *, as_json: bool) -> None:
    """Print how a study ended; exit with an error if an experiment did not complete."""
    print_result(record, f"{record.name}: {state_text(record)}; {record.progress.text}.", as_json=as_json)
    for reason in sorted({reason for experiment in record.experiments for reason in experiment.reasons}):
        echo(f"  {reason}", err=True)
    print_warnings(record)
    if any(each.state is not State.COMPLETED for each in record.experiments):
        raise typer.Exit(Exit.FAILED)


def read_spec(name: str) -> dict[str, Any]:
    """Return the spec in a JSON file, or in standard input if the name is "-".

    Raises:
        CommandError: the file cannot be read, or does not hold a JSON object.
    """
    try:
        text = sys.stdin.read() if name == "-" else Path(name).read_text("utf-8")
        spec = json.loads(text, parse_constant=_refuse)
    except OSError as error:
        raise CommandError(f"{name}: {error.strerror or error}", Exit.FILE) from error
    except (ValueError, RecursionError) as error:
        raise CommandError(f"{name} is not JSON: {error}", Exit.FILE) from error
    if not isinstance(spec, dict):
        raise CommandError(f'{name} is not a JSON object; write one, like {{"strategy": "simulated_fit"}}', Exit.FILE)
    return spec


def _refuse(constant: str) -> NoReturn:
    raise ValueError(f"JSON has no {constant}; use a number or null")


@command(SPECS)
def events(
    client: Client,
    id: Annotated[
        str | None, typer.Argument(metavar="[ID]", help="a study or an experiment", autocompletion=completion.ids)
    ] = None,
    follow: Annotated[bool, typer.Option("--follow", help="continue forever with new events")] = False,
    kind: Annotated[list[EventKind] | None, typer.Option(help="only this kind; repeatable")] = None,
    after: Annotated[int, typer.Option(min=0, help="number of the last event that is already known")] = 0,
    as_json: Annotated[
        bool, typer.Option("--json", help="print one JSON document; with --follow, one on each line")
    ] = False,
) -> None:
    """Print the events of a study, or of the whole service, one on each line."""
    found = client.events(follow=follow, study=id, kind=[each.value for each in kind or []], after=after)
    if as_json and not follow:
        print_json(found)
        return
    screen = console()
    for event in found:
        if as_json:
            print_json(event, line=True)
        else:
            screen.print(_line(event), soft_wrap=True)


def _line(event: EventRead) -> str:
    when = event.at.astimezone().strftime("%Y-%m-%d %H:%M:%S")
    return f"{event.number:>7} {when} {event.experiment} {escape(event.sentence)}"
