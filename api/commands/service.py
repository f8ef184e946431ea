"""Run the service."""

from pathlib import Path
from typing import Annotated, Any

import typer

from gaplab.api.clients import display
from gaplab.api.commands.base import app
from gaplab.services.settings import Settings


@app.command()
def serve(
    port: Annotated[int | None, typer.Option(help="left out: GAPLAB_PORT, or 8000", show_default=False)] = None,
    host: Annotated[str | None, typer.Option(help="left out: GAPLAB_HOST, or loopback", show_default=False)] = None,
    workers: Annotated[bool, typer.Option("--workers/--no-workers", help="run experiments, or only answer")] = True,
) -> None:
    """Run the service: migrate the database, answer over HTTP, and run what is queued. Ctrl-C ends it."""
    from gaplab.api.process.service import serve as run

    run(_settings(host, port), workers=workers)


@app.command()
def demo(
    folder: Annotated[Path, typer.Option(help="for its database, figures and log")] = Path("results/demo"),
) -> None:
    """Run the main job on small budgets: six strategies and the direct baseline, on a toy, then on a quadruped."""
    from gaplab.api.commands.demo import run

    run(folder, display.console())


def _settings(host: str | None, port: int | None) -> Settings:
    given: dict[str, Any] = {name: value for name, value in {"host": host, "port": port}.items() if value is not None}
    return Settings.from_environment().model_copy(update=given)
