"""What the demo prints can be typed where it was started."""

from collections.abc import Iterator
from contextlib import chdir
from pathlib import Path

import pytest

from gaplab.api.commands.demo import command_here


@pytest.fixture
def installed(tmp_path: Path) -> Iterator[Path]:
    """The `gaplab` of an installation in a folder with a space in its name, where the shell is."""
    command = tmp_path / "a clone" / ".venv" / "bin" / "gaplab"
    command.parent.mkdir(parents=True)
    command.touch(mode=0o755)
    with chdir(tmp_path / "a clone"):
        yield command


def here(installed: Path, path: Path) -> str:
    return command_here(installed.with_name("python3.11"), str(path))


def test_it_is_called_by_its_name_if_the_path_finds_it(installed: Path) -> None:
    assert here(installed, installed.parent) == "gaplab"


def test_else_it_is_called_by_its_place(installed: Path, tmp_path: Path) -> None:
    assert here(installed, tmp_path) == ".venv/bin/gaplab"

    with chdir(tmp_path / "a clone" / ".venv"):
        assert here(installed, tmp_path) == "bin/gaplab"
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    with chdir(elsewhere):
        assert here(installed, tmp_path) == f"'{installed}'"


def test_another_one_that_the_path_finds_is_not_this_one(installed: Path, tmp_path: Path) -> None:
    other = tmp_path / "bin" / "gaplab"
    other.parent.mkdir()
    other.touch(mode=0o755)

    assert here(installed, other.parent) == ".venv/bin/gaplab"
