"""What the demo prints can be typed where it was started."""

import sys
from pathlib import Path

import pytest

from gaplab.api.commands.demo import command_here


@pytest.fixture
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The `gaplab` of an installation in a folder with a space in its name, where the shell is."""
    command = tmp_path / "a clone" / ".venv" / "bin" / "gaplab"
    command.parent.mkdir(parents=True)
    command.touch(mode=0o755)
    monkeypatch.setattr(sys, "executable", str(command.with_name("python3.11")))
    monkeypatch.chdir(tmp_path / "a clone")
    return command


def test_it_is_called_by_its_name_if_the_path_finds_it(installed: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(installed.parent))

    assert command_here() == "gaplab"


def test_else_it_is_called_by_its_place(installed: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))

    assert command_here() == ".venv/bin/gaplab"

    monkeypatch.chdir(tmp_path / "a clone" / ".venv")
    assert command_here() == "bin/gaplab"
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    monkeypatch.chdir(elsewhere)
    assert command_here() == f"'{installed}'"


def test_another_one_that_the_path_finds_is_not_this_one(
    installed: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    other = tmp_path / "bin" / "gaplab"
    other.parent.mkdir()
    other.touch(mode=0o755)
    monkeypatch.setenv("PATH", str(other.parent))

    assert command_here() == ".venv/bin/gaplab"
