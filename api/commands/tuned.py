"""The command that writes tuned values back into the file of a robot, and the one that tries further tunables."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from math import nan
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated, Any
from zipfile import ZipFile

import typer

from gaplab.api.clients.client import Client
from gaplab.api.clients.errors import ServiceError, lines_of
from gaplab.api.commands.app import RESULTS, Answer, ExperimentId, command
from gaplab.api.commands.exit_codes import CommandError, Exit
from gaplab.api.commands.json_output import echo
from gaplab.services.core.errors import InvalidRobot

FURTHER = ("slope", "max_torque", "kp", "motor_gain", "delay", "mass", "joint_damping", "friction")
"""Labels of tunables that models often lack."""


Output = Annotated[Path, typer.Option("--output", "-o", help="file to write: .json, or .urdf or .xml with --from")]
Original = Annotated[Path | None, typer.Option("--from", help="URDF or MJCF that the robot was imported from")]
Partial = Annotated[
    bool, typer.Option("--partial", help="leave out values that the format has no place for; they become comments")
]


@command(RESULTS)
def simulator(
    client: Client,
    id: ExperimentId,
    output: Output,
    original: Original = None,
    partial: Partial = False,
) -> Answer:
    """Write the best tuned simulator as a robot file, or into the robot's URDF or MJCF, if its rollouts are the same.

    A .xml without --from is an MJCF of the simulator for MuJoCo alone, which has one friction and no restitution.
    """
    from gaplab.api.library.writing import write_robot
    from gaplab.services.plugins import folders
    from gaplab.services.specs.stored_specs import spec_of
    from gaplab.services.world import robot_library

    folders.load()
    best, spec = client.best_simulator(id), spec_of(client.spec(id).resolved[0])
    if spec.robot.name == robot_library.IMPORTED:
        robot_library.learn([client.robot_file(spec.robot.options["sha256"]).decode()])
    if best is None:
        raise CommandError(f"{id} has no tuned simulators yet", Exit.CONFLICT)
    with refusals(output):
        found = write_robot(id, spec, best, output, original, partial=partial)
    told = f"repetition {best.repetition}, iteration {best.iteration}, error {best.error:.4g} per sample"
    return Answer({"simulator": best, **found.facts}, told, *found.lines())


@contextmanager
def refusals(output: Path) -> Iterator[None]:
    """Say that a robot's file was not written, with every reason."""
    try:
        yield
    except InvalidRobot as error:
        raise CommandError("\n  - ".join([f"{output} was not written:", *error.reasons]), Exit.INVALID) from error


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
