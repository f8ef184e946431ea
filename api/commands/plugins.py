"""Commands that list plug-ins, and those for their authors."""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer
from rich.markup import escape

from gaplab.api.clients.client import Client
from gaplab.api.clients.screen import console
from gaplab.api.commands import completion, tables
from gaplab.api.commands.app import PLUGINS, Answer, AsJson, app, command
from gaplab.api.commands.exit_codes import CommandError, Exit
from gaplab.api.commands.json_output import print_json
from gaplab.services.core.errors import unknown_name


@command(PLUGINS)
def catalogue(
    client: Client,
    name: Annotated[
        str | None,
        typer.Argument(metavar="[NAME]", help="a plug-in, to show its options", autocompletion=completion.plugins),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """List the plug-ins of each kind, or show one plug-in."""
    found = client.catalogue()
    plugins = {plugin.name: plugin for kind in completion.KINDS for plugin in getattr(found, kind)}
    if name is not None and name not in plugins:
        raise CommandError(unknown_name("", "plug-in", name, list(plugins)).message, Exit.NOT_FOUND)
    if as_json:
        print_json(found if name is None else plugins[name])
    elif name is None:
        console().print(*tables.catalogue(found), *tables.ignored(found), soft_wrap=True)
    else:
        console().print(*tables.plugin(plugins[name]), sep="\n", soft_wrap=True)


if TYPE_CHECKING:
    from gaplab.services.contract.checks import CheckedPlugin

Kind = Literal[
    "strategy", "robot", "controller", "task", "engine", "tunable", "optimizer", "discrepancy", "tuner", "driver"
]

plugin = typer.Typer(help="Write your own plug-ins, and check them.", no_args_is_help=True)
app.add_typer(plugin, name="plugin", rich_help_panel=PLUGINS)


@command(of=plugin)
def new(
    kind: Annotated[Kind, typer.Argument(help="kind of the plug-in")],
    name: Annotated[str, typer.Argument(metavar="NAME", help="name in specs, and of the file")],
    folder: Annotated[
        Path | None,
        typer.Option(
            help="folder of the file; left out: the first of GAPLAB_PLUGINS, or plugins; of a driver, this one"
        ),
    ] = None,
) -> Answer:
    """Write a plug-in, or a driver for a robot on a bench, that runs, to change into your own."""
    from gaplab.services.contract.checks import write_skeleton
    from gaplab.services.plugins import folders

    folders.load()
    if kind == "driver":
        file = write_skeleton(kind, name, folder or Path())
        return Answer({"file": str(file)}, f"Wrote {file}. Use it: gaplab drive EXPERIMENT --driver {file}")
    named = folders.named()
    file = write_skeleton(kind, name, folder or (named[0] if named else Path("plugins")))
    is_found = file.absolute().parent in named
    start = "" if is_found else f"\nLet the service find it: export GAPLAB_PLUGINS={file.absolute().parent}"
    return Answer({"file": str(file)}, f"Wrote {file}. Check it: gaplab plugin check {file}{start}")


@command(of=plugin)
def check(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="a Python file, or the folder of a package")],
    as_json: AsJson = False,
) -> None:
    """Check whether the plug-ins in a file keep the contract of their kind."""
    from gaplab.services.contract.checks import check_file
    from gaplab.services.plugins import folders

    found = list(check_file(file, folders.named()))
    if as_json:
        print_json(found)
    else:
        console().print(*(line for each in found for line in _lines(each)), sep="\n", soft_wrap=True)
    if not all(each.passes for each in found):
        raise typer.Exit(Exit.FAILED)


def _lines(found: "CheckedPlugin") -> Iterator[str]:
    yield f"[bold]{found.kind} {escape(found.name)}[/]"
    if found.unusable:
        yield f"  [bold red]unusable[/]: {escape(found.unusable)}"
    for result in found.results:
        if result.reason is None:
            yield f"  [green]ok[/]     {escape(result.promise)}"
        else:
            yield f"  [bold red]FAILED[/] {escape(result.promise)}: {escape(result.reason)}"
