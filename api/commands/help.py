"""Help on topics other than single commands."""

from typing import Annotated, Literal

import typer

from gaplab.api.commands.app import OTHERS, AsJson, app
from gaplab.api.commands.exit_codes import Exit
from gaplab.api.commands.json_output import print_json


@app.command("help", rich_help_panel=OTHERS)
def help_(
    context: typer.Context,
    topic: Annotated[
        Literal["exit-codes"] | None, typer.Argument(help="left out: the commands", show_default=False)
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Explain the exit codes, or list the commands."""
    if as_json:
        print_json({str(code.value): {"name": code.name, "meaning": code.meaning} for code in Exit})
    elif topic:
        typer.echo("\n".join(f"{code.value:>4}  {code.meaning}" for code in Exit))
    else:
        assert context.parent is not None
        typer.echo(context.parent.get_help())
