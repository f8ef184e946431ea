"""Killed at any named point, the next process ends with the results of one that was never killed.

For every change, each point is drawn before or after, on SQLite; for a release it is both, on both databases.
"""

import subprocess
import sys
from pathlib import Path

import pytest

from tests.conftest import Postgres

ROOT = Path(__file__).parents[2]


def survived(folder: Path, *arguments: str) -> str:
    """What the kill matrix says; its files are in memory, apart from those of other tests."""
    place = folder / "kill"
    place.mkdir(exist_ok=True)
    command = [sys.executable, "-W", "error", "-m", "tests.kill_matrix", "--kills", "1", "--folder", str(place)]

    done = subprocess.run([*command, *arguments], cwd=ROOT, capture_output=True, text=True, check=False)

    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_a_kill_at_each_point_leaves_no_trace_in_the_results(folder: Path) -> None:
    assert "11 of 11" in survived(folder, "--only", "SQLite", "--once")


@pytest.mark.release
def test_no_kill_leaves_a_trace_in_the_results(postgres: Postgres, folder: Path) -> None:
    assert "44 of 44" in survived(folder, "--postgres", postgres.url("postgres"))
