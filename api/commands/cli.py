"""The `gaplab` command: it runs the service, and sends requests to a running one."""

import sys
from collections.abc import Sequence
from typing import Annotated, Literal

import typer

from gaplab.api.clients.errors import ServiceError, lines_of

# the order of the commands in `gaplab --help`, and of its groups
# isort: off
from gaplab.api.commands import service, submission, studies, tune, results, tuned  # noqa: F401
from gaplab.api.commands import bench, archives, plugins, robots, pools, tokens  # noqa: F401

# isort: on
from gaplab.api.commands.app import OTHERS, Answer, AsJson, command
from gaplab.api.commands.app import app as app
from gaplab.api.commands.exit_codes import TOLD, Exit, code_of
from gaplab.api.commands.json_output import echo
from gaplab.services.plugins.threads import leave_threads


@command(OTHERS, "help")
def help_(
    context: typer.Context,
    topic: Annotated[Literal["exit-codes"] | None, typer.Argument(help="left out: the commands")] = None,
    as_json: AsJson = False,
) -> Answer | None:
    """Explain the exit codes, or list the commands."""
    if topic or as_json:
        codes = {str(code.value): {"name": code.name, "meaning": code.meaning} for code in Exit}
        return Answer(codes, *(f"{code.value:>4}  {code.meaning}" for code in Exit))
    assert context.parent is not None
    typer.echo(context.parent.get_help())
    return None


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command, by default with the process's arguments; an error is a sentence and an exit code."""
    if arguments is None:
        leave_threads()
    try:
        app(arguments, prog_name="gaplab")
    except TOLD as error:
        for line in _lines(error):
            printable = line.encode("utf-8", "backslashreplace").decode()  # names of files need not be Unicode
            echo(f"gaplab: {printable}", err=True)
        sys.exit(code_of(error))


def _lines(error: Exception) -> list[str]:
    if isinstance(error, ServiceError):
        return lines_of(error.problem)
    return [f"{error.filename}: {error.strerror}" if isinstance(error, OSError) and error.filename else str(error)]


if __name__ == "__main__":
    main()
