"""Killed at any named point, the next process ends with the results of one that was never killed."""

import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize("database", ["SQLite", "Postgres"])
def test_no_kill_leaves_a_trace_in_the_results(database: Any, postgres: Any, folder: Path) -> None:
    place = folder / f"kill-{database}"  # in memory, and apart from other tests' files
    place.mkdir()
    command = [sys.executable, "-W", "error", "-m", "tests.kill_matrix", "--kills", "1", "--only", database]

    done = subprocess.run(
        [*command, "--postgres", postgres.url("postgres"), "--folder", str(place)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )

    sys.stdout.write(done.stdout)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "22 of 22" in done.stdout
