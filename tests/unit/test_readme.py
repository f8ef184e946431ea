"""The README says what there is, and all of it."""

import re
from pathlib import Path
from typing import Any

import pytest

from gaplab.services.plugins.catalogue import catalogue
from gaplab.services.settings import Settings

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text()


@pytest.mark.parametrize("kind", ["strategies", "robots", "controllers", "tasks", "engines", "tunables", "optimizers"])
def test_it_lists_every_plugin_of_a_kind_and_no_other(kind: Any) -> None:
    (row,) = re.findall(rf"^\| {kind} \| (.*) \|$", README, re.MULTILINE)

    assert set(re.findall(r"`(\w+)`", row)) == {each.name for each in getattr(catalogue(), kind)}


def test_it_lists_every_setting() -> None:
    for name in Settings.model_fields:
        assert f"`GAPLAB_{name.upper()}`" in README


@pytest.mark.parametrize("command", sorted(set(re.findall(r"make (\w+)", README))))
def test_its_make_commands_are_in_the_makefile(command: Any) -> None:
    assert re.search(rf"^{command}:", (ROOT / "Makefile").read_text(), re.MULTILINE)


@pytest.mark.parametrize(
    "path", sorted(set(re.findall(r"\]\(([\w./]+)\)|(examples/[\w.]+)|`(services/[\w/]+)/`", README)))
)
def test_its_links_and_paths_lead_somewhere(path: Any) -> None:
    assert (ROOT / next(filter(None, path))).exists()
