"""The `gaplab` command: it runs the service, and talks to one that runs."""

import sys

import typer

from gaplab.api.clients import display
from gaplab.api.clients.client import ServiceError, ServiceUnreachable
from gaplab.api.commands import (
    drawing,
    editing,
    helping,
    history,
    keeping,
    life_cycle,
    reading,
    service,
    submitting,
    tokens,
    watching,
)
from gaplab.api.commands.base import app
from gaplab.api.commands.exit_codes import CommandError, Exit, code_of
from gaplab.services.core.errors import GaplabError, NotFound

__all__ = [
    "app",
    "drawing",
    "editing",
    "helping",
    "history",
    "keeping",
    "life_cycle",
    "main",
    "reading",
    "service",
    "submitting",
    "tokens",
    "watching",
]


def main() -> None:
    """Run the command; what goes wrong is a sentence and an exit code, never a traceback."""
    try:
        app(prog_name="gaplab")
    except ServiceError as error:
        _leave(display.problem(error.problem), code_of(error))
    except (ServiceUnreachable, CommandError) as error:
        _leave([str(error)], code_of(error))
    except NotFound as error:
        _leave([str(error)], Exit.NOT_FOUND)
    except (GaplabError, ValueError) as error:
        _leave([str(error)], Exit.FAILED)
    except OSError as error:
        _leave([f"{error.filename}: {error.strerror}" if error.filename else str(error)], Exit.FILE)


def _leave(lines: list[str], code: Exit) -> None:
    for line in lines:
        printable = line.encode("utf-8", "backslashreplace").decode()  # names of files need not be Unicode
        typer.echo(f"gaplab: {printable}", err=True)
    sys.exit(code)


if __name__ == "__main__":
    main()
