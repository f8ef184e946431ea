"""The command that lists plug-ins."""

from typing import Annotated

import typer

from gaplab.api.clients.progress.text import console
from gaplab.api.commands import completion, tables
from gaplab.api.commands.app import PLUGINS, AsJson, Url, app, connect
from gaplab.api.commands.exit_codes import CommandError, Exit
from gaplab.api.commands.json_output import print_json
from gaplab.services.core.errors import unknown_name


@app.command(rich_help_panel=PLUGINS)
def catalogue(
    name: Annotated[
        str | None,
        typer.Argument(metavar="[NAME]", help="a plug-in, to show its options", autocompletion=completion.plugins),
    ] = None,
    as_json: AsJson = False,
    url: Url = None,
) -> None:
    """List the plug-ins of each kind, or show one plug-in."""
    with connect(url) as client:
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
