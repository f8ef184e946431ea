"""The command that drives a robot on a bench."""

import signal
from pathlib import Path
from typing import Annotated

import typer

from gaplab.api.clients.drivers import DriverBroken, Robot, load, measure
from gaplab.api.commands.app import BENCH, ExperimentId, Url, app, connect
from gaplab.api.commands.exit_codes import CommandError, Exit
from gaplab.api.commands.json_output import echo
from gaplab.api.commands.request_words import print_safety
from gaplab.schemas.measurements import RequestRead


@app.command(rich_help_panel=BENCH)
def drive(  # noqa: PLR0913, PLR0917 - each is an option of the command
    id: ExperimentId,
    driver: Annotated[Path, typer.Option("--driver", help="Python file with the class Driver: connect, run, stop")],
    journal: Annotated[
        Path | None,
        typer.Option("--journal", help="file that keeps answers until the service has them"),
    ] = None,
    limit_s: Annotated[float | None, typer.Option("--limit-s", min=0.001, help="longest time of one run, s")] = None,
    lease_s: Annotated[
        float, typer.Option("--lease-s", min=1, help="seconds without a heartbeat before others may take over")
    ] = 60.0,
    within_limits: Annotated[
        bool, typer.Option("--within-limits", help="end before a controller that is expected to exceed a limit")
    ] = False,
    url: Url = None,
) -> None:
    """Measure what an experiment asks for with a driver, until the experiment has ended."""
    _stop_at_signals()
    kept = journal or driver.with_name(f"{driver.stem}-{id}.journal")
    try:
        robot = Robot(load(driver))
        with connect(url) as client:
            client.experiment(id)
            robot.connect()
            try:
                for task in client.requests(id, lease_s=lease_s, journal=kept):
                    _announce(task.request, within_limits=within_limits)
                    measure(task, robot, limit_s, lambda sentence: echo(f"  {sentence}"))
            finally:
                robot.stop()
    except DriverBroken as error:
        raise CommandError(str(error), Exit.FAILED) from error
    echo("The experiment has ended.")


def _stop_at_signals() -> None:
    """Stop in order also if the terminal closes or the machine shuts down; a signal that a shell ignores stays so."""
    for each in (signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT):
        if signal.getsignal(each) is not signal.SIG_IGN:
            signal.signal(each, signal.default_int_handler)


def _announce(request: RequestRead, *, within_limits: bool) -> None:
    """Print what is to be measured, with warnings about its safety.

    Raises:
        CommandError: the motion is expected to exceed a limit of the robot, and `within_limits` is set.
    """
    place = f"repetition {request.repetition}, iteration {request.iteration}, {request.kind.value}"
    echo(f"{request.id}: {place}")
    print_safety(request)
    if within_limits and request.safety and request.safety.beyond:
        msg = f"request {request.id} is beyond its limits, so it was not measured; without --within-limits it is"
        raise CommandError(msg, Exit.CONFLICT)
