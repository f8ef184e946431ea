"""What a person takes home from an experiment: files that are complete, the same each time, and can be used."""

import io
import json
from collections.abc import Iterator
from dataclasses import replace
from html import unescape
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import numpy as np
import pytest
import yaml
from sqlalchemy import update

import gaplab
from gaplab import Client, ServiceError
from gaplab.services.core.arrays import frozen
from gaplab.services.core.types import Cost, Measured, Probed, Sample, Selected, Simulator, Step, Transferred, Tuned
from gaplab.services.engines.mujoco.engine import MuJoCo
from gaplab.services.measuring import attachments
from gaplab.services.replay.process import RolloutProcess
from gaplab.services.running import execution
from gaplab.services.store.models import AnswerRow
from gaplab.services.store.session import Store
from gaplab.services.world.robots.quadruped import Quadruped
from tests.experiments import run, submit_one, toy
from tests.integration.test_bench import compute, measure, pending
from tests.integration.test_bench_safety import ask
from tests.integration.test_client import InProcess

WALKING = {"robot": "quadruped", "engine": "mujoco", "repetitions": 1, "iterations": 1}


@pytest.fixture(scope="module")
def rollouts() -> Iterator[RolloutProcess]:
    """One for all: each compiles MuJoCo's law."""
    found = RolloutProcess()
    yield found
    found.close()


@pytest.fixture
def client(store: Store, rollouts: RolloutProcess) -> Client:
    return Client("http://test", transport=InProcess(store, rollouts), pauses_s=(0.0, 0.0, 0.0))


def walk(seed: int) -> Any:
    return frozen(np.random.default_rng(seed).random(24))


def readings() -> Any:
    return frozen([float("nan"), *np.arange(49) / 7])


def log() -> Iterator[Step]:
    """A repetition with one sample, which is the fittest."""
    yield Tuned(0, (Simulator(frozen([1.0, 0.5])),))
    yield Transferred(0, walk(0), 0.3, Cost(10))
    yield Probed(0, 0.1, 0.1, readings())
    yield Selected(1, walk(1), Cost(10))
    yield Measured(1, Sample(walk(1), 0.4, readings()))
    interval = frozen([[0.8, 1.0], [0.2, 0.6]])
    yield Tuned(1, (Simulator(frozen([0.9, 0.4]), 0.01, interval),), Cost(10))
    yield Transferred(1, walk(2), 0.3, Cost(10))
    yield Probed(1, float("nan"), 0.4)


def walked(store: Store) -> str:
    experiment = submit_one(store, toy(**WALKING))
    (claim,) = execution.claim(store, "here", 1)
    run(store, claim, log())
    return experiment.id


def files(content: bytes) -> dict[str, str]:
    with ZipFile(io.BytesIO(content)) as archive:
        return {name: archive.read(name).decode() for name in archive.namelist()}


def test_everything_is_in_the_zip_and_can_be_used(store: Store, client: Client, tmp_path: Path) -> None:
    id_ = walked(store)
    found = files(client.take_home(id_, tmp_path / "home" / "walk.zip").read_bytes())

    assert set(found) == {
        *("report.html", "README.txt", "verdict.txt", "spec.json", "provenance.json", "controller.json"),
        *("samples.csv", "samples.json", "motion.csv", "motion.json", "motion.ros2.yaml", "simulator.json"),
        *("expected/0-0-probe.csv", "expected/0-1-sample.csv", "expected/fitness.json"),
        *("tuned.xml", "expected/plain_mujoco_m.json"),
    }
    controller = json.loads(found["controller.json"])
    assert (controller["fitness"], controller["unit"], controller["kind"]) == (0.4, "m/s", "sample")
    assert controller["genome"] == walk(1).tolist()
    assert len(json.loads(found["motion.json"])["actuators"]) == 12
    assert len(yaml.safe_load(found["motion.ros2.yaml"])["joint_names"]) == 12
    simulator = json.loads(found["simulator.json"])
    assert simulator["samples"] == 1
    robot = Quadruped()
    motion, material = robot.motion(walk(1)), replace(robot.world.material, static_friction=0.9, dynamic_friction=0.4)
    path = MuJoCo().record(replace(robot.world, material=material), motion, motion.observe_s[-1:])
    assert json.loads(found["expected/fitness.json"])["0-1-sample"] == float(robot.fitness(path.trajectory))
    assert 'friction="0.4"' in found["tuned.xml"]
    assert 0 < json.loads(found["expected/plain_mujoco_m.json"])["0-1-sample"] < 10
    last = [float(cell) for cell in found["expected/0-1-sample.csv"].splitlines()[-1].split(",")]
    assert last == pytest.approx([motion.observe_s[-1], *path.poses[0]], abs=1e-7)
    first, second = simulator["tunables"]
    assert (first["name"], first["value"], first["interval"]) == ("static_friction", 0.9, [0.8, 1.0])
    assert second["bounds"] == [0.0, pytest.approx(second["bounds"][1])]
    assert simulator["error"] == pytest.approx(0.1)
    assert client.estimate(json.loads(found["spec.json"])).rollouts > 0
    assert found["spec.json"].strip() in unescape(found["report.html"])
    assert found["verdict.txt"]
    assert 'client.bench.check_samples("samples.csv", ROBOT)' in found["README.txt"]
    assert "`reality.samples` takes samples.csv" in found["README.txt"]


def test_the_samples_can_be_the_samples_of_another_spec(store: Store, client: Client, tmp_path: Path) -> None:
    found = files(client.take_home(walked(store), tmp_path / "walk.zip").read_bytes())
    table = tmp_path / "samples.csv"
    table.write_text(found["samples.csv"])
    samples = gaplab.read_samples(table, "quadruped")

    assert [each["values"] for each in samples] == [[0.1], [0.4]]
    assert samples[1]["genome"] == walk(1).tolist()
    assert samples[1]["readings"][0][0][0] is None
    assert samples[1]["readings"][0][0][1] == 0.0
    noises = [0.02, 0.02, 0.005, 0.005, 0.005]
    told = np.array(samples[1]["readings"][0], dtype=float) / noises
    assert told.ravel()[1:] == pytest.approx(readings()[1:])


def test_the_same_results_give_the_same_bytes(store: Store, client: Client, tmp_path: Path) -> None:
    id_ = walked(store)
    first, second = (client.take_home(id_, tmp_path / name).read_bytes() for name in ("a.zip", "b.zip"))
    assert first == second


def test_the_report_says_what_was_found(store: Store, client: Client, tmp_path: Path) -> None:
    found = files(client.take_home(walked(store), tmp_path / "walk.zip").read_bytes())
    report = unescape(found["report.html"])

    for said in (
        "The best measured controller",
        "The tuned simulator",
        "0.8 to 1",
        "Measurements",
        "Provenance",
        "0.4",
    ):
        assert said in report
    assert "Quadruped, simulated in MuJoCo, 2\xa0measurements, 1\xa0completed repetition" in report
    assert ", ".join(f"{gene:.6g}" for gene in walk(1)) in report
    assert all(sentence in report for sentence in found["verdict.txt"].strip().split("\n\n"))
    assert "Static friction" in report


def test_repeats_of_a_bench_are_taken_home(store: Store, client: Client, tmp_path: Path) -> None:
    reality = {"kind": "physical", "repeats": 2, "probes": "each"}
    experiment = submit_one(store, toy(repetitions=1, iterations=1, reality=reality))
    with pytest.raises(ServiceError, match="measured and tuned nothing yet"):
        client.take_home(experiment.id, tmp_path / "home.zip")
    compute(store)
    while items := pending(store):
        measure(store, items[0], 0.4, 0.5)
        compute(store)
    found = files(client.take_home(experiment.id, tmp_path / "home.zip").read_bytes())

    assert "motion.csv" not in found
    assert json.loads(found["controller.json"])["standard_error"] == pytest.approx(0.05)
    assert found["samples.csv"].splitlines()[0] == "gene_0,value_1,value_2"
    assert "Repeats of one measurement differ by 0.0707 m/s" in found["verdict.txt"]
    assert "± 0.05 (standard error)" in found["report.html"]


def test_samples_from_before_are_taken_home(store: Store, client: Client, tmp_path: Path) -> None:
    reality = {"kind": "physical", "samples": [{"genome": [0.2], "values": [0.3]}], "probes": "never"}
    experiment = submit_one(store, toy(repetitions=1, iterations=0, reality=reality))
    compute(store)

    found = files(client.take_home(experiment.id, tmp_path / "home.zip").read_bytes())

    assert found["samples.csv"].splitlines() == ["gene_0,value", "0.2,0.3"]


def test_readings_of_all_repeats_and_traces_are_taken_home(store: Store, client: Client, tmp_path: Path) -> None:
    reality = {"kind": "physical", "repeats": 2, "probes": "each"}
    experiment = submit_one(store, toy(**WALKING, reality=reality))
    ask(store)
    said = [[[0.1 * repeat, None, 0.2, 0.3, 0.4]] * 10 for repeat in (1, 2)]
    client.bench.answer(pending(store)[0].id, [0.4, 0.5], readings=said)
    trace = attachments.store_attachment(store, b"time_s,x\n", "run.csv", "text/csv").id
    recorded = [{"attachment": trace, "lag_s": 1.0, "match": None}]
    store.write(lambda session: session.execute(update(AnswerRow).values(traces=recorded)))

    found = files(client.take_home(experiment.id, tmp_path / "home.zip").read_bytes())
    table = tmp_path / "samples.csv"
    table.write_text(found["samples.csv"])
    (sample,) = gaplab.read_samples(table, "quadruped")

    assert (sample["values"], sample["readings"]) == ([0.4, 0.5], said)
    assert found["traces/0-0-probe-1.csv"] == "time_s,x\n"


def test_an_experiment_without_results_or_of_another_id_says_so(store: Store, client: Client, tmp_path: Path) -> None:
    experiment = submit_one(store, toy())
    with pytest.raises(ServiceError, match="nothing yet"):
        client.take_home(experiment.id, tmp_path / "home.zip")
    with pytest.raises(ServiceError, match="no study or experiment"):
        client.take_home("absent", tmp_path / "home.zip")
    with pytest.raises(ValueError, match=r"permitted: \.zip"):
        client.take_home(experiment.id, tmp_path / "home.pdf")
