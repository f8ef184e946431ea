"""Commands that list, show and edit studies and experiments."""

from itertools import islice, takewhile
from typing import Annotated

import typer
from pydantic import ValidationError

from gaplab.api.clients.client import Client
from gaplab.api.clients.progress.text import console, counts
from gaplab.api.clients.records import Record
from gaplab.api.commands import tables
from gaplab.api.commands.app import LIFE, RESULTS, SPECS, AsJson, Id, Url, app, connect, print_warnings
from gaplab.api.commands.exit_codes import CommandError, Exit
from gaplab.api.commands.json_output import print_json, print_result
from gaplab.schemas.editing import Edit
from gaplab.schemas.mistakes import sentence
from gaplab.schemas.provenance import ProvenanceUse
from gaplab.schemas.records import ExperimentRead, StudyRead


@app.command("list", rich_help_panel=RESULTS)
def list_(
    experiments: Annotated[bool, typer.Option("--experiments", help="experiments instead of studies")] = False,
    limit: Annotated[int, typer.Option(min=1, max=500)] = 20,
    as_json: AsJson = False,
    url: Url = None,
) -> None:
    """List the newest studies, and the experiments without a study."""
    with connect(url) as client:
        newest = client.experiments(limit=limit).items if experiments else _newest(client, limit)
    if as_json:
        print_json(newest)
    else:
        console().print(tables.overview(newest) if newest else "Nothing yet; `gaplab submit` starts something.")


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
        typer.echo(f"note: {remark}", err=True)
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
    console().print(tables.overview([study]), counts(study.progress), tables.overview(study.experiments), sep="\n")
    print_warnings(study)


def _show_experiment(client: Client, experiment: ExperimentRead, *, as_json: bool, with_spec: bool) -> None:
    repetitions, misfit = client.repetitions(experiment.id), client.misfit(experiment.id)
    provenance = client.provenance(experiment.id)
    if as_json:
        shown = {"experiment": experiment, "repetitions": repetitions, "provenance": provenance, "misfit": misfit}
        print_json(shown)
        return
    screen = console()
    screen.print(tables.overview([experiment]), counts(experiment.progress), tables.repetitions(repetitions), sep="\n")
    for use in provenance.uses:
        screen.print(f"computed with {_software(use)}", markup=False, soft_wrap=True)
    if misfit.remarks:
        screen.print(tables.tuned(misfit), *misfit.remarks, sep="\n", markup=False)
    if with_spec:
        screen.print_json(data=experiment.spec)
    print_warnings(experiment)


def _software(use: ProvenanceUse) -> str:
    """Return the versions that computed a part of an experiment."""
    found = use.provenance
    commit = f", commit {found.commit[:8]}{' and changes' if found.dirty else ''}" if found.commit else ""
    engines = ", ".join(f"{name} ({library})" for name, library in found.engines.items())
    return f"gaplab {found.gaplab}{commit}, Python {found.python}, {engines}; {found.processor}, {found.system}"


def _newest(client: Client, limit: int) -> list[Record]:
    """Return the newest studies, and the experiments without a study that are as new."""
    studies = client.studies(limit=limit).items
    oldest = studies[-1].created_at if len(studies) == limit else None
    as_new = takewhile(lambda each: oldest is None or each.created_at >= oldest, client.records.all_experiments())
    alone = islice((experiment for experiment in as_new if experiment.study is None), limit)
    newest: list[Record] = [*studies, *alone]
    return sorted(newest, key=lambda record: record.created_at, reverse=True)[:limit]
