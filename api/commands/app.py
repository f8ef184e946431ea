"""The `gaplab` command, and the arguments that its parts share."""

from importlib.metadata import version
from typing import Annotated, Any

import typer
from pydantic import ValidationError
from typer.core import TyperGroup

from gaplab.api.clients.client import Client
from gaplab.api.commands import completion
from gaplab.api.commands.exit_codes import Exit
from gaplab.api.commands.json_output import echo
from gaplab.schemas.mistakes import sentence
from gaplab.schemas.records import StudyRead


class Commands(TyperGroup):
    """The commands. A wrong argument is refused in the words of the service: what is permitted, and what was given."""

    def invoke(self, ctx: Any) -> Any:  # noqa: ANN401 - in a private module of Typer
        """Parse the arguments of a command, and run it."""
        try:
            return super().invoke(ctx)
        except typer.BadParameter as error:
            if isinstance(error.__cause__, ValidationError):
                error.message = sentence(dict(error.__cause__.errors()[0]), ())
            raise


app = typer.Typer(
    cls=Commands,
    help="Close the reality gap: tune a robot simulator from a few real-world evaluations.",
    epilog=f"Exit codes: {'; '.join(f'{code.value} {code.meaning}' for code in Exit)}.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)

RUNNING = "Run the service"
SPECS = "Submit and follow"
LIFE = "Change what runs"
BENCH = "Measure a robot on a bench"
RESULTS = "Read results"
KEEPING = "Keep and move"
PLUGINS = "Plug-ins"
OTHERS = "Access and help"
"""The groups of `gaplab --help`; commands are in them in the order of use."""

Id = Annotated[str, typer.Argument(metavar="ID", help="a study, or one experiment", autocompletion=completion.ids)]
ExperimentId = Annotated[str, typer.Argument(metavar="ID", help="an experiment", autocompletion=completion.experiments)]
Ids = Annotated[list[str], typer.Argument(metavar="ID", help="studies or experiments", autocompletion=completion.ids)]
AsJson = Annotated[bool, typer.Option("--json", help="print one JSON document, for programs")]
Url = Annotated[
    str | None,
    typer.Option("--url", help="address of the service; left out: GAPLAB_URL, or this machine", show_default=False),
]


def _print_version(asked: bool) -> None:
    if asked:
        echo(f"gaplab {version('gaplab')}")
        raise typer.Exit


@app.callback()
def options(
    version: Annotated[
        bool, typer.Option("--version", help="print the version of gaplab", is_eager=True, callback=_print_version)
    ] = False,
) -> None:
    """Close the reality gap: tune a robot simulator from a few real-world evaluations."""


def connect(url: str | None) -> Client:
    """Return a client of the service at this address."""
    return Client(url or None)


def print_warnings(study: StudyRead) -> None:
    """Print the warnings of experiments on standard error."""
    for warning in sorted({warning for experiment in study.experiments for warning in experiment.warnings}):
        echo(f"warning: {warning}", err=True)
