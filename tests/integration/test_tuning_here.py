"""`gaplab.Tuning`: it asks, is told, and tunes, in this process, with the numbers of a bench in a service."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gaplab import DriverMotion, InvalidSpec, Tuning
from gaplab.api.library import computing
from gaplab.api.library.robots import read_robot
from gaplab.schemas.corrections import CorrectionSpec
from gaplab.schemas.lifecycle import Verb
from gaplab.schemas.measurements import MeasurementSpec
from gaplab.schemas.plugin import PluginRef
from gaplab.schemas.samples import InvalidSamples
from gaplab.services.archives import export
from gaplab.services.archives.rerunning import Part, verify
from gaplab.services.core.arrays import frozen
from gaplab.services.core.errors import Conflict, NotFound
from gaplab.services.core.types import Measured, Probed, Selected, Step, Transferred, Tuned
from gaplab.services.engines.analytic import Analytic
from gaplab.services.experiments import lifecycle
from gaplab.services.experiments.limits import FREELY
from gaplab.services.measuring import answering, corrections
from gaplab.services.measuring.taking import RequestFilter, list_requests
from gaplab.services.specs.assembly import edits_of, engine_of
from gaplab.services.specs.simulation import Simulation
from gaplab.services.store.models import RepetitionRow
from gaplab.services.store.queries.logs import logs
from gaplab.services.store.session import Store
from gaplab.services.world.motions import Motion
from tests import drawn_arm
from tests.archiving import exported, imported
from tests.commands import Gaplab
from tests.experiments import same, submit_one, toy
from tests.integration.test_bench import compute, pending
from tests.integration.test_bench_http import traces_of
from tests.unit.test_plugin_errors import HOPPER

TOY = {"tunables": ["static_friction", "dynamic_friction"], "budget": "smoke", "tuner": "search"}
ROWS = [([round(gene, 2)], 0.3 + 0.5 * gene * (1 - gene)) for gene in np.linspace(0, 1, 12)]

URDF = """<robot name="crawler">
<link name="trunk">
<inertial><mass value="2"/><inertia ixx=".02" iyy=".03" izz=".04" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><geometry><box size=".36 .2 .06"/></geometry></collision>
</link>
<link name="front_leg">
<inertial><origin xyz="0 0 -.06"/><mass value=".2"/>
<inertia ixx=".0005" iyy=".0005" izz=".0001" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><origin xyz="0 0 -.06"/><geometry><box size=".03 .16 .12"/></geometry></collision>
</link>
<joint name="front" type="revolute">
<parent link="trunk"/><child link="front_leg"/><origin xyz="0.14 0 0"/><axis xyz="0 1 0"/>
<limit lower="-1" upper="1" effort="4" velocity="10"/></joint>
<link name="rear_leg">
<inertial><origin xyz="0 0 -.06"/><mass value=".2"/>
<inertia ixx=".0005" iyy=".0005" izz=".0001" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><origin xyz="0 0 -.06"/><geometry><box size=".03 .16 .12"/></geometry></collision>
</link>
<joint name="rear" type="revolute">
<parent link="trunk"/><child link="rear_leg"/><origin xyz="-0.14 0 0"/><axis xyz="0 1 0"/>
<limit lower="-1" upper="1" effort="4" velocity="10"/></joint>
</robot>
"""


def tuning_of(**changes: Any) -> Tuning:
    """A tuning of the toy function by the smallest budget."""
    return Tuning("toy_function", **{"strategy": "simulated_fit"} | TOY | changes)


def reality(genome: Any) -> float:
    """What a bench would measure."""
    return float(0.4 + 0.3 * np.sin(5 * genome[0]))


def kinds(log: tuple[Step, ...]) -> str:
    """The steps of a log, a letter each: s, m, t, x for a transfer, and p."""
    letters = {Selected: "s", Measured: "m", Tuned: "t", Transferred: "x", Probed: "p"}
    return "".join(letters[type(step)] for step in log)


def log_of(store: Store, experiment: str) -> tuple[Step, ...]:
    with store.reading() as session:
        (row,) = session.query(RepetitionRow).filter_by(experiment_id=experiment)
        return logs(session, [row.id])[row.id]


@pytest.mark.parametrize("strategy", ["simulated_fit", "simulated_fit_and_informative", "random"])
def test_it_has_the_numbers_of_a_bench_in_the_service(strategy: str, sqlite_store: Store) -> None:
    """To the last bit, whatever is asked for in between."""
    tuning = tuning_of(strategy=strategy, iterations=3, held_out=0.4)
    spec = toy(**tuning.spec.model_dump(mode="json") | {"budget": "smoke"})
    experiment = submit_one(sqlite_store, spec).id

    for _ in range(3):
        genome = tuning.ask()
        compute(sqlite_store)
        (request,) = pending(sqlite_store)
        assert tuple(request.genome) == genome == tuning.ask()
        tuning.tell(genome, reality(genome))
        answering.answer(sqlite_store, request.id, MeasurementSpec(values=(reality(genome),)), FREELY)
        if strategy == "random":
            assert tuning.simulator.error is not None
    found = tuning.controller
    compute(sqlite_store)

    log = log_of(sqlite_store, experiment)
    assert kinds(log) == "txp" + 3 * "smtxp"
    assert same(log[:-1], tuning._log())
    assert found == tuple(log[-2].genome.tolist())  # type: ignore[union-attr]


def test_twelve_rows_cost_one_tuning_and_nothing_until_it_is_read(tmp_path: Path) -> None:
    table = tmp_path / "runs.csv"
    table.write_text("gene_0,value\n" + "".join(f"{genome[0]},{value}\n" for genome, value in ROWS))
    tuning = tuning_of(iterations=2, held_out=0.25, tuner="gauss_newton")

    tuning.tell(table)
    told = kinds(tuning._log())
    found = tuning.simulator

    assert (told, kinds(tuning._log())) == (12 * "sm", 12 * "sm" + "t")
    assert len(tuning.samples) == 12
    assert found.intervals.keys() == found.values.keys() == {"static_friction", "dynamic_friction"}
    assert None not in (found.error, found.held_out_error)
    assert [verdict.name for verdict in found.verdicts] == list(found.values)
    assert "95 % interval" in str(found)
    assert "<td>static_friction = " in tuning._repr_html_()
    before = tuning._log()
    assert str(tuning.simulator) == str(found)
    tuning.tell(table)  # again, as a script that is run again does
    assert tuning._log() is not before
    assert same(tuning._log(), before)
    assert kinds(tuning._log()[:24]) == 12 * "sm"
    assert tuning.controller.fitness is not None
    assert kinds(tuning._log()) == 12 * "sm" + "tx"
    tuning.ask()
    assert kinds(tuning._log()) == 12 * "sm" + "txps"


@pytest.mark.parametrize("asked_first", [True, False])
def test_what_is_told_again_or_forgotten_is_as_if_it_had_been_so_at_first(asked_first: bool) -> None:
    """Simulators and the next controller to ask for: the other samples stay, and steps that followed are computed."""
    wrong, right = tuning_of(), tuning_of()
    for tuning, third in ((wrong, 9.0), (right, 0.3)):
        if asked_first:
            tuning.tell(tuning.ask(), 0.35)
        for place, (genome, value) in enumerate(ROWS[:5]):
            tuning.tell(genome, third if place == 2 else value, confirmed=True)
            if tuning is wrong and place in (2, 3):
                assert tuning.controller
    other = wrong.ask()
    wrong.tell(ROWS[2][0], 0.3)

    assert len(wrong.samples) == 5 + asked_first
    assert wrong.simulator == right.simulator
    assert wrong.ask() == right.ask() != other

    for tuning in (wrong, right):
        tuning.forget(ROWS[3][0])
    expected = tuning_of()
    if asked_first:
        expected.tell(expected.ask(), 0.35)
    for genome, value in (*ROWS[:2], (ROWS[2][0], 0.3), ROWS[4]):
        expected.tell(genome, value)
    assert wrong.samples["iteration"].tolist() == list(range(1, 5 + asked_first))
    assert wrong.simulator == right.simulator == expected.simulator
    assert wrong.ask() == expected.ask()
    with pytest.raises(NotFound, match="nothing to forget"):
        wrong.forget(ROWS[3][0])


def test_another_controller_than_the_asked_one_may_be_told() -> None:
    tuning = tuning_of()
    asked = tuning.ask()

    tuning.tell([0.123], [0.3, None, 0.5])
    tuning.tell(asked, failed="it fell over")

    samples = [step.sample for step in tuning._log() if isinstance(step, Measured)]
    assert np.array_equal([each.fitness for each in samples], [0.4, np.nan], equal_nan=True)
    assert samples[0].repeats.tolist() == [0.3, 0.5]
    assert [step.told for step in tuning._log() if isinstance(step, Selected)] == [True, True]
    assert kinds(tuning._log()) == "txpsmsm"
    assert tuning.ask() not in {asked, (0.123,)}


def test_a_tuning_goes_on_at_a_bench_and_back(sqlite_store: Store, tmp_path: Path) -> None:
    tuning = tuning_of(iterations=6)
    tuning.tell(tuning.ask(), 0.5)
    tuning.tell([{"genome": genome, "values": [value]} for genome, value in ROWS[:3]])
    tuning.save(tmp_path / "a.gaplab")
    asked = tuning.ask()

    found = imported(sqlite_store, (tmp_path / "a.gaplab").read_bytes())
    lifecycle.ask(sqlite_store, found.study, Verb.RESUME)
    compute(sqlite_store)
    (request,) = pending(sqlite_store)
    assert tuple(request.genome) == asked
    answering.answer(sqlite_store, request.id, MeasurementSpec(values=(0.6,)), FREELY)
    compute(sqlite_store)
    whole = exported(export(sqlite_store, found.study))
    (tmp_path / "b.zip").write_bytes(whole)
    back = Tuning.load(tmp_path / "b.zip")

    tuning.tell(asked, 0.6)
    assert back.simulator == tuning.simulator
    assert back.ask() == tuning.ask()
    with (tmp_path / "b.zip").open("rb") as file:
        assert [each.outcome for each in verify(file, Part()).repetitions] == ["same"]

    (first,) = [each for each in answers_of(sqlite_store, found.study) if each.fitness == 0.5]
    corrections.correct(sqlite_store, first.id, CorrectionSpec(values=(0.55,), reason="a typing error"), FREELY)
    assert kinds(log_of(sqlite_store, found.study)) == "txpsm" + 3 * "sm", "what a person told stays in the service too"


def answers_of(store: Store, experiment: str) -> list[Any]:
    found = list_requests(store, RequestFilter(experiment=experiment, pending=False), limit=100).items
    return [answer for request in found for answer in request.answers]


def test_a_path_keeps_everything_and_refuses_another_tuning(tmp_path: Path) -> None:
    path = tmp_path / "kept.db"
    tuning = tuning_of(path=path)
    asked = tuning.ask()
    tuning.tell([0.3], 0.4)

    again = tuning_of(path=path)
    assert again.samples["fitness"].tolist() == [0.4]
    again.tell(asked, 0.5)
    assert Tuning.load(path).samples["fitness"].tolist() == [0.4, 0.5]
    with pytest.raises(Conflict, match="another seed, strategy"):
        tuning_of(path=path, strategy="random", seed=1)


def test_an_interruption_and_a_timeout_lose_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """What was computed of a step is kept too: a step that is longer than the time is over in the end."""
    uninterrupted, tuning = tuning_of(), tuning_of()
    monkeypatch.setattr(computing, "EVERY_S", 0.0)
    rollouts, calls = Analytic.rollouts, 0

    def interrupted(self: Analytic, *given: Any) -> Any:
        nonlocal calls
        calls += 1
        if calls in (3, 40):
            raise KeyboardInterrupt
        return rollouts(self, *given)

    monkeypatch.setattr(Analytic, "rollouts", interrupted)
    for _ in range(2):
        with pytest.raises(KeyboardInterrupt):
            tuning.ask()
    late = 0
    while True:
        try:
            asked = tuning.ask(timeout_s=0)
        except TimeoutError:
            late += 1
        else:
            break

    assert late > 3
    assert asked == uninterrupted.ask()
    assert same(tuning._log(), uninterrupted._log())


def test_it_refuses_in_the_words_of_the_service(tmp_path: Path) -> None:
    tuning = tuning_of()
    refused: dict[str, Callable[[], Any]] = {
        "unknown strategy 'simulated_fot'": lambda: tuning_of(strategy="simulated_fot"),
        "controller of the toy_function has 1 genes, not 2": lambda: tuning.tell([0.1, 0.2], 0.3),
        "gene 0 must be from 0 to 1, not 2": lambda: tuning.tell([2.0], 0.3),
        "an answer has either `values`": lambda: tuning.tell([0.5]),
        "is in m/s, not in km/h": lambda: tuning.tell([0.5], 0.3, unit="km/h"),
        "/1/values: values is missing": lambda: tuning.tell([{"genome": [0.5], "values": [0.3]}, {"genome": [0.6]}]),
        "/reality/held_out: held_out must be at most 0.9, not 7.0": lambda: tuning_of(reality={"held_out": 7.0}),
        "/seed: of a spec, robot, controller, task, engine": lambda: Tuning({"robot": "toy_function", "seed": 3}),
    }
    for words, call in refused.items():
        with pytest.raises(InvalidSpec, match=words.replace("(", r"\(")):
            call()
    with pytest.raises(Conflict, match="nothing to tune on"):
        tuning.simulator  # noqa: B018 - it is computed
    with pytest.raises(Conflict, match="surrogate tunes no simulators"):
        tuning_of(strategy="surrogate").simulator  # noqa: B018 - it is computed
    (tmp_path / "bad.csv").write_text("gene_0,value\n0.5,fast\n")
    with pytest.raises(InvalidSamples, match="'fast' is not a number"):
        tuning.tell(tmp_path / "bad.csv")
    with pytest.raises(Conflict, match="/repetitions: 2 is not of a tuning; permitted: 1"):
        tuning_of(path=tmp_path / "refused.db", repetitions=2)
    assert tuning_of(path=tmp_path / "refused.db").spec.repetitions == 1
    assert tuning._log() == ()


def test_a_doubtful_value_is_told_once(recwarn: pytest.WarningsRecorder) -> None:
    tuning = tuning_of()
    tuning.tell([0.2], 0.4)

    with pytest.warns(UserWarning, match=r"40 is 1e\+02 times the largest fitness"):
        tuning.tell([0.3], 40.0)


def test_the_file_of_a_robot_gets_the_tuned_values(gaplab: Gaplab, tmp_path: Path) -> None:
    """By the command that a stranger would use, from a URDF and a table."""
    pytest.importorskip("mujoco")
    robot, table = tmp_path / "crawler.urdf", tmp_path / "runs.csv"
    robot.write_text(URDF)
    measure(robot, {"mass(trunk)": 1.2, "friction": 0.7}, table)

    given = ("--tunables", "mass(trunk), friction", "--engine", "mujoco", "--held-out", "0.2", "--partial")
    written_to = ("-o", str(tmp_path / "tuned.urdf"), "--save", str(tmp_path / "t.gaplab"))
    said = gaplab("tune", str(robot), str(table), *given, *written_to)

    assert said.code == 0, said.err
    assert "mass(trunk) = " in said.out
    assert "95 % interval" in said.out
    assert "held-out error" in said.out
    assert "Wrote" in said.out
    tuning = Tuning.load(tmp_path / "t.gaplab")
    found = tuning.simulator
    written = tuning.save_robot(tmp_path / "again.urdf", partial=True)
    assert written.distance_m < 1e-3
    assert (tmp_path / "again.urdf").read_text() == (tmp_path / "tuned.urdf").read_text()
    trunk = read_robot(tmp_path / "tuned.urdf").world.bodies[0]
    assert trunk.mass_kg == pytest.approx(2 * found.values["mass(trunk)"], rel=1e-6)
    assert found.values["friction"] == pytest.approx(0.7, abs=0.15), "what the robot did says so"


def measure(robot: Path, values: dict[str, float], table: Path) -> None:
    """Write a table of what a robot with these values does."""
    made = read_robot(robot)
    genomes = made.space.draw(10, np.random.default_rng(0))
    simulation = Simulation(made, engine_of(PluginRef(name="mujoco")), edits_of(values))
    real = simulation(genomes, np.array([list(values.values())]))[:, 0]
    head = ",".join([*(f"gene_{place}" for place in range(made.space.size)), "value"])
    rows = (",".join(map(repr, [*genome.tolist(), float(value)])) for genome, value in zip(genomes, real, strict=True))
    table.write_text("\n".join([head, *rows]))


def test_a_robot_of_a_plug_in_is_tuned(put: Callable[..., Path], monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("mujoco")
    monkeypatch.setenv("GAPLAB_PLUGINS", str(put(hopper=HOPPER)))
    tuning = Tuning("hopper", ["friction"], strategy="random", budget="smoke", tuner="search")
    genome = tuning.ask()
    assert genome.motion.actuators == ("hip",)
    tuning.tell(genome, 0.1)
    assert tuning.simulator.values.keys() == {"friction"}


def test_an_arm_is_told_by_its_encoders(tmp_path: Path) -> None:
    """The joints of the recording have other names and units; its fitness and readings are those of the motion."""
    task: Any = {"name": "track", "options": {"sensors": ["angles"], "every_s": 0.1}}
    tuning = Tuning(
        drawn_arm.imported(tmp_path), ["kp(elbow)"], strategy="random", engine="mujoco", budget="smoke", task=task
    )
    robot: Any = read_robot(tuning.spec)
    genome = tuning.ask()
    times_s = frozen(np.arange(101) * 0.02)
    engine, motion = engine_of(PluginRef(name="mujoco")), robot.motion(frozen(genome))
    angles = engine.rollout(robot.world, motion.observed_at(times_s, joints=True)).angles_rad
    assert angles is not None
    log = np.column_stack([times_s + 5.0, np.rad2deg(angles)])
    np.savetxt(tmp_path / "run.csv", log, delimiter=",", header="time_s,S,E", comments="")

    tuning.tell(genome, trace=tmp_path / "run.csv", columns={"shoulder": "S", "elbow": "E", "*": "[deg]"})

    (sample,) = (step.sample for step in tuning._log() if isinstance(step, Measured))
    values = robot.sensors.values(sample.readings)
    assert values == pytest.approx(angles[5::5], abs=1e-3)
    rated, readings = robot.rated(times_s, dict(zip(("shoulder", "elbow"), angles.T, strict=True)), frozen(genome))
    assert sample.fitness == pytest.approx(rated, abs=1e-3)
    assert readings == pytest.approx(values, abs=1e-3)


def driven(robot: str, sent: DriverMotion) -> float:
    """The fitness of a robot that a driver moved."""
    made, engine = read_robot(robot), engine_of(PluginRef(name="pybullet"))
    motion = Motion(frozen(sent.times_s), frozen(sent.targets), frozen(sent.observe_s))
    return float(made.fitness(engine.rollouts([made.world], [motion]))[0, 0])


def test_a_driver_runs_the_motions_that_a_tuning_asks_for(tmp_path: Path) -> None:
    """A loop of a driver, and recordings in place of numbers."""
    pytest.importorskip("pybullet")
    tuning = Tuning("quadruped", ["static_friction"], strategy="random", engine="pybullet", budget="smoke")
    genome = tuning.ask()
    tuning.tell(genome, driven("quadruped", genome.motion))
    traced = tuning.ask()
    tuning.tell(traced, trace=list(traces_of(traced, tmp_path)), lags_s=[2.0, 7.5])

    once, twice = (step.sample for step in tuning._log() if isinstance(step, Measured))
    assert (len(once.repeats), len(twice.repeats)) == (0, 2)
    assert twice.repeats[0] == pytest.approx(twice.repeats[1], abs=1e-6)
    assert len(tuning.client.study(tuning.id).experiments) == 1
    assert tuning.simulator.error is not None
    assert json.loads(json.dumps(genome)) == list(genome)
