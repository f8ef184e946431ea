"""Commands that run the service."""

from pathlib import Path
from typing import Annotated

import typer

from gaplab.api.clients.screen import console
from gaplab.api.commands.app import RUNNING, app
from gaplab.services.settings import Settings


@app.command(rich_help_panel=RUNNING)
def serve(
    port: Annotated[int | None, typer.Option(help="left out: GAPLAB_PORT, or 8000")] = None,
    host: Annotated[str | None, typer.Option(help="left out: GAPLAB_HOST, or loopback")] = None,
    workers: Annotated[
        bool, typer.Option("--workers/--no-workers", help="run experiments, or only accept and show them")
    ] = True,
    reload: Annotated[
        bool, typer.Option("--reload", help="start again when a plug-in file changes: for authors of plug-ins")
    ] = False,
) -> None:
    """Run the service: migrate the database, answer over HTTP and run queued experiments. Ctrl-C ends it."""
    from gaplab.api.process.service import serve as run
    from gaplab.api.process.service import serve_again_after_edits

    settings = Settings.from_environment().bound(host, port)
    if reload:
        raise typer.Exit(serve_again_after_edits(settings, workers=workers))
    run(settings, workers=workers)


@app.command(rich_help_panel=RUNNING)
def demo(
    folder: Annotated[Path, typer.Option(help="folder for the database, the figures and the log")] = Path(
        "results/demo"
    ),
) -> None:
    """Compare six strategies and the direct baseline on small budgets: on a toy function, then on a quadruped."""
    from gaplab.api.commands.demo import run

    run(folder, console())
