"""A robot in another process, which speaks only HTTP: driven, killed, restarted, and measured as the engine it is."""

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from gaplab.api.process.local_service import LocalService, local_service
from tests.experiments import same
from tests.pretended_robot import SETTINGS
from tests.waiting import wait_until

ROOT = Path(__file__).parents[2]
SPEC = {
    "strategy": "simulated_fit_and_informative",
    "robot": "quadruped",
    "engine": "mujoco",
    "iterations": 2,
    "repetitions": 1,
    "budget": {
        "preset": "smoke",
        "controller_evaluations": 30,
        "selection_evaluations": 30,
        "simulator_evaluations": 30,
    },
    "seed": 7,
}
LONGEST_S = 600.0


@pytest.fixture(scope="module")
def service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LocalService]:
    with local_service(tmp_path_factory.mktemp("bench")) as found:
        yield found


def driving(service: LocalService, experiment: str, journal: Path, **settings: Any) -> "subprocess.Popen[str]":
    """`gaplab drive` with the pretended robot."""
    driver = ROOT / "tests" / "pretended_robot.py"
    return subprocess.Popen(
        [
            sys.executable,
            "-m",
            "gaplab",
            "drive",
            experiment,
            "--driver",
            driver,
            "--journal",
            journal,
            "--lease-s",
            "2",
        ],
        env=os.environ | {SETTINGS: json.dumps({"engine": "mujoco"} | settings), "GAPLAB_URL": service.url},
        cwd=journal.parent,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )


def test_without_noise_the_simulators_equal_those_of_the_engine_to_the_bit_also_if_the_driver_is_killed(
    service: LocalService, tmp_path: Path
) -> None:
    physical = service.submit(SPEC | {"reality": {"kind": "physical", "probes": "each"}})
    engine = service.submit(SPEC)
    journal = tmp_path / "journal"
    first = driving(service, physical.id, journal, latency_s=0.2)
    wait_until(lambda: journal.exists() and b"repeat" in journal.read_bytes())
    first.kill()
    first.communicate()
    second = driving(service, physical.id, journal)
    told, _ = second.communicate(timeout=LONGEST_S)
    assert second.returncode == 0, told
    service.wait(engine.id)
    mine, theirs = service.simulators(physical.id), service.simulators(engine.id)
    columns = [name for name in theirs.columns if name not in {"experiment", "name"}]
    assert mine[columns].equals(theirs[columns])
    assert same(tuple(service.curve(physical.id)["mean"]), tuple(service.curve(engine.id)["mean"]))


def test_a_driver_that_hangs_is_stopped_and_told(service: LocalService, tmp_path: Path) -> None:
    physical = service.submit(SPEC | {"reality": {"kind": "physical", "probes": "each"}})
    driver = tmp_path / "hangs.py"
    driver.write_text(
        "import time\n"
        "class Driver:\n"
        "    def connect(self): pass\n"
        "    def run(self, motion): time.sleep(3600)\n"
        "    def stop(self): print('stopped', flush=True)\n"
    )
    arguments = [sys.executable, "-m", "gaplab", "drive", physical.id, "--driver", str(driver), "--limit-s", "0.5"]
    done = subprocess.run(
        arguments, env=os.environ | {"GAPLAB_URL": service.url}, cwd=tmp_path, capture_output=True, text=True
    )
    assert done.returncode == 1
    assert "took more than 0.5 s" in done.stderr
    assert "stopped" in done.stdout
    (request,) = service.bench.pending(physical.id)
    assert request.state == "open"
    service.cancel(physical.id)


@pytest.mark.parametrize(
    ("answer", "said"),
    [
        ("'fast'", "it must return the fitness"),
        ("float('nan')", "raise MeasurementFailed"),
        ("1/0", "ZeroDivisionError"),
    ],
)
def test_a_driver_that_answers_nonsense_sends_nothing(
    service: LocalService, tmp_path: Path, answer: str, said: str
) -> None:
    physical = service.submit(SPEC | {"reality": {"kind": "physical", "probes": "each"}})
    driver = tmp_path / "nonsense.py"
    driver.write_text(
        "class Driver:\n"
        "    def connect(self): pass\n"
        f"    def run(self, motion): return {answer}\n"
        "    def stop(self): pass\n"
    )
    arguments = [sys.executable, "-m", "gaplab", "drive", physical.id, "--driver", str(driver)]
    done = subprocess.run(
        arguments, env=os.environ | {"GAPLAB_URL": service.url}, cwd=tmp_path, capture_output=True, text=True
    )
    assert done.returncode == 1
    assert said in done.stderr
    (request,) = service.bench.pending(physical.id)
    assert request.answers == ()
    service.cancel(physical.id)
