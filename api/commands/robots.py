"""Commands that import robots from files, and store them in the service."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from pydantic import ValidationError
from rich.markup import escape
from rich.table import Table

from gaplab.api.clients.client import Client
from gaplab.api.clients.screen import console
from gaplab.api.commands.app import PLUGINS, Answer, AsJson, app, command
from gaplab.api.commands.exit_codes import CommandError, Exit
from gaplab.api.commands.json_output import print_json
from gaplab.api.commands.tables import minute, table
from gaplab.schemas.mistakes import sentence
from gaplab.schemas.robots import RobotRead
from gaplab.services.core.errors import InvalidRobot, InvalidSpec

if TYPE_CHECKING:
    from gaplab.services.robots.importing import ImportedFile
    from gaplab.services.robots.options import ImportOptions

MOTORS = "servo, position, velocity or torque"
OTHERS = (
    "kp, kd, max_torque, position_gain, motored, ground_m, turn, keyframe, vertices, visuals, static_friction, "
    "dynamic_friction, observed, controller or task; repeatable"
)
_IMPORTED = {b"<robot": "a URDF", b"<mujoco": "an MJCF"}
"""Roots of files that `gaplab robot import` reads."""

robot = typer.Typer(help="Import robots from URDF and MJCF, and store them.", no_args_is_help=True)
app.add_typer(robot, name="robot", rich_help_panel=PLUGINS)


@command(name="import", of=robot)
def import_file(  # noqa: PLR0913, PLR0917 - each is an option of the command
    file: Annotated[Path, typer.Argument(metavar="FILE", help="a URDF or an MJCF")],
    name: Annotated[str | None, typer.Option(help="name of the robot; left out: that in the file")] = None,
    output: Annotated[Path | None, typer.Option("--output", "-o", help="file to write; left out: NAME.json")] = None,
    fixed: Annotated[bool, typer.Option("--fixed", help="the base never moves, like that of an arm")] = False,
    mend: Annotated[bool, typer.Option("--mend", help="replace masses and inertias that no rigid body has")] = False,
    motor: Annotated[
        str | None, typer.Option(help=f"motor of the joints: {MOTORS}; left out: the file's, position for a URDF")
    ] = None,
    time_step: Annotated[float | None, typer.Option(help="time step, s; left out: the file's, or 1/240")] = None,
    start: Annotated[
        list[str] | None,
        typer.Option(metavar="JOINT=RAD", help="angle at time 0; JOINT may be a pattern like '*_knee'; repeatable"),
    ] = None,
    lock: Annotated[
        list[str] | None,
        typer.Option(metavar="JOINT", help="joints to fix: at zero in a URDF, at `ref` in an MJCF; repeatable"),
    ] = None,
    settings: Annotated[list[str] | None, typer.Option("--set", "-s", metavar="NAME=VALUE", help=OTHERS)] = None,
    force: Annotated[bool, typer.Option("--force", help="replace the file that is written, if it exists")] = False,
    as_json: AsJson = False,
) -> None:
    """Write a robot file from a URDF or an MJCF, and print what is lost or changed. Needs MuJoCo."""
    flags = {"name": name, "fixed": fixed, "mend": mend, "motor": motor, "time_step_s": time_step, "lock": lock or []}
    chosen = _options({**flags, "start": _starts(start or []), **dict(map(_setting, settings or []))})
    try:
        imported = _imported(file, chosen)
    except InvalidRobot as error:
        raise CommandError("\n  - ".join([f"{file} cannot be imported:", *error.reasons]), Exit.INVALID) from error
    written = output or Path(f"{imported.robot.name}.json")
    if written.exists() and not force:
        raise FileExistsError(None, "a file of this name is there already; --force replaces it", str(written))
    written.write_text(json.dumps(imported.robot.content, ensure_ascii=False, indent=1) + "\n", encoding="utf-8")
    if as_json:
        print_json(_facts(imported, written))
    else:
        console().print(*_lines(imported, written), sep="\n", soft_wrap=True)


def _imported(file: Path, options: "ImportOptions") -> "ImportedFile":
    """Return the robot of a file, whose controller and task can drive and rate it.

    Raises:
        InvalidRobot: with every reason.
    """
    from gaplab.services.plugins import folders
    from gaplab.services.robots.importing import import_robot
    from gaplab.services.specs.robots import robot_of_file

    folders.load()
    imported = import_robot(file, options)
    try:
        robot_of_file(imported.robot)
    except InvalidSpec as error:
        reasons = (f"{each.pointer.removeprefix('/usual_')}: {each.message}" for each in error.violations)
        raise InvalidRobot(reasons) from error
    return imported


def _options(given: dict[str, Any]) -> "ImportOptions":
    from gaplab.services.robots.options import ImportOptions

    try:
        return ImportOptions.model_validate({name: value for name, value in given.items() if value is not None})
    except ValidationError as error:
        raise typer.BadParameter("; ".join(_mistake(dict(each)) for each in error.errors())) from error


def _mistake(error: dict[str, Any]) -> str:
    if error["type"] == "extra_forbidden":
        return f"{error['loc'][-1]} is not an option of an import; permitted: {OTHERS.partition(';')[0]}"
    return sentence(error)


def _starts(texts: list[str]) -> dict[str, float]:
    found = {}
    for text in texts:
        joint, _, angle = text.rpartition("=")
        try:
            found[joint] = float(angle)
        except ValueError:
            joint = ""
        if not joint:
            msg = f"{text!r} sets no angle; write JOINT=RAD, like knee=-1.8"
            raise typer.BadParameter(msg, param_hint="--start")
    return found


def _setting(text: str) -> tuple[str, str]:
    name, equals, value = text.partition("=")
    if not equals:
        raise typer.BadParameter(f"{text!r} sets nothing; write NAME=VALUE, like kp=60", param_hint="--set")
    return name, value


def _facts(imported: "ImportedFile", written: Path) -> dict[str, Any]:
    return {
        "file": str(written),
        "name": imported.robot.name,
        "sha256": imported.robot.sha256,
        "lost": imported.robot.lost,
        "masses": [vars(row) for row in imported.masses],
        "mass_before_kg": imported.before_kg,
        "mass_after_kg": imported.after_kg,
    }


def _lines(imported: "ImportedFile", written: Path) -> Iterator[str | Table]:
    world = imported.robot.world
    yield f"[bold]{escape(imported.robot.name)}[/]: {len(world.bodies)} bodies, {len(world.actuators)} actuators"
    yield "[bold]lost or changed[/]"
    yield from (f"  - {escape(line)}" for line in imported.robot.lost)
    yield _mass_table(imported)
    yield f"Wrote {escape(str(written))}, sha256 {imported.robot.sha256}"


def _mass_table(imported: "ImportedFile") -> Table:
    rows = [(escape(row.body), f"{len(row.members)}", row.before_kg, row.after_kg) for row in imported.masses]
    rows.append(("[bold]all[/]", "", imported.before_kg, imported.after_kg))
    columns = ("body", "of the file's", "kg in the file", "kg imported")
    return table(columns, ((*words, f"{before:.6g}", f"{after:.6g}") for *words, before, after in rows))


@command(of=robot)
def add(
    client: Client,
    file: Annotated[Path, typer.Argument(metavar="FILE", help="a robot file, as `gaplab robot import` writes it")],
) -> Answer:
    """Store a robot file in the service, so that specs can name its robot."""
    _check_that_it_is_json(file)
    found = client.add_robot(file)
    named = json.dumps({"robot": found.name})
    return Answer(found, f"Stored the robot {found.name}, sha256 {found.sha256}. A spec names it: {named}")


def _check_that_it_is_json(file: Path) -> None:
    """Refuse a file that the service could not read as a robot file.

    Raises:
        CommandError: it is a URDF or an MJCF, which is imported first, or not JSON.
    """
    content = file.read_bytes()
    try:
        json.loads(content)
    except (ValueError, RecursionError) as error:
        kind = next((kind for root, kind in _IMPORTED.items() if root in content), None)
        imported = f"is not a robot file but {kind}; first: gaplab robot import {file}"
        reason = imported if kind else f"is not JSON: {error}"
        raise CommandError(f"{file} {reason}", Exit.FILE) from error


@command(name="list", of=robot)
def list_(client: Client) -> Answer:
    """List the robots from files that the service has, the newest of a name first."""
    found = client.robots()
    columns = ("name", "sha256", "bodies", "actuators", "kg", "file", "stored")
    shown = table(columns, map(_row, found)) if found else "No robot is stored; `gaplab robot add FILE` stores one."
    return Answer(found, shown)


def _row(found: RobotRead) -> tuple[str, ...]:
    size = f"{found.bodies}", f"{found.actuators}", f"{found.mass_kg:.4g}"
    return escape(found.name), found.sha256[:12], *size, escape(found.file or "-"), minute(found.created_at)
