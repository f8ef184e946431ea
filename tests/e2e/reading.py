"""What notebooks and documents hold that can be run, and one service for all of it."""

import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

import nbformat

from gaplab.api.process.local_service import LocalService, local_service

ROOT = Path(__file__).parents[2]
NOTEBOOKS = sorted((ROOT / "examples").glob("*.ipynb"))
WRITES = re.compile(r"%%writefile plugins/(\w+\.py)\n")


def plugins_of_notebooks() -> dict[str, str]:
    """The files that cells write into the folder of plug-ins, which the service must have from its start."""
    found = {}
    for path in NOTEBOOKS:
        for cell in nbformat.read(path, as_version=4).cells:
            if match := WRITES.match(cell.source):
                found[match[1]] = cell.source[match.end() :] + "\n"
    return found


DOCUMENTS = [
    ROOT / "docs" / "tutorial.md",
    ROOT / "docs" / "day.md",
    *sorted((ROOT / "docs" / "tutorials").glob("*.md")),
    *sorted((ROOT / "docs" / "how-to").glob("*.md")),
]
BLOCK = re.compile(
    r"(?:<!-- (?P<mark>not run|run apart): [^\n]+ -->\n)?^```(?P<language>\w+)\n(?P<text>.*?)^```", re.M | re.S
)
FILE = re.compile(r"# plugins/(\w+\.py)\n")


class Block(NamedTuple):
    """A block of code.

    Attributes:
        language: that it is in.
        text: of it.
        mark: "not run"; "run apart", by a test that has what it needs; or None.
    """

    language: str
    text: str
    mark: str | None

    def paragraphs(self) -> list[list[str]]:
        """The lines of its commands, without what is said of them; a blank line is between paragraphs."""
        told = [[line.partition("#")[0].strip() for line in each.splitlines()] for each in self.text.split("\n\n")]
        return [[line for line in lines if line] for lines in told]


def blocks(path: Path) -> list[Block]:
    return [Block(each["language"], each["text"], each["mark"]) for each in BLOCK.finditer(path.read_text())]


def plugins_of_documents() -> dict[str, str]:
    """The files that documents show, as their readers would write them."""
    found = {}
    for path in DOCUMENTS:
        for block in blocks(path):
            if match := FILE.match(block.text):
                found[match[1]] = block.text
    return found


def script(path: Path) -> str:
    """What a document has its reader run, in its order, in one shell."""
    parts = ["set -euo pipefail"]
    for block in blocks(path):
        if block.mark or FILE.match(block.text) or block.language == "text":
            continue
        assert block.language in {"sh", "python"}, f"{path.name} has a block of {block.language}"
        parts.append(block.text if block.language == "sh" else f"python - <<'THE_END'\n{block.text}THE_END")
    return "\n".join(parts)


def commands(folder: Path) -> Path:
    """A folder for the path of a reader's shell, with the commands that an installation has."""
    found = folder / "commands"
    found.mkdir()
    for name, call in {"gaplab": "-m gaplab", "python": "", "ray": "-m tests.e2e.loopback_ray"}.items():
        (found / name).write_text(f'#!/bin/sh\nexec "{sys.executable}" {call} "$@"\n')
        (found / name).chmod(0o755)
    return found


@contextmanager
def service_with(folder: Path, plugins: dict[str, str]) -> Iterator[LocalService]:
    """A service in this folder that has these plug-ins."""
    home = folder / "plugins"
    home.mkdir()
    for name, text in plugins.items():
        (home / name).write_text(text)
    service = local_service(folder, plugins=home)
    try:
        yield service
    finally:
        service.close()
