"""The supervisor as a process: when it gives up, and when it takes what another has lost."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

from gaplab.services.experiments import submission
from gaplab.services.running import execution
from gaplab.services.settings import Settings
from gaplab.services.store.session import Store
from gaplab.workers.cluster import cluster
from gaplab.workers.supervisor import Supervisor
from tests.experiments import toy

DEADLINE_S = 180


def raylet_of(process: Any) -> Any:
    """The raylet that a process started, once it is there."""
    for path in Path(f"/proc/{process.pid}/task").glob("*/children"):
        for child in path.read_text().split():
            if b"/raylet\0" in Path(f"/proc/{child}/cmdline").read_bytes():
                return int(child)
    return None


def test_a_supervisor_whose_ray_died_ends_so_that_another_is_started(sqlite_url: str, tmp_path: Path) -> None:
    environment = os.environ | {"GAPLAB_DATABASE_URL": sqlite_url, "GAPLAB_WORKERS": "1"}
    log, deadline = tmp_path / "log", time.monotonic() + DEADLINE_S
    with log.open("wb") as output:
        command = [sys.executable, "-m", "gaplab.workers", "serve"]
        process = subprocess.Popen(command, env=environment, stdout=output, stderr=output)
    while b"ready for" not in log.read_bytes():
        assert time.monotonic() < deadline, log.read_text()
        time.sleep(0.1)

    os.kill(raylet_of(process), signal.SIGKILL)

    assert process.wait(DEADLINE_S) == 1, log.read_text()
    assert "Ray died on this machine" in log.read_text()


def test_work_goes_to_another_when_its_holder_was_silent_for_as_long_as_a_lease_is_set_to(store: Store) -> None:
    submission.submit_experiment(store, toy(repetitions=1))
    (claim,) = execution.claim(store, "silent", 1)
    patient, hasty = (Supervisor(store, lambda: 0, lease_s=lease_s) for lease_s in (60, 0.2))
    time.sleep(0.5)

    with cluster(Settings(workers=1)):  # for the sensitivity check that came with it
        patient.step()
        still_held = execution.heartbeat(store, [claim])
        time.sleep(0.5)
        hasty.step()

    assert still_held == (claim,)
    assert execution.heartbeat(store, [claim]) == ()
