"""The command that compares experiments."""

from collections.abc import Callable
from enum import StrEnum
from math import inf, nan
from typing import Annotated

import typer
from rich.markup import escape

from gaplab.api.clients.comparisons import Comparisons
from gaplab.api.clients.screen import console
from gaplab.api.commands import tables
from gaplab.api.commands.app import RESULTS, AsJson, Ids, Url, app, connect
from gaplab.api.commands.json_output import echo, print_json
from gaplab.schemas.results import Fitness
from gaplab.services.findings.tables import comparison


class Format(StrEnum):
    """Formats of a comparison."""

    TABLE = "table"
    CSV = "csv"
    JSON = "json"
    LATEX = "latex"


MarginOption = Annotated[
    str | None,
    typer.Option(
        metavar="NUMBER|SHARE%",
        help="test whether pairs differ by less than this: in the unit of fitness, or in % of the direct baseline",
        show_default=False,
    ),
]


@app.command(rich_help_panel=RESULTS)
def compare(  # noqa: PLR0913, PLR0917 - each is an option of the command
    ids: Ids,
    at: Annotated[
        str | None,
        typer.Option(
            metavar="N|FROM-TO",
            help="number of real-world evaluations, or a range, over which each repetition is its mean; left out: the "
            "last number of all",
            show_default=False,
        ),
    ] = None,
    margin: MarginOption = None,
    fitness: Annotated[
        Fitness, typer.Option(help="recorded as in the paper, transferred controllers alone, or the best of these")
    ] = Fitness.RECORDED,
    format: Annotated[Format, typer.Option(help="format of the output")] = Format.TABLE,  # noqa: A002 - as the API says
    as_json: AsJson = False,
    url: Url = None,
) -> None:
    """Compare every pair of experiments: tests of means, ranks and spreads, intervals, and equivalence.

    Each p is shown before and after Holm's correction over all pairs.
    """
    first, last = _range(at)
    width, share = margins(margin)
    with connect(url) as client:
        pairs = client.compare(ids, first, last, margin=width, margin_of_direct=share, fitness=fitness)
        _PRINTERS[Format.JSON if as_json else format](pairs)


def _range(text: str | None) -> tuple[int | None, int | None]:
    if text is None:
        return None, None
    first, _, last = text.partition("-")
    try:
        return int(first), int(last or first)
    except ValueError:
        msg = f"{text!r} is not a number of real-world evaluations, like 5, and not a range, like 3-10"
        raise typer.BadParameter(msg, param_hint="--at") from None


def margins(text: str | None) -> tuple[float | None, float | None]:
    """Return a margin like "0.03" in the unit of fitness, or one like "3%" as a share of the direct baseline."""
    if text is None:
        return None, None
    try:
        number = float(text.removesuffix("%"))
    except ValueError:
        number = nan
    if not 0 < number < inf:
        msg = f"{text!r} is not a margin above 0, like 0.03 in the unit of fitness or 3% of the direct baseline"
        raise typer.BadParameter(msg, param_hint="--margin")
    return (None, number / 100) if text.endswith("%") else (number, None)


def _print_tables(pairs: Comparisons) -> None:
    screen = console()
    for warning in dict.fromkeys(warning for pair in pairs for warning in pair.warnings):
        screen.print(f"! {escape(warning)}\n")
    for grid in comparison(pairs):
        screen.print(*tables.shown(grid))
    for pair in pairs:
        if pair.caution:
            screen.print(f"! {escape(f'{pair.first_name} - {pair.second_name}: {pair.caution}')}\n")


_PRINTERS: dict[Format, Callable[[Comparisons], None]] = {
    Format.TABLE: _print_tables,
    Format.CSV: lambda pairs: echo(pairs.csv(), nl=False),
    Format.JSON: print_json,
    Format.LATEX: lambda pairs: echo(pairs.latex(), nl=False),
}
