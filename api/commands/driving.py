"""The command that drives a robot on a bench."""

import signal
from contextlib import suppress
from pathlib import Path
from typing import Annotated

import typer

from gaplab.api.clients.drivers import DriverBroken, load, measure
from gaplab.api.commands.app import BENCH, ExperimentId, Url, app, connect
from gaplab.api.commands.exit_codes import CommandError, Exit


@app.command(rich_help_panel=BENCH)
def drive(
    id: ExperimentId,
    driver: Annotated[Path, typer.Option("--driver", help="Python file with the class Driver: connect, run, stop")],
    journal: Annotated[
        Path | None,
        typer.Option("--journal", help="file that keeps answers until the service has them"),
    ] = None,
    limit_s: Annotated[float | None, typer.Option("--limit-s", min=0.001, help="longest time of one run")] = None,
    lease_s: Annotated[
        float, typer.Option("--lease-s", min=1, help="seconds of silence before others may take over")
    ] = 60.0,
    url: Url = None,
) -> None:
    """Measure what an experiment asks for with a driver, until the experiment has ended."""
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    kept = journal or driver.with_name(f"{driver.stem}-{id}.journal")
    try:
        robot = load(driver)
        with connect(url) as client:
            client.experiment(id)
            robot.connect()
            try:
                for task in client.requests(id, lease_s=lease_s, journal=kept):
                    request = task.request
                    place = f"repetition {request.repetition}, iteration {request.iteration}, {request.kind.value}"
                    typer.echo(f"{request.id}: {place}")
                    measure(task, robot, limit_s, lambda sentence: typer.echo(f"  {sentence}"))
            finally:
                with suppress(Exception):
                    robot.stop()
    except DriverBroken as error:
        raise CommandError(str(error), Exit.FAILED) from error
    typer.echo("The experiment has ended.")
