"""Commands that import pools of recordings from tables and files, and store them in the service."""

import json
from pathlib import Path
from typing import Annotated

import typer

from gaplab.api.clients.client import Client
from gaplab.api.commands.app import PLUGINS, Answer, app, command
from gaplab.api.commands.bench import pair
from gaplab.api.commands.exit_codes import CommandError, Exit
from gaplab.api.commands.tables import minute, table
from gaplab.services.core.errors import InvalidSpec

MOST_TOLD = 100
"""Most errors that are printed."""

pool = typer.Typer(help="Import recordings of what a robot did, and store them.", no_args_is_help=True)
app.add_typer(pool, name="pool", rich_help_panel=PLUGINS)


@command(name="import", of=pool)
def import_(  # noqa: PLR0913, PLR0917 - each is an option of the command
    source: Annotated[
        Path,
        typer.Argument(
            metavar="FOLDER_OR_FILE",
            help="a table, CSV or Parquet; a folder with a CSV or MCAP for each recording; or a LeRobot data set",
        ),
    ],
    robot: Annotated[str, typer.Option(help="name, robot file, URDF or MJCF")],
    name: Annotated[str, typer.Option(help="name of the pool, which specs give")],
    columns: Annotated[
        list[str] | None,
        typer.Option("--map", metavar="JOINT=COLUMN", help="as of `gaplab bench trace`: 'elbow=E [-deg @ 90]'"),
    ] = None,
    recording: Annotated[str, typer.Option(help="column of a table that names the recording")] = "recording",
    seconds: Annotated[float | None, typer.Option(help="longest part of a recording, from its beginning")] = None,
    every: Annotated[float | None, typer.Option(help="seconds between readings; left out: those of the lines")] = None,
    sensors: Annotated[
        str, typer.Option(help="read: base, or of it place, direction; angle, speed, torque")
    ] = "base,angle",
    noises: Annotated[
        list[str] | None,
        typer.Option("--noise", metavar="NAME=NUMBER", help="of place, direction, angle, speed or torque; repeatable"),
    ] = None,
    confirmed: Annotated[bool, typer.Option("--confirmed", help="take unlikely recordings")] = False,
    skip: Annotated[bool, typer.Option("--skip", help="leave out recordings with errors, and say so")] = False,
    output: Annotated[Path | None, typer.Option("--output", "-o", help="file to write; left out: NAME.json")] = None,
    force: Annotated[bool, typer.Option("--force", help="replace the file that is written, if it exists")] = False,
) -> Answer:
    """Write a pool of recordings, checked line by line, and print what was found and left out."""
    from gaplab.api.library.pools import PoolOptions, import_pool

    written = output or Path(f"{name}.json")
    if written.exists() and not force:
        raise FileExistsError(None, "a file of this name is there already; --force replaces it", str(written))
    options = PoolOptions(
        columns=dict(pair(each) for each in columns or ()),
        recording=recording,
        sensors=[each.strip() for each in sensors.split(",")],
        noises=dict(pair(each, "--noise", "NAME=NUMBER, like angle=0.002") for each in noises or ()),
        seconds=seconds,
        every_s=every,
        confirmed=confirmed,
        skip=skip,
    )
    try:
        found = import_pool(source, robot, name, options)
    except InvalidSpec as error:
        told = [f"{each.pointer[1:]}: {each.message}".removeprefix(": ") for each in error.violations]
        more = [f"and {len(told) - MOST_TOLD} more"] if len(told) > MOST_TOLD else []
        lines = [f"{source} cannot be imported:", *told[:MOST_TOLD], *more]
        raise CommandError("\n  - ".join(lines), Exit.INVALID) from error
    written.write_text(found.text + "\n", encoding="utf-8")
    size = f"{len(found.recordings)} recordings, {len(found.sensors)} sensors at {len(found.times_s)} times"
    facts = {"file": str(written), "name": found.name, "sha256": found.sha256, "lost": found.lost}
    last = f"Wrote {written}, sha256 {found.sha256}"
    return Answer(facts, f"{found.name}: {size}", *(f"  - {each}" for each in found.lost), last)


@command(of=pool)
def add(
    client: Client, file: Annotated[Path, typer.Argument(metavar="FILE", help="as `gaplab pool import` writes it")]
) -> Answer:
    """Store a pool in the service, so that specs can name it."""
    found = client.add_pool(file)
    named = json.dumps({"reality": {"kind": "recorded", "pool": found.name}})
    return Answer(found, f"Stored the pool {found.name}, sha256 {found.sha256}. A spec names it: {named}")


@command(name="list", of=pool)
def list_(client: Client) -> Answer:
    """List the pools that the service has, the newest of a name first."""
    found = client.pools()
    columns = ("name", "sha256", "recordings", "sensors", "commands", "s", "from", "stored")
    rows = (
        (
            each.name,
            each.sha256[:12],
            f"{each.recordings}",
            f"{len(each.sensors)}",
            f"{len(each.actuators)}",
            f"{each.seconds:.3g}",
            each.origin or "-",
            minute(each.created_at),
        )
        for each in found
    )
    return Answer(found, table(columns, rows) if found else "No pool is stored; `gaplab pool add FILE` stores one.")
