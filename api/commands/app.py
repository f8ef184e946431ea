"""The `gaplab` command: how a function becomes a part of it, and the arguments that its parts share."""

import inspect
from collections.abc import Callable, Iterable
from contextlib import ExitStack
from functools import wraps
from importlib.metadata import version
from typing import Annotated, Any, TypeVar

import typer
from pydantic import ValidationError
from rich.console import RenderableType
from typer.core import TyperCommand, TyperGroup

from gaplab.api.clients.client import Client
from gaplab.api.commands import completion
from gaplab.api.commands.exit_codes import Exit
from gaplab.api.commands.json_output import echo, print_result
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
Yes = Annotated[bool, typer.Option("--yes", "-y", help="do not ask, whatever it costs")]
AsJson = Annotated[bool, typer.Option("--json", help="print one JSON document, for programs")]
Url = Annotated[str | None, typer.Option("--url", help="address of the service; left out: GAPLAB_URL, or this machine")]


class Answer:
    """What a command prints: a value with `--json`, else the lines and tables that show it; notes in any case.

    Args:
        value: what the API answers, or JSON.
        shown: texts and tables for people.
        notes: lines on standard error.
    """

    def __init__(self, value: object, *shown: RenderableType, notes: Iterable[str] = ()) -> None:
        self.value, self.shown, self.notes = value, shown, notes


Function = TypeVar("Function", bound=Callable[..., Answer | None])

_KEYWORD = inspect.Parameter.KEYWORD_ONLY
_AS_JSON = inspect.Parameter("as_json", _KEYWORD, default=False, annotation=AsJson)
_URL = inspect.Parameter("url", _KEYWORD, default=None, annotation=Url)


def command(
    panel: str | None = None, name: str | None = None, *, of: typer.Typer = app, cls: type[TyperCommand] | None = None
) -> Callable[[Function], Function]:
    """Return what makes a function a command: it gets the option `--json`, and prints the Answer that is returned.

    If the function has a parameter `client`, the command also gets `--url`, and the client of the service there.

    Args:
        panel: group of `gaplab --help`; left out: none.
        name: name of the command; left out: that of the function.
        of: the command that it is a part of.
        cls: class of the command.
    """

    def add(function: Function) -> Function:
        own = dict(inspect.signature(function).parameters)
        asks, says_json = own.pop("client", None) is not None, "as_json" in own

        @wraps(function)
        def run(url: str | None = None, as_json: bool = False, **given: Any) -> None:  # noqa: ANN401 - of any command
            with ExitStack() as connected:
                if asks:
                    given["client"] = connected.enter_context(connect(url))
                answer = function(**given, **({"as_json": as_json} if says_json else {}))
            if answer:
                print_result(answer.value, *answer.shown, as_json=as_json)
                for note in answer.notes:
                    echo(note, err=True)

        every = [*own.values(), *([] if says_json else [_AS_JSON]), *([_URL] if asks else [])]
        run.__signature__ = inspect.Signature([each.replace(kind=_KEYWORD) for each in every])  # type: ignore[attr-defined]
        of.command(name, cls=cls, rich_help_panel=panel)(run)
        return function

    return add


def connect(url: str | None) -> Client:
    """Return a client of the service at this address."""
    return Client(url or None)


def print_warnings(study: StudyRead) -> None:
    """Print the warnings of experiments on standard error."""
    for warning in sorted({warning for experiment in study.experiments for warning in experiment.warnings}):
        echo(f"warning: {warning}", err=True)


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
