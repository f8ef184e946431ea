"""The command that compares experiments."""

from collections.abc import Callable
from enum import StrEnum
from typing import Annotated

import typer

from gaplab.api.clients.comparisons import Comparisons
from gaplab.api.clients.progress.text import console
from gaplab.api.commands import tables
from gaplab.api.commands.app import RESULTS, AsJson, Ids, Url, app, connect
from gaplab.api.commands.json_output import print_json


class Format(StrEnum):
    """Formats of a comparison."""

    TABLE = "table"
    CSV = "csv"
    JSON = "json"
    LATEX = "latex"


@app.command(rich_help_panel=RESULTS)
def compare(
    ids: Ids,
    at: Annotated[
        str | None,
        typer.Option(
            metavar="N|FROM-TO",
            help="number of real-world evaluations, or a range to pool; left out: the last number of all",
            show_default=False,
        ),
    ] = None,
    format: Annotated[Format, typer.Option(help="of the output")] = Format.TABLE,  # noqa: A002 - as the API says
    as_json: AsJson = False,
    url: Url = None,
) -> None:
    """Compare every pair of experiments by Student's, Welch's and Mann-Whitney's tests, with Holm's correction."""
    first, last = _range(at)
    with connect(url) as client:
        pairs = client.compare(ids, first, last)
        _PRINTERS[Format.JSON if as_json else format](pairs)


def _range(text: str | None) -> tuple[int | None, int | None]:
    """Return the first and the last number of a range like "3-10" or "5"."""
    if text is None:
        return None, None
    first, _, last = text.partition("-")
    try:
        return int(first), int(last or first)
    except ValueError:
        msg = f"{text!r} is no number of real-world evaluations, like 5, and no range, like 3-10"
        raise typer.BadParameter(msg, param_hint="--at") from None


def _print_table(pairs: Comparisons) -> None:
    console().print(*tables.comparisons(pairs))


_PRINTERS: dict[Format, Callable[[Comparisons], None]] = {
    Format.TABLE: _print_table,
    Format.CSV: lambda pairs: typer.echo(pairs.csv(), nl=False),
    Format.JSON: print_json,
    Format.LATEX: lambda pairs: typer.echo(pairs.latex(), nl=False),
}
