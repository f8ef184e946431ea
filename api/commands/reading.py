"""Look at what there is."""

from collections.abc import Iterator
from itertools import islice, takewhile
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from gaplab.api.clients import display
from gaplab.api.clients.client import Client
from gaplab.api.commands import completion
from gaplab.api.commands.base import AsJson, Id, Ids, Url, app, connect, experiments_of, print_warnings
from gaplab.api.commands.exit_codes import CommandError, Exit
from gaplab.api.commands.history import print_provenance
from gaplab.api.commands.json_output import document
from gaplab.api.commands.spec_files import read_spec
from gaplab.schemas.lifecycle import State
from gaplab.schemas.misfit import MisfitRead
from gaplab.schemas.plugin import Catalogue
from gaplab.schemas.records import ExperimentRead, StudyRead
from gaplab.services.core.errors import unknown_name

PAGE = 100
"""Experiments that are asked for at once."""


@app.command("list")
def list_(
    experiments: Annotated[bool, typer.Option("--experiments", help="experiments in place of studies")] = False,
    limit: Annotated[int, typer.Option(min=1, max=500)] = 20,
    as_json: AsJson = False,
    url: Url = None,
) -> None:
    """List the newest studies, and the experiments that belong to none."""
    with connect(url) as client:
        newest = client.experiments(limit=limit).items if experiments else _newest(client, limit)
    if as_json:
        document(newest)
        return
    display.console().print(display.overview(newest) if newest else "Nothing yet; `gaplab submit` starts something.")


@app.command()
def show(id: Id, as_json: AsJson = False, url: Url = None) -> None:
    """Show a study's experiments, or an experiment's repetitions."""
    console = display.console()
    with connect(url) as client:
        found = client.find(id)
        if as_json:
            document(_all_of(client, found))
            return
        console.print(display.overview([found]))
        console.print(display.numbers(found.progress))
        if isinstance(found, StudyRead):
            console.print(display.overview(found.experiments))
        else:
            console.print(display.repetitions(client.repetitions(id)))
            print_provenance(client.provenance(id), console)
            _print_misfit(client.misfit(id), console)
            console.print_json(data=found.spec)
        print_warnings(experiments_of(found))


@app.command()
def curve(
    ids: Ids,
    csv: Annotated[bool, typer.Option("--csv", help="print comma-separated values")] = False,
    svg: Annotated[Path | None, typer.Option(help="draw into this file")] = None,
    html: Annotated[Path | None, typer.Option(help="draw into this file")] = None,
    as_json: AsJson = False,
    url: Url = None,
) -> None:
    """Print curves: recorded fitness, mean ± SD, by number of real-world evaluations; or draw them."""
    with connect(url) as client:
        if as_json:
            document(client.curves(ids))
        elif csv:
            typer.echo(client.curves_csv(ids), nl=False)
        for format, path in (("svg", svg), ("html", html)):  # noqa: A001 - as the API says
            if path:
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_bytes(client.figure(*ids).content(format))
                typer.echo(f"Wrote {path}.", err=as_json or csv)
        if not (as_json or csv or svg or html):
            found = client.curves(ids)
            display.console().print(display.curves(found), *display.baselines(found))


@app.command()
def sensitivity(
    spec: Annotated[str, typer.Argument(metavar="SPEC", help="a JSON file, or - to read standard input")],
    as_json: AsJson = False,
    url: Url = None,
) -> None:
    """Check what the tunables of a spec do: whether they change fitness, how much, and how smoothly."""
    with connect(url) as client:
        found = client.check(read_spec(spec))
    if as_json:
        document(found)
    if found.state is not State.COMPLETED:
        msg = f"the check {found.id} ended as {found.state}: {found.reason}"
        raise CommandError(msg, Exit.FAILED)
    if as_json:
        return
    console = display.console()
    console.print(display.sensitivity(found))
    for each in found.warnings:
        console.print(each, markup=False)


@app.command()
def catalogue(
    name: Annotated[
        str | None,
        typer.Argument(metavar="[NAME]", help="of a plug-in, for all about it", autocompletion=completion.plugins),
    ] = None,
    as_json: AsJson = False,
    url: Url = None,
) -> None:
    """List the strategies, robots, engines, tunables and optimizers; or say all about one."""
    with connect(url) as client:
        found = client.catalogue()
    if name is not None:
        _print_plugin(found, name, as_json=as_json)
    elif as_json:
        document(found)
    else:
        display.console().print(*display.catalogue(found))


def _newest(client: Client, limit: int) -> list[ExperimentRead | StudyRead]:
    """Studies, and the experiments of no study that are as new; however many of studies lie between those."""
    studies = client.studies(limit=limit).items
    full = len(studies) == limit
    as_new = takewhile(lambda each: not full or each.created_at >= studies[-1].created_at, _experiments(client))
    alone = islice((each for each in as_new if each.study is None), limit)
    return sorted([*studies, *alone], key=lambda each: each.created_at, reverse=True)[:limit]


def _experiments(client: Client) -> Iterator[ExperimentRead]:
    """All of them, the newest first, page after page."""
    page = client.experiments(limit=PAGE)
    yield from page.items
    while page.next is not None:
        page = client.experiments(limit=PAGE, cursor=page.next)
        yield from page.items


def _print_plugin(found: Catalogue, name: str, *, as_json: bool) -> None:
    plugins = {each.name: each for kind in completion.KINDS for each in getattr(found, kind)}
    if name not in plugins:
        raise CommandError(unknown_name("", "plug-in", name, list(plugins)).message, Exit.NOT_FOUND)
    if as_json:
        document(plugins[name])
    else:
        display.console().print(*display.plugin(plugins[name]), soft_wrap=True)


def _all_of(client: Client, found: ExperimentRead | StudyRead) -> dict[str, object]:
    """What `show` shows, for programs."""
    if isinstance(found, StudyRead):
        return {"study": found}
    return {
        "experiment": found,
        "repetitions": client.repetitions(found.id),
        "provenance": client.provenance(found.id),
        "misfit": client.misfit(found.id),
    }


def _print_misfit(found: MisfitRead, console: Console) -> None:
    if found.remarks:
        console.print(display.tuned(found), *found.remarks, sep="\n", markup=False)
