"""The files that a person takes home from an experiment; the same results give the same bytes."""

import io
import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from importlib.metadata import version
from typing import Any, TypeAlias
from zipfile import ZipFile

import numpy as np

from gaplab.schemas.records import ExperimentRead, SampleRead
from gaplab.schemas.resolved import ResolvedSpec
from gaplab.schemas.traces import TRACE_COLUMNS
from gaplab.services.core.arrays import FloatArray, frozen, known
from gaplab.services.core.errors import Conflict, GaplabError, InvalidRobot
from gaplab.services.csv_tables import csv_text
from gaplab.services.engines.mujoco.plain import LOST, mjcf_of, plain_positions
from gaplab.services.experiments.reading import read, read_experiment
from gaplab.services.measuring import motion_files
from gaplab.services.replay.process import RolloutProcess, SentSpec, received, sent
from gaplab.services.replay.traces import expected_motion
from gaplab.services.reports.blocks import render_html
from gaplab.services.reports.content import Facts, Outcome, facts_of
from gaplab.services.reports.document import report_of, said, spec_text
from gaplab.services.reports.tables import MOST_SHOWN
from gaplab.services.results.files import entry_of
from gaplab.services.specs.assembly import simulation_of
from gaplab.services.specs.robots import robot_of
from gaplab.services.specs.stored_specs import spec_of
from gaplab.services.store.models import AttachmentRow
from gaplab.services.store.queries import requests
from gaplab.services.store.session import Store
from gaplab.services.world import robot_library
from gaplab.services.world.motions import Motion
from gaplab.services.world.robots.base import Robot
from gaplab.services.world.tunables.labels import unit_of
from gaplab.services.world.world import World

Readings: TypeAlias = dict[tuple[Any, ...], Sequence[Any]]
"""Tables of readings of all repeats, by genome and values."""

MOTIONS: dict[motion_files.MotionFormat, str] = {"csv": "motion.csv", "json": "motion.json", "ros2": "motion.ros2.yaml"}

README = """What experiment {id} ({name}) found, by gaplab {version}.

report.html        all of this, and more, as a report to read and to print
controller.json    genome and fitness of the best measured controller
motion.*           its motion as CSV, JSON and a ROS 2 JointTrajectory; none if the controller observes while it acts
simulator.json     the tuned simulator with its intervals, and the rest of the ensemble
verdict.txt        what can be concluded, in sentences
samples.csv        samples from before and all measurements, for `reality.samples` of another spec.
                   gaplab.read_samples("samples.csv", ROBOT) reads them for gaplab's own robots, those of
                   GAPLAB_PLUGINS, and robot files; for all robots of a service
                   client.bench.check_samples("samples.csv", ROBOT) does
samples.json       the same for programs of yours, with repetition, iteration, operator and time, and with readings in
                   units of noise; `reality.samples` takes samples.csv
robot.json         the robot file: `gaplab robot add robot.json` first, where samples and spec are used elsewhere.
                   `gaplab simulator {id} -o tuned.urdf --from FILE` writes tuned values into its URDF or MJCF
tuned.xml          the tuned simulator as an MJCF for MuJoCo alone, which has one friction and no restitution
traces/            recordings that answered, by repetition, iteration, kind and repeat
expected/          motion of each measured controller in the tuned simulator, and fitness.json, to compare with yours;
                   plain_mujoco_m.json: how far, at most, it is from the motion of tuned.xml in MuJoCo alone
spec.json          the spec; `gaplab submit spec.json` runs it again
provenance.json    versions of everything that computed it

Files that would be empty are left out.
"""


@dataclass(frozen=True)
class _Home:
    """An experiment whose results are taken home."""

    facts: Facts
    outcome: Outcome
    spec: ResolvedSpec
    robot: Robot

    @property
    def experiment(self) -> ExperimentRead:
        """The experiment."""
        return self.facts.experiments[0]


def takehome_zip(
    store: Store, process: RolloutProcess, experiment_id: str, draw: Callable[[Callable[[], str]], str]
) -> bytes:
    """Return a zip of the report on an experiment and of what it found as files for programs.

    `draw` calls a function that draws figures, perhaps after waiting for a turn.

    Raises:
        NotFound: no such experiment.
        Conflict: nothing has been measured or tuned yet.
        InvalidSpec: its robot is not installed here.
    """
    home, content = _home(store, experiment_id), io.BytesIO()
    with ZipFile(content, "w") as archive:
        made = f"Made by gaplab {version('gaplab')}."
        archive.writestr(entry_of("report.html"), draw(lambda: render_html(report_of(home.facts), made)))
        readings, traces = _answered(store, experiment_id)
        for name, text in (*_files(home, readings), *traces, *_expected(home, process)):
            archive.writestr(entry_of(name), text)
    return content.getvalue()


def _home(store: Store, experiment_id: str) -> _Home:
    facts = facts_of(store, read(store, read_experiment(store, experiment_id).id))
    outcome, (experiment,) = facts.outcome, facts.experiments
    assert outcome is not None
    if outcome.best is None and not outcome.simulators:
        later = f", and is {experiment.state}" if experiment.state.ended else " yet; try again later"
        raise Conflict(f"experiment {experiment_id!r} has measured and tuned nothing{later}")
    spec = spec_of(experiment.spec)
    return _Home(facts, outcome, spec, robot_of(spec))


def _answered(store: Store, experiment_id: str) -> tuple[Readings, list[tuple[str, str]]]:
    """Return the readings of all repeats by measurement, and name and text of each trace."""
    readings, traces = Readings(), list[tuple[str, str]]()
    with store.reading() as session:
        for number, request, answer in requests.measured(session, experiment_id):
            readings[tuple(request.genome), tuple(answer.values or ())] = answer.readings or ()
            for repeat, trace in enumerate(answer.traces or (), start=1):
                content = session.get_one(AttachmentRow, trace["attachment"]).content.decode("utf-8", "replace")
                traces.append((f"traces/{number}-{request.iteration}-{request.kind.value}-{repeat}.csv", content))
    return readings, traces


def _expected(home: _Home, process: RolloutProcess) -> Iterator[tuple[str, str]]:
    """Yield the motion of measured controllers in the best tuned simulator, and fitness there; nothing if none runs."""
    if not (home.outcome.simulators and home.robot.world.bodies):
        return
    spec, fitness, apart_m = sent(home.spec), dict[str, float | None](), dict[str, float | None]()
    parameters = tuple(home.outcome.simulators[0].parameters[ref.name] for ref in home.spec.tunables)
    call = partial(process.call, plugins=spec.plugins)
    tuned = call(tuned_mjcf, spec, parameters, f"Tuned by gaplab: experiment {home.experiment.id}.")
    yield from (("tuned.xml", text) for text in [tuned] if text)
    for each in home.outcome.measured[:MOST_SHOWN]:
        name = f"{each.repetition}-{each.iteration}-{each.kind.value}"
        try:
            motion, expected = call(expected_motion, spec, each.genome, parameters)
            assert motion.positions_m is not None
            assert motion.orientations is not None
            plain_m = call(plain_motion, spec, parameters, each.genome, motion.times_s) if tuned else None
        except GaplabError:
            return
        if plain_m is not None:
            apart_m[name] = known(np.linalg.norm(plain_m - motion.positions_m, axis=1).max())
        text, header = io.StringIO(), ",".join(TRACE_COLUMNS)
        np.savetxt(
            text,
            np.column_stack([motion.times_s, motion.positions_m, motion.orientations]),
            "%.9g",
            ",",
            header=header,
            comments="",
        )
        fitness[name] = known(expected)
        yield f"expected/{name}.csv", text.getvalue()
    yield "expected/fitness.json", _json(fitness)
    yield from (("expected/plain_mujoco_m.json", _json(found)) for found in [apart_m] if found)


def _files(home: _Home, readings: Readings) -> Iterator[tuple[str, str]]:
    """Yield name and text of each file beside the report."""
    yield from (("robot.json", text) for text in robot_library.needed_by({"robot": home.spec.robot.model_dump()}))
    experiment, best = home.experiment, home.outcome.best
    yield "README.txt", README.format(id=experiment.id, name=experiment.name, version=version("gaplab"))
    yield "verdict.txt", "\n\n".join((home.facts.verdict.headline, *said(home.facts))) + "\n"
    yield "spec.json", spec_text(home.facts.again[0].spec) + "\n"
    yield "provenance.json", home.facts.provenance[experiment.id].model_dump_json(indent=1) + "\n"
    if best is not None or home.spec.reality.samples:
        yield "samples.csv", _samples_csv(home, readings)
    if best is not None:
        yield "controller.json", _json(best.model_dump(mode="json") | {"unit": home.robot.unit})
        yield "samples.json", _json([sample.model_dump(mode="json") for sample in home.outcome.measured])
        genome = frozen(best.genome)
        for form in motion_files.forms_of(home.robot, genome):
            yield MOTIONS[form], motion_files.written(home.spec, genome, form)
    if home.outcome.simulators:
        yield "simulator.json", _json(_simulator(home))


def _samples_csv(home: _Home, readings: Readings) -> str:
    """Return all measurements as a table of samples, those from before the experiment first.

    Equal ones are there once, since a sample may also be a probe.
    """
    found: dict[Any, list[float | None]]
    found = {(each.genome, each.values): _cells(each.readings) for each in home.spec.reality.samples if each.values}
    for sample in home.outcome.measured:
        key = sample.genome, sample.repeats or (sample.fitness,)
        found[key] = _cells(readings.get(key)) or (_readings(sample, home) if len(key[1]) == 1 else [])
    repeats = max(len(values) for _, values in found)
    ends = ["", *(f"#{number}" for number in range(2, repeats + 1))]
    read = any(set(told) - {None} for told in found.values())
    names = [f"{name}{end}" for end in ends for name in home.robot.sensors.columns] if read else []
    values = ["value"] if repeats == 1 else [f"value_{number}" for number in range(1, repeats + 1)]
    rows = (
        [*genome, *measured, *[None] * (repeats - len(measured)), *(told + [None] * len(names))[: len(names)]]
        for (genome, measured), told in found.items()
    )
    return csv_text([*(f"gene_{place}" for place in range(home.robot.space.size)), *values, *names], rows)


def _cells(readings: Sequence[Any] | None) -> list[float | None]:
    return [cell for table in readings or () for row in table for cell in row]


def _readings(sample: SampleRead, home: _Home) -> list[float | None]:
    """Return the readings of a measurement in the sensors' units, empty where one failed."""
    size = home.robot.sensors.size
    if sample.readings is None or len(sample.readings) != size:
        return [None] * size
    return [known(value) for value in home.robot.sensors.values(frozen(sample.readings)).ravel()]


def _simulator(home: _Home) -> dict[str, Any]:
    best, misfit = home.outcome.simulators[0], home.facts.misfits.get(home.experiment.id)
    verdicts = {each.name: each for each in misfit.verdicts} if misfit else {}
    return {
        "experiment": home.experiment.id,
        "robot": home.spec.robot.model_dump(mode="json"),
        "engine": home.spec.engine.model_dump(mode="json"),
        "repetition": best.repetition,
        "iteration": best.iteration,
        "samples": home.outcome.samples,
        "error": best.error,
        "error_unit": misfit.error_unit if misfit else "",
        "held_out_error": best.held_out_error,
        "tunables": [
            {
                "name": ref.name,
                "unit": unit_of(ref.name),
                "value": best.parameters[ref.name],
                "interval": (best.intervals or {}).get(ref.name),
                "bounds": [ref.lower, ref.upper],
                "verdict": verdicts[ref.name].verdict if ref.name in verdicts else None,
                "sentence": verdicts[ref.name].sentence if ref.name in verdicts else None,
            }
            for ref in home.spec.tunables
        ],
        "ensemble": [
            {"parameters": each.parameters, "squared_error": each.squared_error, "weight": each.weight}
            for each in home.outcome.simulators
        ],
    }


def _json(value: Any) -> str:  # noqa: ANN401 - JSON
    return json.dumps(value, indent=1, ensure_ascii=False) + "\n"


def tuned_mjcf(sent_spec: SentSpec, parameters: Sequence[float], headline: str) -> str:
    """Return a simulator as MJCF, with a line at its start; "" without MuJoCo, or if it refuses it."""
    _, world = _tuned(sent_spec, parameters)
    try:
        return mjcf_of(world, [headline, f"Not in this file: {', '.join(LOST)}"])
    except InvalidRobot:
        return ""


def plain_motion(
    sent_spec: SentSpec, parameters: Sequence[float], genome: Sequence[float], times_s: FloatArray
) -> FloatArray | None:
    """Return `(t, 3)`: where the body that counts is in MuJoCo alone, m; None for a controller that observes."""
    robot, world = _tuned(sent_spec, parameters)
    motion = robot.motion(frozen(genome)).observed_at(times_s)
    return plain_positions(world, motion) if isinstance(motion, Motion) else None


def _tuned(sent_spec: SentSpec, parameters: Sequence[float]) -> tuple[Robot, World]:
    spec = received(sent_spec)
    robot = robot_of(spec)
    return robot, simulation_of(spec, robot).world(frozen(parameters))
