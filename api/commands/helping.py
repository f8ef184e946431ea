"""Help on what is no command."""

from enum import StrEnum
from typing import Annotated

import typer

from gaplab.api.commands.base import AsJson, app
from gaplab.api.commands.exit_codes import MEANINGS
from gaplab.api.commands.json_output import document


class Topic(StrEnum):
    """What there is help on beside the commands."""

    EXIT_CODES = "exit-codes"


@app.command("help")
def help_(
    context: typer.Context,
    topic: Annotated[Topic | None, typer.Argument(help="left out: the commands", show_default=False)] = None,
    as_json: AsJson = False,
) -> None:
    """Explain the exit codes, or list the commands."""
    if topic is None and not as_json:
        assert context.parent is not None
        typer.echo(context.parent.get_help())
    elif as_json:
        document({str(code.value): {"name": code.name, "meaning": meaning} for code, meaning in MEANINGS.items()})
    else:
        for code, meaning in MEANINGS.items():
            typer.echo(f"{code.value:>4}  {meaning}")
