"""`gaplab robot import`, and `gaplab simulator` on a service in a thread."""

import json
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pytest

from gaplab.api.commands.exit_codes import Exit
from gaplab.schemas.spec import ExperimentSpec
from gaplab.services.core.arrays import frozen
from gaplab.services.core.types import Cost, Measured, Probed, Sample, Selected, Simulator, Step, Transferred, Tuned
from gaplab.services.robots.importing import import_robot
from gaplab.services.robots.options import ImportOptions
from gaplab.services.running import execution
from gaplab.services.store.session import Store
from gaplab.services.world.robot_files import RobotFile
from gaplab.services.world.robots.quadruped import Quadruped
from gaplab.services.world.world import Material
from tests.commands import Gaplab
from tests.experiments import run, submit_one
from tests.robot_texts import MJCF
from tests.unit.test_robot_import import path_of

mujoco = pytest.importorskip("mujoco")
BEST = (0.9, 0.7, 0.1)


def test_an_import_writes_a_robot_file_and_says_what_is_lost(gaplab: Gaplab, tmp_path: Path) -> None:
    output = tmp_path / "a1.json"
    knees = ("--start", "*_lower_joint=-1.8", "--start", "*_upper_joint=0.9")

    said = gaplab("robot", "import", str(path_of("a1/a1.urdf")), "--name", "a1", "-o", str(output), *knees)
    robot = RobotFile.read(output.read_bytes())

    assert said.code == 0
    assert robot.sha256 in said.out
    assert all(line in said.out for line in robot.lost)
    assert "fixed to FR_lower, and part of it: FR_toe" in said.out
    assert "12.458" in said.out
    assert robot.name == "a1"
    assert [joint.start for joint in robot.world.joints][:3] == [0.0, 0.9, -1.8]


@pytest.mark.usefixtures("here")
def test_an_import_takes_all_options_and_prints_json(gaplab: Gaplab) -> None:
    Path("m.xml").write_text(MJCF.format(""))
    options = (
        "--motor",
        "servo",
        "--fixed",
        "--time-step",
        "0.01",
        "--lock",
        "jc",
        "-s",
        "max_torque=3",
        "-s",
        "task=walk",
    )

    said = gaplab("robot", "import", "m.xml", *options, "--json")
    found, robot = json.loads(said.out), RobotFile.read(Path("m.json").read_bytes())

    assert (found["file"], found["sha256"], found["lost"]) == ("m.json", robot.sha256, list(robot.lost))
    assert found["mass_before_kg"] == pytest.approx(2.6)
    assert [row["members"] for row in found["masses"]] == [["base"], ["a"], ["b", "c"]]
    assert robot.world.joints[0].motor.max_torque_nm == 3
    assert robot.world.fixed
    assert robot.source.options["lock"] == ["jc"]


def test_a_refusal_names_every_reason_and_writes_nothing(gaplab: Gaplab, tmp_path: Path) -> None:
    output = tmp_path / "no.json"

    said = gaplab("robot", "import", str(path_of("mini_cheetah/mini_cheetah.urdf")), "-o", str(output))

    assert said.code == 5
    assert said.err.count("break the triangle inequality; --mend replaces it") == 4
    assert not output.exists()
    assert "one of servo, position, velocity, torque" in gaplab("robot", "import", "x", "--motor", "x").err.replace(
        "\n", " "
    ).replace("│", "").replace("  ", " ")
    assert gaplab("robot", "import", "x", "-s", "colour=red").code == 2
    assert gaplab("robot", "import", "x", "--start", "knee").code == 2
    turned = " ".join(gaplab("robot", "import", "x", "-s", "turn=1.57").err.replace("│", "").split())
    assert "turn must be three angles, roll,pitch,yaw in rad, like 1.5708,0,0, not 1.57" in turned
    assert gaplab("robot", "import", str(tmp_path / "missing.urdf")).code == 7


@pytest.mark.parametrize(
    ("setting", "said"),
    [
        ("controller=sin", "controller: unknown controller 'sin' (did you mean 'sine'?); permitted: "),
        ("task=walkk", "task: unknown task 'walkk' (did you mean 'walk'?); permitted: "),
    ],
)
def test_a_misspelt_controller_or_task_is_told_at_the_import(
    gaplab: Gaplab, tmp_path: Path, setting: str, said: str
) -> None:
    (tmp_path / "m.xml").write_text(MJCF.format(""))

    refused = gaplab("robot", "import", str(tmp_path / "m.xml"), "-o", str(tmp_path / "m.json"), "-s", setting)

    assert (refused.code, said in refused.err) == (5, True), refused.err
    assert not (tmp_path / "m.json").exists()


def test_a_controller_of_the_plug_ins_folder_is_known_to_an_import(
    gaplab: Gaplab, tmp_path: Path, put: Callable[..., Path]
) -> None:
    put(mine="from gaplab.services.world.controllers.oscillators import Sine\nclass Mine(Sine):\n    name = 'mine'\n")
    (tmp_path / "m.xml").write_text(MJCF.format(""))

    said = gaplab("robot", "import", str(tmp_path / "m.xml"), "-o", str(tmp_path / "m.json"), "-s", "controller=mine")

    assert said.code == 0, said.err


def test_an_import_replaces_a_file_only_if_it_is_told_to(gaplab: Gaplab, tmp_path: Path) -> None:
    output = tmp_path / "m.json"
    (tmp_path / "m.xml").write_text(MJCF.format(""))
    output.write_text("by hand")
    command = ("robot", "import", str(tmp_path / "m.xml"), "-o", str(output))

    refused = gaplab(*command)
    kept = output.read_text()
    replaced = gaplab(*command, "--force")

    assert refused.code == 7
    assert refused.err == f"gaplab: {output}: a file of this name is there already; --force replaces it\n"
    assert kept == "by hand"
    assert replaced.code == 0
    assert RobotFile.read(output.read_bytes()).name == "m"


def best_of(iteration: int) -> Simulator:
    """Return the best simulator, which has intervals in the last iteration."""
    if iteration < 2:
        return Simulator(frozen((0.5, 0.4, 0.0)), 0.01)
    return Simulator(frozen(BEST), 0.01, interval=frozen([(0.8, 1.0), (0.6, 0.75), (0.0, 0.2)]))


def log(genome: np.ndarray) -> Iterator[Step]:
    """Two iterations, of which the second has the better simulators first."""
    for iteration in range(3):
        if iteration:
            yield Selected(iteration, genome, Cost(1, 1))
            yield Measured(iteration, Sample(genome, 0.3))
        simulators = (best_of(iteration), Simulator(frozen(BEST), 0.5))
        yield Tuned(iteration, simulators, Cost(1, 1) if iteration else Cost())
        yield Transferred(iteration, genome, 0.3, Cost(1, 1))
        yield Probed(iteration, 0.3, 0.3)


@pytest.fixture
def tuned(sqlite_store: Store) -> str:
    """The id of a tuned experiment of the quadruped in PyBullet."""
    pytest.importorskip("pybullet")
    tunables = ["static_friction", "dynamic_friction", "restitution"]
    wanted = {"strategy": "random", "robot": "quadruped", "engine": "pybullet", "budget": "smoke", "tunables": tunables}
    submitted = submit_one(sqlite_store, ExperimentSpec.model_validate(wanted | {"iterations": 2, "repetitions": 1}))
    (claim,) = execution.claim(sqlite_store, "test", limit=1)
    run(sqlite_store, claim, log(Quadruped().known))
    return submitted.id


def test_the_best_simulator_is_written_as_a_robot_file(gaplab: Gaplab, tuned: str, tmp_path: Path) -> None:
    output = tmp_path / "tuned.json"

    said = gaplab("simulator", tuned, "-o", str(output))
    robot = RobotFile.read(output.read_bytes())

    assert said.code == 0
    assert "material.static_friction 1 → 0.9" in said.out
    assert "rollouts are within 0 m of the tuned simulator's" in said.out
    assert robot.world == replace(Quadruped().world, material=Material(*BEST))
    assert (robot.usual_controller.name, robot.usual_task.name) == ("square_pulses", "walk")
    assert robot.comments[0] == f"Tuned by gaplab: experiment {tuned}, repetition 0, iteration 2."
    assert robot.comments[1] == "static_friction = 0.9, 95 % interval 0.8 to 1; before 1"
    facts = json.loads(gaplab("simulator", tuned, "-o", str(output), "--json").out)
    assert facts["simulator"]["parameters"]["restitution"] == 0.1
    assert len(facts["written"]) == 3


def test_the_best_simulator_is_written_for_mujoco_alone_with_the_distance_from_it(
    gaplab: Gaplab, tuned: str, tmp_path: Path
) -> None:
    output = tmp_path / "tuned.xml"

    refused = gaplab("simulator", tuned, "-o", str(output))
    said = gaplab("simulator", tuned, "-o", str(output), "--partial")

    assert (refused.code, said.code) == (5, 0)
    assert "restitution 0 → 0.1: the MJCF of MuJoCo alone has no place for it" in refused.err
    assert mujoco.MjModel.from_xml_path(str(output)).nu == 12
    assert "not in this file: material.restitution 0 → 0.1" in output.read_text()
    assert "MuJoCo alone, with one friction and no restitution, differs by up to " in said.out


def test_a_file_that_cannot_be_written_is_refused_with_every_reason(
    gaplab: Gaplab, tuned: str, sqlite_store: Store, tmp_path: Path
) -> None:
    urdf = str(path_of("a1/a1.urdf"))
    alone = gaplab("simulator", tuned, "-o", str(tmp_path / "tuned.urdf"))
    foreign = gaplab("simulator", tuned, "-o", str(tmp_path / "tuned.urdf"), "--from", urdf)

    assert (alone.code, foreign.code) == (5, 5)
    assert "give that with --from, or write a .json or .xml" in alone.err
    assert "quadruped was not imported from a file: write robot.json instead" in foreign.err
    assert not list(tmp_path.iterdir())


def test_an_experiment_without_tuned_simulators_says_so(gaplab: Gaplab, sqlite_store: Store, tmp_path: Path) -> None:
    spec = ExperimentSpec.model_validate({"strategy": "random", "robot": "quadruped", "budget": "smoke"})
    waiting = submit_one(sqlite_store, spec)

    said = gaplab("simulator", waiting.id, "-o", str(tmp_path / "tuned.json"))

    assert said.code == 6
    assert "no tuned simulators yet" in said.err


@pytest.fixture
def tuned_a1(sqlite_store: Store, gaplab: Gaplab, tmp_path: Path) -> str:
    """The id of a tuned experiment of a1, whose file was imported and stored."""
    pytest.importorskip("pybullet")
    file, knees = str(tmp_path / "a1.json"), ("--start", "*_lower_joint=-1.8", "--start", "*_upper_joint=0.9")
    assert gaplab("robot", "import", str(path_of("a1/a1.urdf")), "--name", "a1", "-o", file, *knees).code == 0
    assert gaplab("robot", "add", file).code == 0
    tunables = ["mass(trunk)", "joint_damping(*_hip_joint)", "max_torque"]
    wanted = {"strategy": "random", "robot": "a1", "engine": "pybullet", "budget": "smoke", "tunables": tunables}
    submitted = submit_one(sqlite_store, ExperimentSpec.model_validate(wanted | {"iterations": 2, "repetitions": 1}))
    (claim,) = execution.claim(sqlite_store, "test", limit=1)
    run(sqlite_store, claim, log(frozen(np.zeros(3))))
    return submitted.id


def test_tuned_values_of_an_imported_robot_are_in_its_urdf(gaplab: Gaplab, tuned_a1: str, tmp_path: Path) -> None:
    """With real rollouts in PyBullet. The trunk is at 0.9 of its mass, hips have 0.7 N·m·s/rad, torques a tenth."""
    original, output = path_of("a1/a1.urdf"), tmp_path / "tuned.urdf"

    said = gaplab("simulator", tuned_a1, "-o", str(output), "--from", str(original))
    robot = import_robot(output, ImportOptions()).robot.world

    assert said.code == 0, said.err
    assert "trunk: mass_kg 4.714 → 4.2426" in said.out
    assert "an import computes it: FR_hip_joint: motor.kp" in said.out
    assert robot.bodies[0].mass_kg == pytest.approx(0.9 * 4.714, rel=1e-12)
    assert [joint.damping for joint in robot.joints[:3]] == [0.7, 0, 0]
    assert robot.joints[0].motor.max_torque_nm == pytest.approx(2.0)
    assert "mass(trunk) = 0.9, 95 % interval 0.8 to 1; before 1" in output.read_text()


def test_a_tuned_robot_can_be_added_beside_the_one_that_it_was(gaplab: Gaplab, tuned_a1: str, tmp_path: Path) -> None:
    said = gaplab("simulator", tuned_a1, "-o", str(tmp_path / "tuned.json"))
    added = gaplab("robot", "add", str(tmp_path / "tuned.json"), "--json")

    assert said.code == 0, said.err
    assert "Inertia" not in said.out
    assert json.loads(added.out)["name"] == "a1_tuned"
    assert [each["name"] for each in json.loads(gaplab("robot", "list", "--json").out)] == ["a1", "a1_tuned"]


@pytest.fixture
def in_tokyo(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    with monkeypatch.context() as patch:
        patch.setenv("TZ", "Asia/Tokyo")
        time.tzset()
        yield
    time.tzset()


@pytest.mark.usefixtures("in_tokyo")
def test_robots_are_listed_with_the_local_time_of_their_storing(gaplab: Gaplab, tmp_path: Path) -> None:
    source, output = tmp_path / "m.xml", tmp_path / "m.json"
    source.write_text(MJCF)
    gaplab("robot", "import", str(source), "-o", str(output))
    stored = json.loads(gaplab("robot", "add", str(output), "--json").out)["created_at"]

    listed = gaplab("robot", "list").out

    tokyo = datetime.fromisoformat(stored) + timedelta(hours=9)
    assert f"{tokyo:%Y-%m-%d %H:%M}" in listed


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "<robot name='a1'/>",
            "{0} is not a robot file but a URDF; first: gaplab robot import {0}",
        ),
        (MJCF, "{0} is not a robot file but an MJCF; first: gaplab robot import {0}"),
        ("{", "{0} is not JSON: Expecting property name enclosed in double quotes: line 1 column 2 (char 1)"),
    ],
)
def test_a_file_that_is_no_robot_file_is_not_sent(gaplab: Gaplab, tmp_path: Path, text: str, message: str) -> None:
    file = tmp_path / "a1.urdf"
    file.write_text(text)

    said = gaplab("robot", "add", str(file))

    assert (said.code, said.err) == (Exit.FILE, f"gaplab: {message.format(file)}\n")


def test_another_urdf_than_that_of_the_robot_is_refused(gaplab: Gaplab, tuned_a1: str, tmp_path: Path) -> None:
    said = gaplab("simulator", tuned_a1, "-o", str(tmp_path / "t.urdf"), "--from", str(path_of("aliengo/aliengo.urdf")))

    assert said.code == 5
    assert "aliengo.urdf is not the file that a1 was imported from, or has changed since" in said.err
