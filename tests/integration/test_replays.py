"""Replays and predictions of what is stored, asked over HTTP."""

import os
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

import httpx2
import numpy as np
import pytest
from fastapi import FastAPI
from fastapi.testclient import TestClient
from sqlalchemy import update

import gaplab
from gaplab.api.app import create_app
from gaplab.api.clients.client import Client
from gaplab.schemas.records import MeasurementKind, SampleRead, SimulatorRead
from gaplab.schemas.replays import Replay
from gaplab.schemas.spec import ExperimentSpec
from gaplab.services.core.arrays import frozen
from gaplab.services.core.loop import repetition
from gaplab.services.core.types import Measured, Probed, Sample, Selected, Simulator, Transferred, Tuned
from gaplab.services.engines import engines
from gaplab.services.engines.pybullet.engine import PyBullet
from gaplab.services.plugins.folders import VARIABLE
from gaplab.services.replay.replays import predictions
from gaplab.services.running import execution
from gaplab.services.specs.assembly import setting
from gaplab.services.specs.resolution import resolve_experiment
from gaplab.services.store.lease import Requested
from gaplab.services.store.models import RequestRow
from gaplab.services.store.queries.experiments import get_experiment
from gaplab.services.store.session import Store
from gaplab.services.world.robots.quadruped import Quadruped
from tests.experiments import run, submit_one, toy
from tests.fakes import install
from tests.waiting import LONGEST_S, wait_until

UNTUNED, BEST = (0.5, 0.3), (1.1, 0.7)
HIDDEN = {"static_friction": 0.9, "dynamic_friction": 0.6}


@contextmanager
def running(store: Store) -> Iterator[FastAPI]:
    """A service, whose processes end afterwards."""
    app = create_app(store)
    yield app
    app.state.rollout_process.close()


@pytest.fixture(scope="module")
def service() -> Iterator[FastAPI]:
    """One for all tests: its processes take a while to start."""
    with running(Store("sqlite://")) as app:
        yield app


@pytest.fixture
def app(service: FastAPI, sqlite_store: Store) -> FastAPI:
    service.state.store = sqlite_store
    return service


@pytest.fixture
def api(app: FastAPI) -> TestClient:
    return TestClient(app)


def quadruped(**changes: Any) -> Any:
    small = {"strategy": "simulated_fit", "iterations": 2, "repetitions": 2, "budget": "smoke"}
    named = {"tunables": list(HIDDEN), "reality": {"parameters": HIDDEN}, "engine": "pybullet"}
    return ExperimentSpec.model_validate(small | named | changes)


@cache
def log_of_an_iteration() -> tuple[Any, ...]:
    """What a repetition records if one iteration is over, and the next is measured but not tuned."""
    setting_ = setting(resolve_experiment(quadruped()), 0)
    known = Quadruped().known
    moved = frozen(np.mod(known + 0.05, 1.0))

    def simulated(genome: Any, parameters: Any) -> Any:
        return float(setting_.simulate(genome[None], np.array([parameters]))[0, 0])

    there, then = setting_.reality(known), setting_.reality(moved)
    return (
        Tuned(0, (Simulator(frozen(UNTUNED)), Simulator(frozen(BEST)))),
        Transferred(0, known, simulated(known, UNTUNED)),
        Probed(0, there.fitness, 0.1, there.readings),
        Selected(1, moved),
        Measured(1, Sample(moved, *then)),
        Tuned(1, (Simulator(frozen(BEST)),)),
        Transferred(1, moved, simulated(moved, BEST)),
        Probed(1, then.fitness, 0.2, then.readings),
        Selected(2, known),
        Measured(2, Sample(known, *there)),
    )


def walked(store: Store, **changes: Any) -> Any:
    """Id, log and claim of an experiment with a part of a log."""
    submitted = submit_one(store, quadruped(**changes)).id
    (claim,) = execution.claim(store, "me", 1)
    for step in log_of_an_iteration():
        assert execution.record(store, claim, step)
    return submitted, log_of_an_iteration(), claim


def test_a_transferred_controller_walks_in_its_simulator_and_in_reality_as_it_was_recorded(
    sqlite_store: Store, api: Any
) -> None:
    experiment, log, _ = walked(sqlite_store)

    answer = api.get(f"/experiments/{experiment}/replay?iteration=1&kind=transfer")

    assert answer.status_code == 200
    assert len(answer.content) < 400_000
    shown = Replay.model_validate_json(answer.content)
    assert (shown.simulator, shown.counted_s, len(shown.times_s)) == (1, (0.5, 3.0), 151)
    assert shown.simulation.fitness == shown.simulation.recorded == log[6].fitness
    assert shown.reality.fitness == shown.reality.recorded == log[7].fitness
    assert shown.simulation.positions_m[0] == shown.reality.positions_m[0]
    assert shown.simulation.positions_m[-1] != shown.reality.positions_m[-1]
    for world in (shown.simulation, shown.reality):
        assert {len(row) for row in world.positions_m} == {3 * 13}
        assert {len(row) for row in world.orientations} == {4 * 13}
        assert len(world.heights_m) == len(world.speeds_m_s) == 151
        assert [feet[0][0] for feet in world.contacts] == [0, 0, 0, 0]  # it stands, then steps
        assert all(len(feet) > 2 for feet in world.contacts)
        counted = [speed for time, speed in zip(shown.times_s, world.speeds_m_s, strict=True) if time >= 0.5]
        assert np.mean(counted) == pytest.approx(world.fitness, rel=0.2)


def test_simulate_gives_what_the_service_stores_and_shows(sqlite_store: Store, api: Any) -> None:
    experiment, log, _ = walked(sqlite_store)
    spec = api.get(f"/experiments/{experiment}").json()["spec"]
    samples = [SampleRead(**each) for each in api.get(f"/experiments/{experiment}/samples?kind=sample").json()["items"]]
    tuned = SimulatorRead(**api.get(f"/experiments/{experiment}/simulators").json()["items"][-1])
    shown = Replay.model_validate_json(api.get(f"/experiments/{experiment}/replay?iteration=1&kind=transfer").content)

    found = gaplab.simulate(spec, [sample.genome for sample in samples], [HIDDEN, tuned])
    poses = found.trajectory(genome=0, simulator=1)

    assert found.fitness[:, 0].tolist() == [sample.fitness for sample in samples]
    assert tuned.parameters == dict(zip(HIDDEN, BEST, strict=True))
    assert found.fitness[0, 1] == log[6].fitness == shown.simulation.fitness
    for row, sample in zip(found.readings, samples, strict=True):
        stored = np.array(sample.readings).reshape(row[0].shape) * found.robot.sensors.noises
        assert np.array_equal(row[0], stored)
    assert found.robot.sensors.names == shown.readings.sensors
    assert tuple(poses.times_s) == shown.times_s
    for places, shown_places, digits in (
        (poses.positions_m, shown.simulation.positions_m, 3),
        (poses.orientations, shown.simulation.orientations, 4),
    ):
        assert np.array_equal(np.round(places.swapaxes(0, 1).reshape(151, -1), digits), shown_places)


def test_a_replay_has_what_the_sensors_said_in_both_worlds(sqlite_store: Store, api: Any) -> None:
    experiment, log, claim = walked(sqlite_store)
    sensors = Quadruped().sensors
    simulated = setting(claim.spec, 0).sense(log[6].genome[None], np.array([BEST]))[0, 0, 1:]

    shown = Replay.model_validate_json(api.get(f"/experiments/{experiment}/replay?iteration=1&kind=transfer").content)
    figure = api.get(f"/figures/readings?experiment={experiment}&iteration=1&kind=transfer&format=json").json()

    found = shown.readings
    assert (found.sensors, found.times_s) == (sensors.names, tuple(sensors.times_s))
    assert np.allclose(found.reality, sensors.values(log[7].readings).T, atol=1e-6)
    assert np.allclose(found.simulation, sensors.values(simulated).T, atol=1e-6)
    assert figure["caption"].startswith("Noise of the sensors")
    assert [row[0] for row in figure["table"]["rows"]] == list(sensors.names)


def test_a_controller_that_a_robot_on_a_bench_is_to_run_walks_in_its_simulator(sqlite_store: Store, api: Any) -> None:
    bench = quadruped(reality={"kind": "physical", "probes": "each"})
    experiment = submit_one(sqlite_store, bench).id
    (claim,) = execution.claim(sqlite_store, "me", 1)
    known = Quadruped().known
    execution.record(sqlite_store, claim, Tuned(0, (Simulator(frozen(UNTUNED)),)))
    execution.record(sqlite_store, claim, Transferred(0, known, 0.5))
    assert api.get(f"/experiments/{experiment}/replay?iteration=0").status_code == 409
    asked = Requested(2, 0, MeasurementKind.PROBE, known)
    assert execution.record_all(sqlite_store, [(claim, [asked])]) == ()

    shown = Replay.model_validate_json(api.get(f"/experiments/{experiment}/replay?iteration=0").content)

    assert len(shown.simulation.positions_m) == len(shown.times_s)
    assert shown.reality is None
    with sqlite_store.transaction() as session:
        session.execute(update(RequestRow).values(genome=[0.0] * len(known)))  # a correction led to another controller
    other = Replay.model_validate_json(api.get(f"/experiments/{experiment}/replay?iteration=0").content)
    assert other.simulation.positions_m != shown.simulation.positions_m


def predicted(api: TestClient, experiment: str) -> Any:
    """Predictions, when none is pending any more."""
    address = f"/experiments/{experiment}/predictions"
    return wait_until(lambda: None if (found := api.get(address).json())["pending"] else found)


class Lab(PyBullet):
    """Hardware, as far as gaplab knows; the process that computes replays does not have it."""

    name = "lab"
    repeatable = False

    def rollout(self, *_: Any) -> Any:
        pytest.fail("it moved")


def test_no_replay_moves_hardware(sqlite_store: Store, api: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    install(monkeypatch, engines, Lab)
    experiment, log, _ = walked(sqlite_store, reality={"engine": "lab", "parameters": HIDDEN})

    replay = api.get(f"/experiments/{experiment}/replay?iteration=1&kind=transfer")
    gait = api.get(f"/figures/gait?experiment={experiment}&iteration=1&kind=transfer&format=json")

    assert (replay.json()["reality"], replay.json()["simulation"]["fitness"]) == (None, log[6].fitness)
    assert gait.status_code == 200, gait.text


def test_a_sample_is_shown_in_the_simulator_that_it_was_selected_in_or_in_any_other(
    sqlite_store: Store, api: Any
) -> None:
    experiment, log, _ = walked(sqlite_store)
    address = f"/experiments/{experiment}/replay?kind=sample&iteration=1"

    own, after = api.get(address).json(), api.get(f"{address}&simulator=1").json()

    assert (own["simulator"], after["simulator"]) == (0, 1)
    assert own["reality"] == after["reality"]
    assert own["reality"]["fitness"] == log[4].sample.fitness
    assert own["simulation"]["recorded"] is None
    assert own["simulation"]["fitness"] != after["simulation"]["fitness"] == log[6].fitness


def test_what_is_not_there_is_not_found_and_what_is_not_yet_there_is_a_conflict(sqlite_store: Store, api: Any) -> None:
    experiment, _, _ = walked(sqlite_store)
    there = f"/experiments/{experiment}/replay"

    refused = {
        "/experiments/no-such/replay": (404, "no-such"),
        f"{there}?repetition=2": (404, "no repetition 2; permitted: from 0 to 1"),
        f"{there}?iteration=3": (404, "no iteration with a transfer 3; permitted: from 0 to 2"),
        f"{there}?kind=sample&iteration=0": (404, "no iteration with a sample 0; permitted: from 1 to 2"),
        f"{there}?simulator=3": (404, "no tuned simulator of iteration 3"),
        f"{there}?iteration=2": (409, "transferred controller of iteration 2 of repetition 0"),
        f"{there}?repetition=1": (409, "has not been measured in reality yet"),
        f"{there}?kind=sample&iteration=2&simulator=2": (409, "no simulator of iteration 2"),
        f"{there}?kind=walk": (422, "kind"),
    }

    for address, (status, words) in refused.items():
        answer = api.get(address)
        assert (answer.status_code, words in answer.json()["detail"]) == (status, True), (address, answer.json())


def test_a_robot_without_a_body_has_nothing_to_show(sqlite_store: Store, api: Any) -> None:
    experiment = submit_one(sqlite_store, toy(repetitions=1)).id
    run(sqlite_store, *execution.claim(sqlite_store, "me", 1))  # type: ignore[arg-type]

    answer = api.get(f"/experiments/{experiment}/replay")

    assert answer.status_code == 422
    assert answer.json()["detail"].startswith("id: the robot 'toy_function' has no body")


def test_the_direct_baseline_is_seen_in_reality_alone(sqlite_store: Store, api: Any) -> None:
    experiment = submit_one(sqlite_store, quadruped(strategy="direct")).id
    (claim,) = execution.claim(sqlite_store, "me", 1)
    known = Quadruped().known
    real = setting(claim.spec, 0).reality(known).fitness
    for step in (Tuned(0, (Simulator(frozen(BEST)),)), Transferred(0, known, real), Probed(0, real, real)):
        execution.record(sqlite_store, claim, step)

    shown = api.get(f"/experiments/{experiment}/replay").json()

    assert (shown["simulation"], shown["simulator"]) == (None, None)
    assert shown["reality"]["fitness"] == real
    assert api.get(f"/experiments/{experiment}/replay?simulator=0").status_code == 404


def test_reality_that_an_archive_left_out_is_not_shown(sqlite_store: Store, api: Any) -> None:
    experiment, _, _ = walked(sqlite_store)
    with sqlite_store.transaction() as session:
        row = get_experiment(session, experiment)
        row.spec = row.spec | {"reality": row.spec["reality"] | {"parameters": dict.fromkeys(HIDDEN)}}

    shown = api.get(f"/experiments/{experiment}/replay").json()

    assert shown["reality"] is None
    assert shown["simulation"]["fitness"] > 0


def test_physics_that_fails_has_no_frames(sqlite_store: Store, api: Any) -> None:
    experiment, _, _ = walked(sqlite_store)
    with sqlite_store.transaction() as session:
        row = get_experiment(session, experiment)
        row.spec = row.spec | {"reality": row.spec["reality"] | {"parameters": HIDDEN | {"restitution": 1e200}}}

    shown = api.get(f"/experiments/{experiment}/replay").json()["reality"]

    assert (shown["fitness"], shown["positions_m"], shown["contacts"]) == (None, [], [])
    assert len(shown["shapes"]) == 18


def test_the_gait_is_drawn(sqlite_store: Store, api: Any) -> None:
    experiment, _, _ = walked(sqlite_store)
    address = f"/figures/gait?experiment={experiment}&iteration=1&kind=sample"

    shown = api.get(f"{address}&format=json").json()

    assert {each["name"] for each in shown["figure"]["data"]} >= {"In simulation", "In reality"}
    assert not shown["empty"]
    assert api.get(f"{address}&format=svg").status_code == 200
    assert api.get(f"/figures/gait?experiment={experiment}&repetition=1").status_code == 409


def test_a_crash_of_physics_never_ends_the_api(sqlite_store: Store, app: Any, api: Any) -> None:
    experiment, _, _ = walked(sqlite_store)
    first = api.get(f"/experiments/{experiment}/replay")
    os.kill(app.state.rollout_process.pid, signal.SIGKILL)

    again = api.get(f"/experiments/{experiment}/replay?iteration=1")
    while again.status_code == 503:  # asked in the moment of its death
        assert again.json()["type"] == "urn:gaplab:problem:engine-interrupted"
        again = api.get(f"/experiments/{experiment}/replay?iteration=1")

    assert (first.status_code, again.status_code) == (200, 200)


def test_what_was_computed_once_is_remembered(sqlite_store: Store) -> None:
    experiment, _, _ = walked(sqlite_store)
    with running(sqlite_store) as app:
        api = TestClient(app)
        first = api.get(f"/experiments/{experiment}/replay").content
        app.state.rollout_process.close()

        assert api.get(f"/experiments/{experiment}/replay").content == first
        other = api.get(f"/experiments/{experiment}/replay?iteration=0")
        assert (other.status_code, other.headers["Retry-After"]) == (503, "5")


WALKER = """
from gaplab.services.world.robots.quadruped import Quadruped


class Walker(Quadruped):
    name = "walker"

    def fitness(self, trajectory):
        return 1 * super().fitness(trajectory)
"""


def test_replays_and_predictions_follow_an_edit_of_a_plug_in_from_the_next_start(
    sqlite_store: Store, put: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(VARIABLE, str(put(walker=WALKER)))
    experiment, log, _ = walked(sqlite_store, robot="walker")

    def computed(app: FastAPI) -> tuple[float, float]:
        api = TestClient(app)
        replay = api.get(f"/experiments/{experiment}/replay?iteration=1").json()
        prediction = predicted(api, experiment)["items"][0]
        return replay["simulation"]["fitness"], prediction["simulated_after"]

    with running(sqlite_store) as app:
        before = computed(app)
    put(walker=WALKER.replace("1 *", "2 *"))
    with running(sqlite_store) as app:
        after = computed(app)

    assert (before, after) == ((log[6].fitness,) * 2, (2 * log[6].fitness,) * 2)


def test_without_an_iteration_the_last_measured_controller_is_replayed(sqlite_store: Store, api: Any) -> None:
    experiment, _, _ = walked(sqlite_store)

    for kind, iteration in (("transfer", 1), ("sample", 2)):
        left_out = api.get(f"/experiments/{experiment}/replay?kind={kind}")
        named = api.get(f"/experiments/{experiment}/replay?kind={kind}&iteration={iteration}")
        assert left_out.json() == named.json()


def test_predictions_are_of_the_simulators_before_and_after_a_sample(sqlite_store: Store, app: Any) -> None:
    experiment = submit_one(sqlite_store, toy(repetitions=2)).id
    errors = {}
    for claim in execution.claim(sqlite_store, "me", 2):
        for step in repetition(setting(claim.spec, claim.number)):
            assert execution.record(sqlite_store, claim, step)
            if isinstance(step, Tuned):
                errors[claim.number, step.iteration] = step.simulators[0].squared_error

    found = predictions(sqlite_store, app.state.rollout_process, experiment, seconds=LONGEST_S)

    assert (found.pending, found.unit) == (0, "m/s")
    assert [(each.repetition, each.iteration) for each in found.items] == [(0, 1), (0, 2), (1, 1), (1, 2)]
    for each in found.items:
        if each.iteration == 1:  # it was tuned on this one sample
            assert (each.simulated_after - each.fitness) ** 2 == errors[each.repetition, 1]
        assert abs(each.simulated_after - each.fitness) <= abs(each.simulated_before - each.fitness) + 1e-9


def test_samples_that_no_tuning_sees_have_no_predictions(sqlite_store: Store, app: Any) -> None:
    experiment = submit_one(sqlite_store, toy(repetitions=1, iterations=4, held_out=0.5)).id
    (claim,) = execution.claim(sqlite_store, "me", 1)
    for step in repetition(setting(claim.spec, 0)):
        assert execution.record(sqlite_store, claim, step)

    found = predictions(sqlite_store, app.state.rollout_process, experiment, seconds=LONGEST_S)

    assert [each.iteration for each in found.items] == [1, 3]
    assert (found.pending, found.left_out) == (0, 0)


def test_an_experiment_without_iterations_shows_what_samples_from_before_gave(
    sqlite_store: Store, app: Any, api: Any
) -> None:
    known = [{"genome": [gene], "values": [gene + 0.1]} for gene in (0.2, 0.5, 0.8)]
    reality = {"kind": "physical", "samples": known}
    experiment = submit_one(sqlite_store, toy(repetitions=1, iterations=0, held_out=0.4, reality=reality)).id
    (claim,) = execution.claim(sqlite_store, "me", 1)
    for step in repetition(setting(claim.spec, 0)):
        assert execution.record(sqlite_store, claim, step)

    found = predictions(sqlite_store, app.state.rollout_process, experiment, seconds=LONGEST_S)
    forward = httpx2.MockTransport(lambda asked: httpx2.Response(200, json=api.get(asked.url.raw_path.decode()).json()))
    with Client("http://127.0.0.1:1", transport=forward) as client:
        best = client.best_simulator(experiment)

    assert best is not None
    assert best.iteration == 0
    assert [(each.iteration, each.simulated_before, each.fitness) for each in found.items] == [
        (0, None, 0.2 + 0.1),
        (0, None, 0.5 + 0.1),
    ]
    errors = [(each.simulated_after - each.fitness) ** 2 for each in found.items]
    assert sum(errors) == pytest.approx(best.squared_error)
    caption = api.get(f"/figures/predictions?format=json&experiment={experiment}").json()["caption"]
    assert f"tuning on it: root-mean-square error {best.error:.2g}\N{NO-BREAK SPACE}m/s" in caption
    remarks = api.get(f"/experiments/{experiment}/misfit").json()["remarks"]
    assert remarks[0] == "samples from before the experiment: 2 tuned on, 1 held out"


def test_predictions_take_a_while_and_are_pending_meanwhile(sqlite_store: Store, app: Any) -> None:
    experiment, log, claim = walked(sqlite_store)
    execution.record(sqlite_store, claim, Tuned(2, (Simulator(frozen(BEST)),)))

    first = predictions(sqlite_store, app.state.rollout_process, experiment, seconds=0)
    second = predictions(sqlite_store, app.state.rollout_process, experiment, seconds=0)

    assert (first.pending, len(first.items), second.pending, len(second.items)) == (1, 1, 0, 2)
    assert second.items[0] == first.items[0]
    assert first.items[0].simulated_after == log[6].fitness
    assert second.items[1].simulated_before == second.items[1].simulated_after  # the same simulator


def test_samples_for_which_there_is_no_room_are_left_out_and_not_waited_for(
    sqlite_store: Store, app: Any, api: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    experiment, _, claim = walked(sqlite_store)
    execution.record(sqlite_store, claim, Tuned(2, (Simulator(frozen(BEST)),)))
    monkeypatch.setattr("gaplab.services.replay.replays.MOST_KEPT", 1)

    found = predicted(api, experiment)
    figure = api.get(f"/figures/predictions?experiment={experiment}&format=json").json()

    assert [each["iteration"] for each in found["items"]] == [1]
    assert (found["pending"], found["left_out"]) == (0, 1)
    assert "of later repetitions left out" in figure["caption"]


def test_samples_that_nothing_is_tuned_on_yet_have_no_prediction(sqlite_store: Store, api: Any) -> None:
    experiment, _, _ = walked(sqlite_store)

    shown = predicted(api, experiment)

    assert [each["iteration"] for each in shown["items"]] == [1]
    assert api.get("/experiments/no-such/predictions").status_code == 404
