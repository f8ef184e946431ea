"""Commands that tag, archive and delete studies, and those of saved views."""

from typing import Annotated

import typer
from rich.markup import escape

from gaplab.api.commands.app import KEEPING, RESULTS, AsJson, Id, Url, app, connect
from gaplab.api.commands.json_output import print_result
from gaplab.api.commands.questions import demand_yes
from gaplab.api.commands.tables import table
from gaplab.schemas.keeping import Order, ViewRead
from gaplab.schemas.records import StudyRead

ViewName = Annotated[str, typer.Argument(metavar="NAME", help="name of the view")]

views = typer.Typer(
    help="List, save and delete saved views: queries that all users share. Without a command: list.",
    no_args_is_help=False,
    subcommand_metavar="[COMMAND] [ARGS]...",
)
app.add_typer(views, name="views", rich_help_panel=RESULTS)


@app.command(rich_help_panel=KEEPING)
def tag(
    id: Id,
    tags: Annotated[list[str], typer.Argument(metavar="TAG", help="tags, like gait")],
    remove: Annotated[bool, typer.Option("--remove", help="remove the tags")] = False,
    as_json: AsJson = False,
    url: Url = None,
) -> None:
    """Add tags to a study, or remove them."""
    with connect(url) as client:
        record = client.untag(id, *tags) if remove else client.tag(id, *tags)
    print_result(record, f"{record.id}: {record.name} [{', '.join(record.tags)}]", as_json=as_json)


@app.command(rich_help_panel=KEEPING)
def archive(id: Id, as_json: AsJson = False, url: Url = None) -> None:
    """Leave a study that has ended out of lists; everything else stays."""
    with connect(url) as client:
        record = client.archive(id)
    text = f"{record.name} is archived; `gaplab unarchive {record.id}` undoes it."
    print_result(record, text, as_json=as_json)


@app.command(rich_help_panel=KEEPING)
def unarchive(id: Id, as_json: AsJson = False, url: Url = None) -> None:
    """List an archived study again."""
    with connect(url) as client:
        record = client.unarchive(id)
    print_result(record, f"{record.name} is listed again.", as_json=as_json)


@app.command(rich_help_panel=KEEPING)
def delete(
    id: Id,
    yes: Annotated[bool, typer.Option("--yes", "-y", help="do not ask; needed without a terminal")] = False,
    as_json: AsJson = False,
    url: Url = None,
) -> None:
    """Delete a study that has ended, or one experiment of it, for good; `gaplab export` saves it first."""
    with connect(url) as client:
        if not yes:
            demand_yes(_size(client.study(id)))
        deleted = client.delete(id)
    print_result(deleted, f"{deleted.name} ({deleted.id}) is deleted.", as_json=as_json)


@app.command(rich_help_panel=KEEPING)
def notify(
    id: Id,
    webhook: Annotated[
        str | None, typer.Argument(metavar="URL", help="address to tell; left out: none", show_default=False)
    ] = None,
    as_json: AsJson = False,
    url: Url = None,
) -> None:
    """Tell a webhook when a study has ended; GAPLAB_NOTIFY_URL of the service tells of all."""
    with connect(url) as client:
        told = client.notify(id, webhook)
    print_result(told, f"{told.host} is told when {id} has ended." if told.host else "None is told.", as_json=as_json)


@views.callback(invoke_without_command=True)
def list_views(context: typer.Context, as_json: AsJson = False, url: Url = None) -> None:
    """List the saved views; `gaplab list --view NAME` shows what one lists."""
    if context.invoked_subcommand:
        return
    with connect(url) as client:
        found = client.views()
    rows = [(escape(view.name), escape(view.query or "all"), view.sort) for view in found]
    columns = ("name", "query", "sort")
    shown = table(columns, rows) if found else "No views yet; `gaplab views save NAME --query Q` saves one."
    print_result(found, shown, as_json=as_json)


@views.command()
def save(
    name: ViewName,
    query: Annotated[str | None, typer.Option(help="query; left out: all", show_default=False)] = None,
    sort: Annotated[Order, typer.Option(help="field to sort by; a minus reverses the order")] = "-created_at",
    as_json: AsJson = False,
    url: Url = None,
) -> None:
    """Save a query as a view, in place of the view with this name."""
    with connect(url) as client:
        view = client.save_view(name, query, sort=sort)
    print_result(view, _sentence(view, "is saved"), as_json=as_json)


@views.command("delete")
def delete_view(name: ViewName, as_json: AsJson = False, url: Url = None) -> None:
    """Delete a saved view; nothing that it lists is touched."""
    with connect(url) as client:
        view = client.delete_view(name)
    print_result(view, _sentence(view, "is deleted"), as_json=as_json)


def _sentence(view: ViewRead, done: str) -> str:
    return f"The view {view.name!r} {done}: {view.query or 'all'}"


def _size(study: StudyRead) -> str:
    within = f" in {len(study.experiments)} experiments" if len(study.experiments) > 1 else ""
    return f"{study.name!r} with {study.progress.repetitions} repetitions{within}"
