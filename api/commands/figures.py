"""Commands that print curves and draw figures."""

from pathlib import Path
from typing import Annotated

import typer

from gaplab.api.clients.figures import FORMATS
from gaplab.api.clients.progress.text import console
from gaplab.api.commands import completion, tables
from gaplab.api.commands.app import RESULTS, AsJson, Ids, Url, app, connect
from gaplab.api.commands.json_output import echo, print_json, print_result


@app.command(rich_help_panel=RESULTS)
def curve(
    ids: Ids,
    csv: Annotated[bool, typer.Option("--csv", help="print comma-separated values")] = False,
    svg: Annotated[Path | None, typer.Option(help="file to draw into")] = None,
    html: Annotated[Path | None, typer.Option(help="file to draw into")] = None,
    as_json: AsJson = False,
    url: Url = None,
) -> None:
    """Print or draw curves: recorded fitness, mean ± SD, by number of real-world evaluations."""
    if csv and as_json:
        raise typer.BadParameter("only one of --csv and --json can be printed", param_hint="--csv")
    files = [file for file in (svg, html) if file]
    with connect(url) as client:
        if as_json:
            print_json(client.curves(ids))
        elif csv:
            echo(client.curves_csv(ids), nl=False)
        elif not files:
            curves = client.curves(ids)
            console().print(tables.curves(curves), *tables.baselines(curves))
        for format, file in (("svg", svg), ("html", html)):  # noqa: A001 - as the API says
            if file:
                file.parent.mkdir(parents=True, exist_ok=True)
                file.write_bytes(client.figure(*ids).content(format))
                echo(f"Wrote {file}.", err=as_json or csv)


@app.command(rich_help_panel=RESULTS)
def figure(
    kind: Annotated[str, typer.Argument(metavar="KIND", help="like curves", autocompletion=completion.figures)],
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
    for file in out:
        if _format(file) not in FORMATS:
            msg = f"{file} has no suffix of a figure; permitted: {', '.join(FORMATS)}"
            raise typer.BadParameter(msg, param_hint="--out")
    with connect(url) as client:
        drawn = client.figures.draw(*ids, of=kind, **dict(map(named_option, options or [])))
        for file in out:
            drawn.content(_format(file))
    files = [drawn.save(file) for file in out]
    sizes = [{"file": str(file), "format": _format(file), "bytes": file.stat().st_size} for file in files]
    print_result(sizes, "\n".join(f"Wrote {file}." for file in files), as_json=as_json)


def _format(file: Path) -> str:
    return file.suffix.removeprefix(".").lower()


def named_option(text: str) -> tuple[str, str]:
    """Return the name and the value of NAME=VALUE."""
    name, equals, value = text.partition("=")
    if not equals or not name.isidentifier() or name in {"of", "format", "study", "experiment"}:
        msg = f"{text!r} sets no option; write NAME=VALUE, like band=sd"
        raise typer.BadParameter(msg, param_hint="--set")
    return name, value
