"""Replays of a robot with every shape, asked over HTTP."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from fastapi import FastAPI
from fastapi.testclient import TestClient

from gaplab.api.app import create_app
from gaplab.schemas.plugin import PluginRef
from gaplab.schemas.records import MeasurementKind
from gaplab.schemas.replays import Replay, RobotShapes
from gaplab.schemas.spec import ExperimentSpec
from gaplab.services.core.arrays import frozen
from gaplab.services.core.types import Simulator, Transferred, Tuned
from gaplab.services.measuring import motion_files
from gaplab.services.plugins import loading
from gaplab.services.plugins.folders import VARIABLE
from gaplab.services.running import execution
from gaplab.services.store.lease import Requested
from gaplab.services.store.session import Store
from gaplab.services.world.motions import Motion
from gaplab.services.world.robots import robots
from gaplab.services.world.world import PDMotor
from tests.drawn_robot import FILES, strode
from tests.experiments import submit_one

QUADRUPED = "/catalogue/robots/quadruped/shapes"


@pytest.fixture(scope="module")
def app(tmp_path_factory: pytest.TempPathFactory) -> Iterator[FastAPI]:
    """A service that has the robot; one for all tests, since its processes take a while to start."""
    home = tmp_path_factory.mktemp("plug-ins")
    for name, text in FILES.items():
        (home / f"{name}.py").write_text(text)
    with pytest.MonkeyPatch.context() as environment:
        environment.setenv(VARIABLE, str(home))
        loading.load((home,))
        app = create_app(Store("sqlite://"))
        yield app
        app.state.rollout_process.close()
    loading.load(())


@pytest.fixture
def api(app: FastAPI, sqlite_store: Store) -> TestClient:
    app.state.store = sqlite_store
    return TestClient(app)


def test_every_part_of_every_body_is_shown(sqlite_store: Store, api: TestClient) -> None:
    experiment = strode(sqlite_store)

    answer = api.get(f"/experiments/{experiment}/replay")

    assert answer.status_code == 200, answer.text
    shown = Replay.model_validate_json(answer.content)
    world = shown.simulation
    assert world is not None
    kinds = [shape.kind for shape in world.shapes if shape.body is not None]
    assert sorted(set(kinds)) == ["box", "capsule", "cylinder", "hull", "sphere"]
    assert (shown.bodies[shown.observed], shown.feet) == ("head", ("left foot", "right foot", "wheel"))
    assert world.slope_rad == 0.12
    assert shown.framing.scale == 1.0
    assert {shape.body for shape in world.shapes if shape.role == "trunk"} == {shown.observed}
    assert {shape.kind for shape in world.shapes if shape.role == "foot"} == {"hull", "cylinder"}


def test_heights_and_speeds_are_those_of_the_observed_body_that_slides(sqlite_store: Store, api: TestClient) -> None:
    experiment = strode(sqlite_store)

    shown = Replay.model_validate_json(api.get(f"/experiments/{experiment}/replay").content)
    figure = api.get(f"/figures/gait?experiment={experiment}&format=json").json()

    assert shown.simulation is not None
    expected = 0.39 + 0.16 + 0.04 * np.sin(4 * np.array(shown.times_s) + 8)
    assert np.allclose(shown.simulation.heights_m, expected, atol=1e-3)
    assert np.mean(shown.simulation.speeds_m_s) == pytest.approx(0.3 * 0.3, rel=0.05)
    assert any("Mean height of head" in row[0] for row in figure["table"]["rows"])


def test_a_controller_in_a_loop_has_no_motion_to_take_to_the_bench(sqlite_store: Store, api: TestClient) -> None:
    spec = {"strategy": "simulated_fit", "robot": "strider", "engine": "puppet", "iterations": 1, "repetitions": 1}
    bench = spec | {"budget": "smoke", "reality": {"kind": "physical", "probes": "each"}}
    experiment = submit_one(sqlite_store, ExperimentSpec.model_validate(bench)).id
    (claim,) = execution.claim(sqlite_store, "me", 1)
    genome = robots["strider"]().known
    for step in (Tuned(0, (Simulator(frozen([1.0, 0.8, 0.0])),)), Transferred(0, genome, 0.4)):
        execution.record(sqlite_store, claim, step)
    execution.record_all(sqlite_store, [(claim, [Requested(2, 0, MeasurementKind.PROBE, genome)])])
    (request,) = api.get(f"/requests?experiment={experiment}").json()["items"]

    refused = {form: api.get(f"/requests/{request['id']}/motion?format={form}") for form in ("csv", "json", "ros2")}
    shown = api.get(f"/experiments/{experiment}/replay?iteration=0")

    assert {answer.status_code for answer in refused.values()} == {409}
    assert "observes the robot while it acts" in refused["csv"].json()["detail"]
    assert (shown.status_code, shown.json()["reality"]) == (200, None)
    assert motion_files.forms_of(robots["strider"](), genome) == ()


def test_velocities_are_not_written_as_the_positions_of_a_trajectory() -> None:
    robot = robots.create(PluginRef(name="quadruped"))
    assert motion_files.forms_of(robot, robot.known) == ("csv", "json", "ros2")
    assert isinstance(robot.motion(robot.known), Motion)

    first, *others = robot.world.joints
    robot.world = replace(robot.world, joints=(replace(first, motor=PDMotor("velocity", 1.0)), *others))

    assert motion_files.forms_of(robot, robot.known) == ("csv", "json")


def test_each_robot_with_a_body_has_shapes_as_it_stands_at_the_start(api: TestClient) -> None:
    bodies = {each["name"]: each["details"]["bodies"] for each in api.get("/catalogue").json()["robots"]}
    assert (bodies["strider"], bodies["toy_function"]) == (7, 0)

    answer = api.get("/catalogue/robots/strider/shapes")
    strider, quadruped = (RobotShapes.model_validate_json(each.content) for each in (answer, api.get(QUADRUPED)))

    assert (len(strider.positions_m[0]), len(strider.orientations[0])) == (21, 28)
    assert {shape.kind for shape in strider.shapes} == {"plane", "box", "capsule", "cylinder", "hull", "sphere"}
    assert strider.slope_rad == 0.12
    assert len(quadruped.contacts) == 4
    assert quadruped.scale == pytest.approx(0.8, abs=0.1)
    assert quadruped.middle_m[:2] == pytest.approx((0.0, 0.0), abs=0.01)
    tag = answer.headers["ETag"]
    assert api.get("/catalogue/robots/strider/shapes", headers={"If-None-Match": tag}).status_code == 304


def test_what_has_no_shapes_says_why(api: TestClient) -> None:
    nobody, toy = (api.get(f"/catalogue/robots/{name}/shapes") for name in ("nobody", "toy_function"))

    assert (nobody.status_code, toy.status_code) == (404, 404)
    assert "there is no robot 'nobody'; permitted: quadruped" in nobody.json()["detail"]
    assert "'toy_function' has no body" in toy.json()["detail"]
