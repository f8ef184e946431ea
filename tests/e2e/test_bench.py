"""A robot in another process, which speaks only HTTP: driven, killed, restarted, and measured as the engine it is.

tests/integration/test_drivers.py has what `gaplab drive` does, without processes.
"""

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
from tests.waiting import LONGEST_S, wait_until

pytestmark = pytest.mark.release

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


@pytest.fixture(scope="module")
def service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LocalService]:
    with local_service(tmp_path_factory.mktemp("bench")) as found:
        yield found


def driving(
    service: LocalService, experiment: str, journal: Path, lease_s: float = 60.0, **settings: Any
) -> "subprocess.Popen[str]":
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
            str(lease_s),
            "--limit-s",
            str(LONGEST_S),
        ],
        env=os.environ | {SETTINGS: json.dumps({"engine": "mujoco"} | settings), "GAPLAB_URL": service.url},
        cwd=journal.parent,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )


def kill_after_a_repeat(service: LocalService, experiment: str, journal: Path) -> None:
    """Kill a driver whose take ends soon after it. On a busy machine one may lose so short a take; another tries."""
    drivers: list[subprocess.Popen[str]] = []

    def repeated() -> bool:
        if not drivers or drivers[-1].poll() is not None:
            drivers.append(driving(service, experiment, journal, lease_s=2.0, latency_s=0.2))
        return journal.exists() and b"repeat" in journal.read_bytes()

    wait_until(repeated)
    for each in drivers:
        each.kill()
        each.communicate()


def test_without_noise_the_simulators_equal_those_of_the_engine_to_the_bit_also_if_the_driver_is_killed(
    service: LocalService, tmp_path: Path
) -> None:
    physical = service.submit(SPEC | {"reality": {"kind": "physical", "probes": "each"}})
    engine = service.submit(SPEC)
    journal = tmp_path / "journal"
    kill_after_a_repeat(service, physical.id, journal)
    second = driving(service, physical.id, journal)
    told, _ = second.communicate(timeout=LONGEST_S)
    assert second.returncode == 0, told
    service.wait(engine.id)
    mine, theirs = service.simulators(physical.id), service.simulators(engine.id)
    columns = [name for name in theirs.columns if name not in {"experiment", "name"}]
    assert mine[columns].equals(theirs[columns])
    assert same(tuple(service.curve(physical.id)["mean"]), tuple(service.curve(engine.id)["mean"]))
