"""Commands that list, show and edit studies."""

from typing import Annotated

import typer
from pydantic import ValidationError

from gaplab.api.clients.client import Client
from gaplab.api.clients.screen import console
from gaplab.api.commands import tables
from gaplab.api.commands.app import LIFE, RESULTS, SPECS, AsJson, Id, Url, app, connect, print_warnings
from gaplab.api.commands.exit_codes import CommandError, Exit
from gaplab.api.commands.json_output import echo, print_json, print_result
from gaplab.schemas.keeping import Edit
from gaplab.schemas.mistakes import sentence
from gaplab.schemas.provenance import ProvenanceUse
from gaplab.schemas.records import StudyRead
from gaplab.schemas.results import TunableVerdict
from gaplab.services.findings.tables import tuned


@app.command("list", rich_help_panel=RESULTS)
def list_(
    query: Annotated[
        str | None,
        typer.Option("--query", "-q", help="like 'tag = gait and fitness > 0.5', or words", show_default=False),
    ] = None,
    view: Annotated[str | None, typer.Option(help="saved view to list", show_default=False)] = None,
    limit: Annotated[int, typer.Option(min=1, max=500)] = 20,
    as_json: AsJson = False,
    url: Url = None,
) -> None:
    """List the newest studies, or those that fit a query or a saved view."""
    with connect(url) as client:
        saved = client.keeping.view(view) if view else None
        given = [each for each in (saved.query if saved else None, query) if each]
        wanted = f"({given[0]}) and ({query})" if len(given) > 1 else next(iter(given), None)
        found = client.studies(query=wanted, sort=saved.sort if saved else "-created_at", limit=limit).items
    nothing = "Nothing fits." if view or query else "Nothing yet; `gaplab submit` starts something."
    print_result(found, tables.overview(found) if found else nothing, as_json=as_json)


@app.command(rich_help_panel=RESULTS)
def show(
    id: Id,
    with_spec: Annotated[bool, typer.Option("--spec", help="also print the complete spec of an experiment")] = False,
    as_json: AsJson = False,
    url: Url = None,
) -> None:
    """Show the experiments of a study, or the repetitions of a single one."""
    with connect(url) as client:
        study = client.study(id)
        if len(study.experiments) == 1:
            _show_one(client, study, as_json=as_json, with_spec=with_spec)
            return
    if with_spec:
        msg = f"{id} has several experiments; `gaplab spec {id} --resolved` prints their specs"
        raise typer.BadParameter(msg, param_hint="--spec")
    if as_json:
        print_json({"study": study})
        return
    parts = (tables.overview([study]), study.progress.text, *tables.best(study))
    console().print(*parts, tables.overview(study.experiments), sep="\n")
    print_warnings(study)


@app.command(rich_help_panel=SPECS)
def spec(
    id: Id,
    resolved: Annotated[
        bool, typer.Option("--resolved", help="every field, as stored; a list if there are several experiments")
    ] = False,
    as_json: AsJson = False,
    url: Url = None,
) -> None:
    """Print a spec that gives the same study again, for `gaplab submit`."""
    with connect(url) as client:
        found = client.spec(id)
    complete = found.resolved if len(found.resolved) > 1 else found.resolved[0]
    for remark in found.remarks:
        echo(f"note: {remark}", err=True)
    if as_json:
        print_json(found)
    elif resolved or found.spec is not None:
        print_json(complete if resolved else found.spec)
    else:
        raise CommandError(f"no single spec gives {id}; --resolved prints those of its experiments")


@app.command(rich_help_panel=LIFE)
def edit(
    id: Id,
    name: Annotated[str | None, typer.Option(help="new name", show_default=False)] = None,
    notes: Annotated[str | None, typer.Option(help="new notes; empty removes them", show_default=False)] = None,
    as_json: AsJson = False,
    url: Url = None,
) -> None:
    """Change the name or the notes of a study, or the name of one experiment of it."""
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
        study = client.edit(id, checked)
    notes_shown = f" ({study.notes})" if study.notes else ""
    print_result(study, f"{study.id}: {study.name}{notes_shown}", as_json=as_json)


def _show_one(client: Client, study: StudyRead, *, as_json: bool, with_spec: bool) -> None:
    (experiment,) = study.experiments
    repetitions, misfit = client.repetitions(experiment), client.misfit(experiment)
    provenance = client.provenance(experiment)
    if as_json:
        print_json({"study": study, "repetitions": repetitions, "provenance": provenance, "misfit": misfit})
        return
    screen = console()
    shown = (experiment.progress.text, tables.repetitions(repetitions, experiment))
    screen.print(tables.overview([study]), *shown, sep="\n")
    for use in provenance.uses:
        screen.print(f"computed with {_software(use)}", markup=False, soft_wrap=True)
    if misfit.remarks:
        told = (*misfit.remarks, *map(_verdict, misfit.verdicts))
        screen.print(*tables.shown(tuned([(experiment.name, misfit.points[-1])])), *told, sep="\n", markup=False)
    if with_spec:
        screen.print_json(data=experiment.spec)
    print_warnings(study)


def _verdict(found: TunableVerdict) -> str:
    return f"{found.sentence}; would help: {'; '.join(found.helps)}" if found.helps else found.sentence


def _software(use: ProvenanceUse) -> str:
    found = use.provenance
    commit = f", commit {found.commit[:8]}{' and changes' if found.dirty else ''}" if found.commit else ""
    engines = ", ".join(f"{name} ({library})" for name, library in found.engines.items())
    return f"gaplab {found.gaplab}{commit}, Python {found.python}, {engines}; {found.processor}, {found.system}"
