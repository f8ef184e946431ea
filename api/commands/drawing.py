"""Figures as files."""

from pathlib import Path
from typing import Annotated

import typer

from gaplab.api.clients.figures import FORMATS
from gaplab.api.commands.base import AsJson, Ids, Url, app, connect
from gaplab.api.commands.completion import figures
from gaplab.api.commands.json_output import document


@app.command()
def figure(
    kind: Annotated[str, typer.Argument(metavar="KIND", help="like curves", autocompletion=figures)],
    ids: Ids,
    out: Annotated[
        list[Path],
        typer.Option("--out", "-o", help=f"a file; its suffix says which format: {', '.join(FORMATS)}; repeatable"),
    ],
    options: Annotated[
        list[str] | None,
        typer.Option("--set", "-s", metavar="NAME=VALUE", help="of the kind, like band=sd; repeatable"),
    ] = None,
    as_json: AsJson = False,
    url: Url = None,
) -> None:
    """Draw a figure of studies or experiments into files; /docs of the service lists the kinds and what they take."""
    for file in out:
        if _format(file) not in FORMATS:
            msg = f"{file} has no suffix of a figure; there is {', '.join(FORMATS)}"
            raise typer.BadParameter(msg, param_hint="--out")
    with connect(url) as client:
        drawn = client.figure(*ids, of=kind, **dict(map(_option, options or [])))
        for file in out:
            drawn.content(_format(file))
    files = [drawn.save(file) for file in out]
    if as_json:
        document([{"file": str(file), "format": _format(file), "bytes": file.stat().st_size} for file in files])
        return
    for file in files:
        typer.echo(f"Wrote {file}.")


def _format(file: Path) -> str:
    return file.suffix.removeprefix(".").lower()


def _option(text: str) -> tuple[str, str]:
    name, equals, value = text.partition("=")
    if not equals or not name.isidentifier() or name in {"of", "format", "study", "experiment"}:
        msg = f"{text!r} sets nothing; write NAME=VALUE, as in band=sd"
        raise typer.BadParameter(msg, param_hint="--set")
    return name, value
