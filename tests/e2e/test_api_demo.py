"""The demo on tiny studies, with everything real: it ends in order when interrupted, and goes on where it was."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from gaplab.services.store.sqlite_file import url_of
from tests.waiting import wait_until

pytestmark = pytest.mark.release

TINY = {"robot": "toy_function", "strategies": ["simulated_fit", "random", "direct"], "iterations": 3, "repetitions": 4}
TINY_BUDGET = {"controller_evaluations": 40, "selection_evaluations": 40, "simulator_evaluations": 40}


@pytest.fixture
def specs(tmp_path: Path) -> Path:
    folder = tmp_path / "specs"
    folder.mkdir()
    for name in ("toy", "quadruped"):
        (folder / f"{name}.json").write_text(json.dumps(TINY | {"name": name, "budget": TINY_BUDGET}))
    return folder


def demo(folder: Path, specs: Path) -> "subprocess.Popen[str]":
    script = (
        "import sys; from pathlib import Path\n"
        "from gaplab.api.clients.screen import console\n"
        "from gaplab.api.commands.demo import run\n"
        "run(Path(sys.argv[1]), console(), Path(sys.argv[2]))"
    )
    return subprocess.Popen(
        [sys.executable, "-c", script, str(folder), str(specs)],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )


def left_running(folder: Path) -> list[str]:
    """Processes that have the demo's database in their environment."""
    mark = f"GAPLAB_DATABASE_URL=sqlite:///{folder / 'gaplab.db'}".encode()
    found = []
    for path in Path("/proc").glob("[0-9]*"):
        try:
            if mark in (path / "environ").read_bytes().split(b"\0"):
                found.append((path / "cmdline").read_bytes().replace(b"\0", b" ").decode())
        except OSError:
            continue
    return found


def test_a_demo_killed_outright_leaves_nothing_running_and_goes_on_when_run_again(tmp_path: Path, specs: Path) -> None:
    folder = tmp_path / "my [bold] demo :house:"
    first = demo(folder, specs)
    wait_until(lambda: (folder / "demo.json").exists() or first.poll() is not None)
    assert first.poll() is None, first.communicate()
    os.kill(first.pid, signal.SIGKILL)
    first.communicate()
    wait_until(lambda: not left_running(folder), otherwise=lambda: left_running(folder))

    second = demo(folder, specs)
    said, _ = second.communicate(timeout=600)

    assert second.returncode == 0, said
    assert "continuing study" in said
    assert "toy: 12 of 12 repetitions" in said
    assert "evolved in reality itself" in said
    assert "real-world evaluation" in said
    (serve,) = [line for line in said.splitlines() if line.endswith("gaplab serve")]
    assert serve.startswith(f"  GAPLAB_DATABASE_URL='{url_of(folder / 'gaplab.db')}' ")
    assert subprocess.run(["sh", "-c", f"{serve.removesuffix('serve')}--version"], check=False).returncode == 0
    for name in ("toy", "quadruped"):
        assert f"  {folder / name}.html" in said.splitlines()
        assert (folder / f"{name}.html").read_text().startswith("<!doctype html>")
        assert "<svg" in (folder / f"{name}.svg").read_text()
    assert not (folder / "demo.json").exists()
    assert left_running(folder) == []
