"""What the README names is there."""

import re
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text()


@pytest.mark.parametrize("command", sorted(set(re.findall(r"make (\w+)", README))))
def test_its_make_commands_are_in_the_makefile(command: Any) -> None:
    assert re.search(rf"^{command}:", (ROOT / "Makefile").read_text(), re.MULTILINE)


@pytest.mark.parametrize(
    "path", sorted(set(re.findall(r"\]\(([\w./]+)\)|(examples/[\w.]+)|`(services/[\w/]+)/`", README)))
)
def test_its_links_and_paths_lead_somewhere(path: Any) -> None:
    assert (ROOT / next(filter(None, path))).exists()
