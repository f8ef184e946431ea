"""Controllers in simulators of one's choice, without a service; `test_replays` compares them with the service's."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gaplab
from gaplab import InvalidSpec
from gaplab.schemas.spec import ExperimentSpec
from gaplab.services.world.robot_files import RobotFile
from gaplab.services.world.robots.quadruped import Quadruped
from tests.drawn_arm import URDF, imported

TOY = "toy_function"
WET = {"dynamic_friction": 0.3}


def fitness(*asked: Any, **named: Any) -> list[list[float]]:
    return gaplab.simulate(*asked, **named).fitness.tolist()


def test_each_controller_meets_each_simulator_whatever_tunables_they_have() -> None:
    genomes, simulators = [[0.2], [0.7]], [None, WET, {"static_friction": 0.5}, {}]

    together = fitness(TOY, genomes, simulators)

    assert together == [[fitness(TOY, genome, values)[0][0] for values in simulators] for genome in genomes]
    assert together[0][0] == together[0][3]
    assert len({*together[0]}) == 3


def test_a_robot_is_a_name_a_file_or_a_spec(tmp_path: Path) -> None:
    robot = Quadruped()
    usual: dict[str, Any] = {"usual_controller": robot.usual_controller, "usual_task": robot.usual_task}
    (tmp_path / "mine.json").write_text(RobotFile(name="mine", world=robot.world, **usual).text)
    spec = {"strategy": "random", "robot": "quadruped", "engine": "mujoco", "task": {"name": "walk", "options": {}}}
    by_name = fitness("quadruped", robot.known, WET, engine="mujoco")

    assert by_name == fitness(str(tmp_path / "mine.json"), robot.known, WET, engine="mujoco")
    assert by_name == fitness(spec, [robot.known], WET)
    assert by_name == fitness(ExperimentSpec.model_validate(spec), robot.known, WET)
    assert by_name != fitness(spec, robot.known, WET, task={"name": "walk", "options": {"counted_s": 1.0}})
    neither: Any = 7
    with pytest.raises(TypeError, match="a robot is its name, its file or a spec, not 7"):
        gaplab.simulate(neither, robot.known)


def test_a_urdf_is_imported_as_by_the_command(tmp_path: Path) -> None:
    (tmp_path / "arm.urdf").write_text(URDF)
    genome = gaplab.read_robot(tmp_path / "arm.urdf").known

    found = gaplab.simulate(tmp_path / "arm.urdf", genome, {"mass(base)": 3.0}, engine="mujoco")

    assert found.robot.unit == "m/s"
    assert np.isfinite(found.fitness).all()
    assert found.trajectory().positions_m.shape == (3, 151, 3)
    (tmp_path / "arm.urdf").write_text(URDF.replace('mass value="1"', 'mass value="-1"'))
    with pytest.raises(InvalidSpec, match="-1"):
        gaplab.simulate(tmp_path / "arm.urdf", genome)


def test_all_that_is_wrong_is_told_with_its_place_value_and_what_is_permitted() -> None:
    with pytest.raises(InvalidSpec) as refused:
        gaplab.simulate("quadruped", [[0.5] * 24, [0.5] * 23 + [7.0]], [None, {"restitution": 9.0, "frction": 1.0}])

    found = {each.pointer: (each.value, each.permitted) for each in refused.value.violations}
    assert found["/genomes/1/23"] == (7.0, "0 to 1")
    assert found["/values/1/restitution"] == (9.0, "0 to 0.9")
    assert found["/values/1/frction"][0] == "frction"
    assert len(found) == 3


@pytest.mark.parametrize(
    ("named", "pointer"),
    [
        ({"robot": "quadrupet"}, "/robot"),
        ({"engine": "analytic"}, "/engine"),
        ({"controller": "sin"}, "/controller"),
        ({"values": 7}, "/values/0"),
        ({"values": {"restitution": "wet"}}, "/values/0/restitution"),
        ({"genomes": "abc"}, "/genomes/0"),
        ({"genomes": [[0.5] * 24, [0.5]]}, "/genomes/1"),
        ({"genomes": []}, "/genomes/0"),
    ],
)
def test_an_argument_is_refused_by_its_place(named: dict[str, Any], pointer: str) -> None:
    with pytest.raises(InvalidSpec) as refused:
        gaplab.simulate(**{"robot": "quadruped", "genomes": [0.5] * 24} | named)

    assert [each.pointer for each in refused.value.violations] == [pointer]


def test_a_robot_without_a_body_has_no_trajectory() -> None:
    found = gaplab.simulate(TOY, [0.5])

    assert found.readings.shape == (1, 1, 0, 0)
    with pytest.raises(InvalidSpec, match="toy_function has no body"):
        found.trajectory()


def test_angles_of_joints_are_rated_as_the_simulation_of_an_arm_is(tmp_path: Path) -> None:
    robot: Any = gaplab.read_robot(imported(tmp_path))
    found = gaplab.simulate(tmp_path / "arm.json", robot.known, engine="mujoco")
    (simulation, parameters), observed = found._simulators[0], robot.motion(robot.known).observe_s
    times_s = np.union1d(observed, robot.sensors.times_s)
    _, recording = simulation.record(robot.known, parameters, times_s)
    angles = dict(zip(("shoulder", "elbow"), recording.angles_rad.T, strict=True))

    fitness, readings = robot.rated(times_s, angles)

    assert fitness == pytest.approx(found.fitness[0, 0], abs=1e-9)
    assert np.allclose(readings, found.readings[0, 0], atol=1e-9)
    for wrong, why in ((angles | {"knee": angles["elbow"]}, "not ..knee"), (angles, "a record of 2 s")):
        with pytest.raises(ValueError, match=why):
            robot.rated(times_s[: None if "knee" in wrong else 1], wrong)
    with pytest.raises(ValueError, match="needs a fixed base"):
        Quadruped().rated(times_s, {})
