"""The command itself, and what its parts have in common."""

from collections.abc import Iterable
from typing import Annotated

import typer

from gaplab.api.clients.client import Client
from gaplab.api.commands import completion
from gaplab.api.commands.exit_codes import EXPLAINED
from gaplab.schemas.records import ExperimentRead, StudyRead
from gaplab.services.settings import Settings

app = typer.Typer(
    help="Closes the reality gap: tunes a robot simulator from a handful of real-world evaluations.",
    epilog=EXPLAINED,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)

Id = Annotated[str, typer.Argument(metavar="ID", help="of a study or an experiment", autocompletion=completion.ids)]
ExperimentId = Annotated[
    str, typer.Argument(metavar="ID", help="of an experiment", autocompletion=completion.experiments)
]
Ids = Annotated[
    list[str], typer.Argument(metavar="ID...", help="of studies or experiments", autocompletion=completion.ids)
]
AsJson = Annotated[bool, typer.Option("--json", help="print one JSON document, for programs")]
Url = Annotated[
    str | None,
    typer.Option("--url", help="where the service is; left out: GAPLAB_URL, or this machine", show_default=False),
]


def connect(url: str | None) -> Client:
    """A client of the service there."""
    settings = Settings.from_environment()
    return Client(url or settings.url, token=settings.token)


def experiments_of(found: ExperimentRead | StudyRead) -> tuple[ExperimentRead, ...]:
    """The experiments of a study, or the experiment itself."""
    return found.experiments if isinstance(found, StudyRead) else (found,)


def print_warnings(found: Iterable[ExperimentRead]) -> None:
    """What is remarkable about their specs, on standard error."""
    for warning in sorted({warning for each in found for warning in each.warnings}):
        typer.echo(f"warning: {warning}", err=True)
