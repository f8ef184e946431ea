"""The command that writes tuned values back into the file of a robot, and the one that tries further tunables."""

from collections.abc import Iterator, Sequence
from math import nan
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Annotated, Any
from zipfile import ZipFile

import typer

from gaplab.api.clients.client import Client
from gaplab.api.clients.errors import ServiceError, lines_of
from gaplab.api.commands.app import RESULTS, Answer, ExperimentId, command
from gaplab.api.commands.exit_codes import CommandError, Exit
from gaplab.api.commands.json_output import echo
from gaplab.schemas.records import SimulatorRead
from gaplab.schemas.resolved import ResolvedSpec
from gaplab.services.core.errors import InvalidRobot
from gaplab.services.findings.wording import interval

if TYPE_CHECKING:
    from gaplab.services.robots.writing import WrittenFile
    from gaplab.services.world.robot_files import RobotFile
    from gaplab.services.world.robots.base import Robot
    from gaplab.services.world.world import World

FURTHER = ("slope", "max_torque", "kp", "motor_gain", "delay", "mass", "joint_damping", "friction")
"""Labels of tunables that models often lack."""


@command(RESULTS)
def simulator(
    client: Client,
    id: ExperimentId,
    output: Annotated[Path, typer.Option("--output", "-o", help="file to write: .json, or .urdf or .xml with --from")],
    original: Annotated[
        Path | None, typer.Option("--from", help="URDF or MJCF that the robot was imported from")
    ] = None,
    partial: Annotated[
        bool, typer.Option("--partial", help="leave out values that the format has no place for; they become comments")
    ] = False,
) -> Answer:
    """Write the best tuned simulator as a robot file, or into the robot's URDF or MJCF, if its rollouts are the same.

    A .xml without --from is an MJCF of the simulator for MuJoCo alone, which has one friction and no restitution.
    """
    from gaplab.services.plugins import folders
    from gaplab.services.specs.stored_specs import spec_of
    from gaplab.services.world import robot_library

    folders.load()
    best, spec = client.best_simulator(id), spec_of(client.spec(id).resolved[0])
    if spec.robot.name == robot_library.IMPORTED:
        robot_library.learn([client.robot_file(spec.robot.options["sha256"]).decode()])
    if best is None:
        raise CommandError(f"{id} has no tuned simulators yet", Exit.CONFLICT)
    try:
        written, *distances_m = _written(id, spec, best, (output, original), partial=partial)
    except InvalidRobot as error:
        raise CommandError("\n  - ".join([f"{output} was not written:", *error.reasons]), Exit.INVALID) from error
    found = output, best, written, distances_m
    return Answer(_facts(*found), *_lines(*found))


def _written(
    id: str, spec: ResolvedSpec, best: SimulatorRead, files: tuple[Path, Path | None], *, partial: bool
) -> tuple["WrittenFile", float, float | None]:
    """Write the file; return what is in it, and the largest distances in rollouts, here and in MuJoCo alone."""
    from gaplab.services.core.arrays import frozen
    from gaplab.services.robots.comparing import check_rollouts, plain_distance_m
    from gaplab.services.robots.writing import Tuning, write_json, write_plain, write_xml
    from gaplab.services.specs.assembly import edits_of, engine_of
    from gaplab.services.specs.robots import robot_of
    from gaplab.services.specs.simulation import Simulation

    output, original = files
    robot, engine, edits = robot_of(spec), engine_of(spec.engine), edits_of(ref.name for ref in spec.tunables)
    file, distances = _robot_file(spec, robot), [0.0]
    tuned = Simulation(robot, engine, edits).world(frozen([best.parameters[ref.name] for ref in spec.tunables]))
    comments = [
        _comment(ref.name, best, edit.read(file.world), edit.unit)
        for ref, edit in zip(spec.tunables, edits, strict=True)
    ]

    def accept(world: "World") -> None:
        distances.append(check_rollouts(tuned, world, engine, file.usual_controller, file.usual_task))

    tuning = Tuning(file, tuned, (_headline(id, best), *comments), partial)
    if output.suffix.lower() == ".json":
        written = write_json(tuning, output, accept)
    elif original is not None:
        written = write_xml(tuning, original, output, accept)
    elif output.suffix.lower() == ".xml":
        written = write_plain(tuning, output)
    else:
        raise InvalidRobot(
            [f"{output.name} is a copy of the robot's file: give that with --from, or write a .json or .xml"]
        )
    return written, max(distances), plain_distance_m(tuned, engine, file.usual_controller, file.usual_task)


def _robot_file(spec: ResolvedSpec, robot: "Robot") -> "RobotFile":
    from gaplab.services.world.robot_files import RobotFile
    from gaplab.services.world.robot_library import robot_file

    driver, task = spec.controller or robot.usual_controller, spec.task or robot.usual_task
    if driver is None or task is None or not robot.world.bodies:
        why = "it has no bodies, or no controller that a file can name"
        raise InvalidRobot([f"the robot {spec.robot.name} cannot be written as a file: {why}"])
    known = robot_file(spec.robot.options.get("sha256", ""))
    if known is None:
        return RobotFile(name=spec.robot.name, usual_controller=driver, usual_task=task, world=robot.world)
    return known.model_copy(update={"usual_controller": driver, "usual_task": task})


def _headline(id: str, best: SimulatorRead) -> str:
    return f"Tuned by gaplab: experiment {id}, repetition {best.repetition}, iteration {best.iteration}."


def _comment(name: str, best: SimulatorRead, before: float, unit: str) -> str:
    unit = "" if unit == "1" else f" {unit}"
    ends = (best.intervals or {}).get(name)
    stated = interval(*ends, "{:.6g}".format) if ends else "the tuner gives no interval"
    return f"{name} = {best.parameters[name]:.6g}{unit}, {stated}; before {before:.6g}{unit}"


def _facts(
    output: Path, best: SimulatorRead, written: "WrittenFile", distances_m: Sequence[float | None]
) -> dict[str, Any]:
    return {
        "file": str(output),
        "simulator": best,
        "written": list(map(str, written.changes)),
        "left_out": list(map(str, written.left_out)),
        "computed": list(map(str, written.computed)),
        "largest_distance_m": distances_m[0],
        "plain_mujoco_distance_m": distances_m[1],
    }


def _lines(
    output: Path, best: SimulatorRead, written: "WrittenFile", distances_m: Sequence[float | None]
) -> Iterator[str]:
    yield f"repetition {best.repetition}, iteration {best.iteration}, error {best.error:.4g} per sample"
    yield from (f"  {change}" for change in written.changes)
    yield from (f"  not in the file: {change}" for change in written.left_out)
    yield from (f"  an import computes it: {change}" for change in written.computed)
    what = "with the values that are not in it, rollouts are" if written.left_out else "rollouts are"
    here, plain = distances_m
    yield f"Wrote {output}: in gaplab's engine, {what} within {here:.2g} m of the tuned simulator's."
    if plain is not None:
        yield f"MuJoCo alone, with one friction and no restitution, differs by up to {plain:.2g} m within a second."


@command(RESULTS)
def try_tunables(
    client: Client,
    id: ExperimentId,
    further: Annotated[
        list[str] | None, typer.Argument(metavar="TUNABLE", help=f"default: {', '.join(FURTHER)}")
    ] = None,
) -> Answer:
    """Search for simulators on an experiment's samples with each of further tunables, and print which errors are left.

    Each search is an experiment without real-world evaluations. The first ones add nothing, by its tuner and `search`.
    """
    tried = list(_tried(client, id, further or FURTHER))
    line = "{:.3g} {unit} with {added}, by {tuner}: {experiment}"
    return Answer(tried, *(line.format(each["error"] or nan, **each) for each in tried))


def _tried(client: Client, id: str, further: Sequence[str]) -> Iterator[dict[str, Any]]:
    """Submit an experiment for each tunable that robot and engine have, then yield what each leaves."""
    (spec,), sent = client.spec(id).resolved, []
    with TemporaryDirectory() as folder, ZipFile(client.take_home(id, Path(folder) / "home.zip")) as home:
        driven = spec["robot"]["name"], spec["robot"]["options"], spec["controller"], spec["task"]
        samples = client.bench.check_samples(home.extract("samples.csv", folder), *driven)
    reality = {"kind": "physical", "samples": samples, "probes": "never"}
    again = spec | {"iterations": 0, "repetitions": 1, "reality": reality}
    tuners = dict.fromkeys([spec["tuner"]["name"], "search"])
    for added, tuner in [*(("nothing", each) for each in tuners), *((each, "search") for each in further)]:
        asked = {"name": f"with {added}", "tunables": [*spec["tunables"], *({added} - {"nothing"})]}
        by = {} if tuner == spec["tuner"]["name"] else {"tuner": tuner}
        try:
            sent.append((added, tuner, client.send(again | asked | by, confirm_cost=True).id))
        except ServiceError as refused:
            echo(f"{added} is not tried: {lines_of(refused.problem)[0]}", err=True)
    for added, tuner, made in sent:
        client.wait(made)
        found = client.misfit(made)
        error, unit = found.points[-1].error.mean, found.error_unit
        yield {"added": added, "tuner": tuner, "error": error, "unit": unit, "experiment": made}
