"""A Ray of our own lets nobody in but us: it listens on loopback only, and asks for its token."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
import ray

from gaplab.services.settings import Settings
from gaplab.workers.__main__ import choose_authentication
from gaplab.workers.cluster import cluster
from gaplab.workers.errors import ClusterUnusable
from tests.waiting import LONGEST_S

OWN = """
import os, subprocess, sys
from gaplab.services.settings import Settings
from tests.processes import is_ours, processes
from gaplab.workers.__main__ import choose_authentication

choose_authentication(Settings())
import ray
from gaplab.workers.cluster import cluster
from gaplab.workers.expected import limit_prints

def listening():
    sockets = {}
    for pid, _ in processes():
        if is_ours(pid):
            for each in os.listdir(f"/proc/{pid}/fd"):
                try:
                    sockets[os.readlink(f"/proc/{pid}/fd/{each}")] = pid
                except OSError:
                    continue
    for family in ("tcp", "tcp6"):
        for line in open(f"/proc/net/{family}").read().splitlines()[1:]:
            _, local, _, state, *rest = line.split()
            if state == "0A" and f"socket:[{rest[5]}]" in sockets:
                yield local.partition(":")[0]

with cluster(Settings(workers=1)):
    @ray.remote
    def talk():
        limit_prints()
        for _ in range(3_000):
            print("x" * 9_000)
        print("y" * 50_000_000, file=sys.stderr)
        sys.stdout.write("z" * 50_000_000)

    ray.get(talk.remote())
    logs = ray._private.worker._global_node.get_logs_dir_path()
    print("LOGS", sum(each.stat().st_size for each in os.scandir(logs)) // 1_000_000)
    address = ray.get_runtime_context().gcs_address
    print("AT", address, *sorted(set(listening())))
    print("MONITORS", sum(b"monitor" in command for pid, command in processes() if is_ours(pid) and pid != os.getpid()))
    token = os.environ["RAY_AUTH_TOKEN"].encode()
    print("SHOWN" if any(token in command for _, command in processes()) else "SECRET")
    asking = f"GcsClient(address={address!r}).internal_kv_keys(b'', None); print('IN')"
    stranger = f"from ray._raylet import GcsClient; {asking}"
    without = {name: value for name, value in os.environ.items() if not name.startswith("RAY_")}
    for home in ({"RAY_AUTH_MODE": "disabled"}, {"RAY_AUTH_MODE": "token", "RAY_AUTH_TOKEN": "0" * 64}):
        tried = subprocess.run([sys.executable, "-c", stranger], env=without | home, capture_output=True, text=True)
        print("REFUSED" if "AuthenticationError" in tried.stderr and "IN" not in tried.stdout else tried, flush=True)
"""

LOOPBACK = {"0100007F", "0000000000000000FFFF00000100007F", "00000000000000000000000001000000"}


@pytest.mark.release
def test_our_own_ray_listens_on_loopback_and_refuses_a_stranger_whatever_the_environment_says(tmp_path: Path) -> None:
    root = Path(__file__).parents[2]
    inherited = {name: value for name, value in os.environ.items() if not name.startswith("RAY_")}

    done = subprocess.run(
        [sys.executable, "-c", OWN],
        env=inherited | {"PYTHONPATH": str(root), "RAY_AUTH_MODE": "disabled", "HOME": str(tmp_path)},
        capture_output=True,
        text=True,
        timeout=LONGEST_S,
        check=False,
    )

    assert done.returncode == 0, done.stderr
    said = dict(line.split(" ", 1) for line in done.stdout.splitlines() if line.startswith("AT "))
    address, *found = said["AT"].split()
    assert address.startswith("127.0.0.1:")
    assert len(found) > 0
    assert set(found) <= LOOPBACK
    assert done.stdout.count("REFUSED\n") == 2, done.stdout
    assert "SECRET\n" in done.stdout
    assert "MONITORS 0\n" in done.stdout  # two processes of Ray that would have nothing to do
    assert int(re.search(r"LOGS (\d+)", done.stdout)[1]) < 10, done.stdout
    assert not (tmp_path / ".ray").exists()  # where Ray keeps a token that everybody may read


def test_a_ray_of_our_own_that_would_ask_nobody_is_not_started(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("RAY_AUTH_MODE", "disabled")

    with pytest.raises(ClusterUnusable, match="RAY_AUTH_MODE"), cluster(Settings(workers=1)):
        pass


def test_a_ray_that_does_not_start_is_told_in_a_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    def late(**options: object) -> None:
        raise Exception("The current node timed out during startup.")  # as Ray does

    monkeypatch.delenv("RAY_AUTH_MODE", raising=False)
    monkeypatch.setattr(ray, "init", late)

    with pytest.raises(ClusterUnusable, match=r"Ray did not start on this machine: .+ timed out"), cluster(Settings()):
        pass


@pytest.mark.parametrize(
    ("address", "before", "after"),
    [
        (None, "disabled", "token"),
        (None, None, "token"),
        ("head:6379", None, "token"),
        ("head:6379", "disabled", "disabled"),
    ],
)
def test_only_a_cluster_of_others_may_go_without_a_token(address: str | None, before: str | None, after: str) -> None:
    environment = {"RAY_AUTH_TOKEN": "theirs"} | ({"RAY_AUTH_MODE": before} if before else {})

    choose_authentication(Settings(ray_address=address), environment)

    assert environment["RAY_AUTH_MODE"] == after
    assert (environment["RAY_AUTH_TOKEN"] == "theirs") == (address is not None)
