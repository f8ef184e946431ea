"""Commands that print curves and draw figures."""

from pathlib import Path
from typing import Annotated

import typer

from gaplab.api.clients.errors import format_of
from gaplab.api.clients.figures import FORMATS
from gaplab.api.clients.screen import console
from gaplab.api.commands import completion, tables
from gaplab.api.commands.app import RESULTS, AsJson, Ids, Url, app, connect
from gaplab.api.commands.json_output import echo, print_json, print_result


@app.command(rich_help_panel=RESULTS)
def curve(
    ids: Ids,
    csv: Annotated[bool, typer.Option("--csv", help="print comma-separated values")] = False,
    as_json: AsJson = False,
    url: Url = None,
) -> None:
    """Print curves: recorded fitness, mean ± SD, by real-world evaluations. `gaplab figure curves ID` draws them."""
    if csv and as_json:
        raise typer.BadParameter("only one of --csv and --json can be printed", param_hint="--csv")
    with connect(url) as client:
        if csv:
            echo(client.curves_csv(ids), nl=False)
            return
        curves = client.curves(ids)
    if as_json:
        print_json(curves)
    else:
        console().print(tables.curves(curves), *tables.baselines(curves))


@app.command(rich_help_panel=RESULTS)
def figure(
    kind: Annotated[str, typer.Argument(metavar="KIND", help="kind, like curves", autocompletion=completion.figures)],
    ids: Ids,
    out: Annotated[
        list[Path],
        typer.Option("--out", "-o", help=f"file; its suffix is the format: {', '.join(FORMATS)}; repeatable"),
    ],
    options: Annotated[
        list[str] | None,
        typer.Option("--set", "-s", metavar="NAME=VALUE", help="option of the kind, like band=sd; repeatable"),
    ] = None,
    as_json: AsJson = False,
    url: Url = None,
) -> None:
    """Draw a figure of studies or experiments into files; /docs of the service lists the kinds and their options."""
    formats = [format_of(file, FORMATS) for file in out]
    with connect(url) as client:
        drawn = client.figures.draw(*ids, of=kind, **dict(map(named_option, options or [])))
        for each in formats:
            drawn.content(each)
    found = [(drawn.save(file), each) for file, each in zip(out, formats, strict=True)]
    sizes = [{"file": str(file), "format": each, "bytes": file.stat().st_size} for file, each in found]
    print_result(sizes, "\n".join(f"Wrote {file}." for file in out), as_json=as_json)


def named_option(text: str) -> tuple[str, str]:
    """Return the name and the value of NAME=VALUE."""
    name, equals, value = text.partition("=")
    if not equals or not name.isidentifier() or name in {"of", "format", "study", "experiment"}:
        msg = f"{text!r} sets no option; write NAME=VALUE, like band=sd"
        raise typer.BadParameter(msg, param_hint="--set")
    return name, value
