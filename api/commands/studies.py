"""Commands that list, show, edit and keep studies, change their state or size, and those of saved views."""

from typing import Annotated

import typer
from pydantic import ValidationError
from rich.markup import escape

from gaplab.api.clients.client import Client
from gaplab.api.clients.progress import state_text
from gaplab.api.clients.screen import console
from gaplab.api.commands import tables
from gaplab.api.commands.app import (
    KEEPING,
    LIFE,
    RESULTS,
    SPECS,
    Answer,
    AsJson,
    Id,
    Url,
    app,
    command,
    connect,
    print_warnings,
)
from gaplab.api.commands.exit_codes import CommandError, Exit
from gaplab.api.commands.json_output import echo, print_json, print_result
from gaplab.api.commands.questions import demand_yes
from gaplab.schemas.editing import Edit, Order, ViewRead
from gaplab.schemas.misfit import TunableVerdict
from gaplab.schemas.mistakes import sentence
from gaplab.schemas.provenance import ProvenanceUse
from gaplab.schemas.records import StudyRead
from gaplab.services.findings.tables import tuned


@command(RESULTS, "list")
def list_(
    client: Client,
    query: Annotated[
        str | None, typer.Option("--query", "-q", help="like 'tag = gait and fitness > 0.5', or words")
    ] = None,
    view: Annotated[str | None, typer.Option(help="saved view to list")] = None,
    limit: Annotated[int, typer.Option(min=1, max=500)] = 20,
) -> Answer:
    """List the newest studies, or those that fit a query or a saved view."""
    saved = client.view(view) if view else None
    given = [each for each in (saved.query if saved else None, query) if each]
    wanted = f"({given[0]}) and ({query})" if len(given) > 1 else next(iter(given), None)
    found = client.studies(query=wanted, sort=saved.sort if saved else "-created_at", limit=limit).items
    nothing = "Nothing fits." if view or query else "Nothing yet; `gaplab submit` starts something."
    return Answer(found, tables.overview(found) if found else nothing)


@command(RESULTS)
def show(
    client: Client,
    id: Id,
    with_spec: Annotated[bool, typer.Option("--spec", help="also print the complete spec of an experiment")] = False,
    as_json: AsJson = False,
) -> None:
    """Show the experiments of a study, or the repetitions of a single one."""
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


@command(SPECS)
def spec(
    client: Client,
    id: Id,
    resolved: Annotated[
        bool, typer.Option("--resolved", help="every field, as stored; a list if there are several experiments")
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Print a spec that gives the same study again, for `gaplab submit`."""
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


@command(LIFE)
def edit(
    client: Client,
    id: Id,
    name: Annotated[str | None, typer.Option(help="new name")] = None,
    notes: Annotated[str | None, typer.Option(help="new notes; empty removes them")] = None,
) -> Answer:
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
    study = client.edit(id, checked)
    return Answer(study, f"{study.id}: {study.name}{f' ({study.notes})' if study.notes else ''}")


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


@command(KEEPING)
def tag(
    client: Client,
    id: Id,
    tags: Annotated[list[str], typer.Argument(metavar="TAG", help="tags, like gait")],
    remove: Annotated[bool, typer.Option("--remove", help="remove the tags")] = False,
) -> Answer:
    """Add tags to a study, or remove them."""
    study = client.untag(id, *tags) if remove else client.tag(id, *tags)
    return Answer(study, f"{study.id}: {study.name} [{', '.join(study.tags)}]")


@command(KEEPING)
def archive(client: Client, id: Id) -> Answer:
    """Leave a study that has ended out of lists; everything else stays."""
    study = client.archive(id)
    return Answer(study, f"{study.name} is archived; `gaplab unarchive {study.id}` undoes it.")


@command(KEEPING)
def unarchive(client: Client, id: Id) -> Answer:
    """List an archived study again."""
    study = client.unarchive(id)
    return Answer(study, f"{study.name} is listed again.")


@command(KEEPING)
def delete(
    client: Client,
    id: Id,
    yes: Annotated[bool, typer.Option("--yes", "-y", help="do not ask; needed without a terminal")] = False,
) -> Answer:
    """Delete a study that has ended, or one experiment of it, for good; `gaplab export` saves it first."""
    if not yes:
        study = client.study(id)
        within = f" in {len(study.experiments)} experiments" if len(study.experiments) > 1 else ""
        demand_yes(f"{study.name!r} with {study.progress.repetitions} repetitions{within}")
    deleted = client.delete(id)
    return Answer(deleted, f"{deleted.name} ({deleted.id}) is deleted.")


@command(KEEPING)
def notify(
    client: Client,
    id: Id,
    webhook: Annotated[str | None, typer.Argument(metavar="URL", help="address to tell; left out: none")] = None,
) -> Answer:
    """Tell a webhook when a study has ended; GAPLAB_NOTIFY_URL of the service tells of all."""
    told = client.notify(id, webhook)
    return Answer(told, f"{told.host} is told when {id} has ended." if told.host else "None is told.")


ViewName = Annotated[str, typer.Argument(metavar="NAME", help="name of the view")]

views = typer.Typer(
    help="List, save and delete saved views: queries that all users share. Without a command: list.",
    no_args_is_help=False,
    subcommand_metavar="[COMMAND] [ARGS]...",
)
app.add_typer(views, name="views", rich_help_panel=RESULTS)


@views.callback(invoke_without_command=True)
def list_views(context: typer.Context, as_json: AsJson = False, url: Url = None) -> None:
    """List the saved views; `gaplab list --view NAME` shows what one lists."""
    if context.invoked_subcommand:
        return
    with connect(url) as client:
        found = client.views()
    rows = [(escape(view.name), escape(view.query or "all"), view.sort) for view in found]
    nothing = "No views yet; `gaplab views save NAME --query Q` saves one."
    print_result(found, tables.table(("name", "query", "sort"), rows) if found else nothing, as_json=as_json)


@command(of=views)
def save(
    client: Client,
    name: ViewName,
    query: Annotated[str | None, typer.Option(help="query; left out: all")] = None,
    sort: Annotated[Order, typer.Option(help="field to sort by; a minus reverses the order")] = "-created_at",
) -> Answer:
    """Save a query as a view, in place of the view with this name."""
    return _told(client.save_view(name, query, sort=sort), "is saved")


@command(name="delete", of=views)
def delete_view(client: Client, name: ViewName) -> Answer:
    """Delete a saved view; nothing that it lists is touched."""
    return _told(client.delete_view(name), "is deleted")


def _told(view: ViewRead, done: str) -> Answer:
    return Answer(view, f"The view {view.name!r} {done}: {view.query or 'all'}")


_VERBS = {
    "pause": "Pause a study once its current steps end, and free its cores.",
    "resume": "Continue a paused study.",
    "stop": "Complete a study with its results so far, once its current steps end.",
    "cancel": "Cancel the experiments of a study that have not ended; stored results are kept.",
    "retry": "Queue the FAILED repetitions of a study once more; they go on from their stored steps.",
}


def _add(verb: str, told: str) -> None:
    def ask(client: Client, id: Id) -> Answer:
        return _state(getattr(client, verb)(id))

    ask.__doc__ = told
    command(LIFE, verb)(ask)


for _verb, _sentence in _VERBS.items():
    _add(_verb, _sentence)

Total = typer.Option(min=1, help="new total; left out: unchanged")


@command(LIFE)
def extend(
    client: Client,
    id: Id,
    iterations: Annotated[int | None, Total] = None,
    repetitions: Annotated[int | None, Total] = None,
    yes: Annotated[bool, typer.Option("--yes", "-y", help="extend it whatever it costs")] = False,
) -> Answer:
    """Add iterations or repetitions to the completed experiments of a study; results are kept."""
    return _state(client.extend(id, iterations=iterations, repetitions=repetitions, yes=yes))


@command(LIFE, "accept-versions")
def accept_versions(client: Client, id: Id) -> Answer:
    """Let a study continue under other versions of engines or plug-ins than it started with."""
    study = client.accept_versions(id)
    return Answer(study, f"{study.id} continues under the versions of the next supervisor.")


def _state(study: StudyRead) -> Answer:
    return Answer(study, f"{study.name} is {state_text(study)}.")
