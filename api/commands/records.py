"""Commands that list, show and edit studies and experiments."""

from collections.abc import Sequence
from operator import attrgetter
from typing import Annotated

import typer
from pydantic import ValidationError
from rich.markup import escape

from gaplab.api.clients.client import Client
from gaplab.api.clients.progress.text import best, console, counts
from gaplab.api.clients.records import Record
from gaplab.api.commands import tables
from gaplab.api.commands.app import LIFE, RESULTS, SPECS, AsJson, Id, Url, app, connect, print_warnings
from gaplab.api.commands.exit_codes import CommandError, Exit
from gaplab.api.commands.json_output import echo, print_json, print_result
from gaplab.schemas.editing import Edit
from gaplab.schemas.misfit import TunableVerdict
from gaplab.schemas.mistakes import sentence
from gaplab.schemas.provenance import ProvenanceUse
from gaplab.schemas.records import ExperimentRead, StudyRead


@app.command("list", rich_help_panel=RESULTS)
def list_(
    experiments: Annotated[bool, typer.Option("--experiments", help="experiments instead of studies")] = False,
    query: Annotated[
        str | None,
        typer.Option("--query", "-q", help="like 'tag = gait and fitness > 0.5', or words", show_default=False),
    ] = None,
    view: Annotated[str | None, typer.Option(help="saved view to list", show_default=False)] = None,
    limit: Annotated[int, typer.Option(min=1, max=500)] = 20,
    as_json: AsJson = False,
    url: Url = None,
) -> None:
    """List the newest studies, and the experiments without a study; or what fits a query or a saved view."""
    if view and experiments:
        raise typer.BadParameter("a saved view says what it lists; leave it out", param_hint="--experiments")
    with connect(url) as client:
        newest = _of_view(client, view, query, limit) if view else _newest(client, query, limit, alone=experiments)
    nothing = "Nothing fits." if view or query else "Nothing yet; `gaplab submit` starts something."
    print_result(newest, tables.overview(newest) if newest else nothing, as_json=as_json)


@app.command(rich_help_panel=RESULTS)
def show(
    id: Id,
    with_spec: Annotated[bool, typer.Option("--spec", help="also print the complete spec of an experiment")] = False,
    as_json: AsJson = False,
    url: Url = None,
) -> None:
    """Show the experiments of a study, or the repetitions of an experiment."""
    with connect(url) as client:
        record = client.find(id)
        if isinstance(record, StudyRead):
            if with_spec:
                msg = f"{id} is a study; `gaplab spec {id} --resolved` prints the specs of its experiments"
                raise typer.BadParameter(msg, param_hint="--spec")
            _show_study(record, as_json=as_json)
        else:
            _show_experiment(client, record, as_json=as_json, with_spec=with_spec)


@app.command(rich_help_panel=SPECS)
def spec(
    id: Id,
    resolved: Annotated[
        bool, typer.Option("--resolved", help="every field, as stored; for a study, a list of its experiments")
    ] = False,
    as_json: AsJson = False,
    url: Url = None,
) -> None:
    """Print a spec that gives the same study or experiment again, for `gaplab submit`."""
    with connect(url) as client:
        record, found = client.find(id), client.spec(id)
    complete = found.resolved if isinstance(record, StudyRead) else found.resolved[0]
    for remark in found.remarks:
        echo(f"note: {remark}", err=True)
    if as_json:
        print_json(found)
    elif resolved or found.spec is not None:
        print_json(complete if resolved else found.spec)
    else:
        raise CommandError(f"no single spec gives {record.name}; --resolved prints those of its experiments")


@app.command(rich_help_panel=LIFE)
def edit(
    id: Id,
    name: Annotated[str | None, typer.Option(help="new name", show_default=False)] = None,
    notes: Annotated[str | None, typer.Option(help="new notes; empty removes them", show_default=False)] = None,
    as_json: AsJson = False,
    url: Url = None,
) -> None:
    """Change the name or the notes of a study or an experiment."""
    if name is None and notes is None:
        raise CommandError("nothing to change: give --name or --notes; `gaplab tag` changes tags", Exit.INVALID)
    changes: dict[str, str | None] = {} if name is None else {"name": name}
    if notes is not None:
        changes["notes"] = notes or None
    try:
        checked = Edit.model_validate(changes)
    except ValidationError as error:
        msg = "; ".join(f"{'--' if wrong['loc'] else ''}{sentence(wrong)}" for wrong in error.errors())
        raise CommandError(msg, Exit.INVALID) from error
    with connect(url) as client:
        record = client.edit(id, checked)
    notes_shown = f" ({record.notes})" if record.notes else ""
    print_result(record, f"{record.id}: {record.name}{notes_shown}", as_json=as_json)


def _show_study(study: StudyRead, *, as_json: bool) -> None:
    if as_json:
        print_json({"study": study})
        return
    parts = (tables.overview([study]), counts(study.progress), *map(escape, best(study)))
    console().print(*parts, tables.overview(study.experiments), sep="\n")
    print_warnings(study)


def _show_experiment(client: Client, experiment: ExperimentRead, *, as_json: bool, with_spec: bool) -> None:
    repetitions, misfit = client.repetitions(experiment.id), client.misfit(experiment.id)
    provenance = client.provenance(experiment.id)
    if as_json:
        document = {"experiment": experiment, "repetitions": repetitions, "provenance": provenance, "misfit": misfit}
        print_json(document)
        return
    screen = console()
    shown = (counts(experiment.progress), tables.repetitions(repetitions, experiment))
    screen.print(tables.overview([experiment]), *shown, sep="\n")
    for use in provenance.uses:
        screen.print(f"computed with {_software(use)}", markup=False, soft_wrap=True)
    if misfit.remarks:
        screen.print(tables.tuned(misfit), *misfit.remarks, *map(_verdict, misfit.verdicts), sep="\n", markup=False)
    if with_spec:
        screen.print_json(data=experiment.spec)
    print_warnings(experiment)


def _verdict(found: TunableVerdict) -> str:
    return f"{found.sentence}; would help: {'; '.join(found.helps)}" if found.helps else found.sentence


def _software(use: ProvenanceUse) -> str:
    found = use.provenance
    commit = f", commit {found.commit[:8]}{' and changes' if found.dirty else ''}" if found.commit else ""
    engines = ", ".join(f"{name} ({library})" for name, library in found.engines.items())
    return f"gaplab {found.gaplab}{commit}, Python {found.python}, {engines}; {found.processor}, {found.system}"


def _newest(
    client: Client, query: str | None, limit: int, *, alone: bool = False, sort: str = "-created_at"
) -> Sequence[Record]:
    """Return experiments, or studies with the experiments without a study, that fit a query: the first of an order."""
    if alone:
        return client.experiments(query=query, sort=sort, limit=limit).items
    studies = client.studies(query=query, sort=sort, limit=limit).items
    without = client.experiments(query=query, alone="true", sort=sort, limit=limit).items
    records: list[Record] = [*studies, *without]
    return sorted(records, key=attrgetter(sort.removeprefix("-")), reverse=sort.startswith("-"))[:limit]


def _of_view(client: Client, name: str, query: str | None, limit: int) -> Sequence[Record]:
    """Return what a saved view lists, as far as it fits a further query."""
    view = client.keeping.view(name)
    wanted = f"({view.query}) and ({query})" if view.query and query else query or view.query
    if view.shows == "studies":
        return client.studies(query=wanted, sort=view.sort, limit=limit).items
    return _newest(client, wanted, limit, alone=view.shows == "experiments", sort=view.sort)
