"""What notebooks and documents hold that can be run, and one service for all of it."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

import nbformat

from api.own import LocalService, local_service

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


DOCUMENTS = [ROOT / "docs" / "tutorial.md", *sorted((ROOT / "docs" / "how-to").glob("*.md"))]
BLOCK = re.compile(r"(?P<skipped><!-- not run: [^\n]+ -->\n)?^```(?P<language>\w+)\n(?P<text>.*?)^```", re.M | re.S)
FILE = re.compile(r"# plugins/(\w+\.py)\n")


class Block(NamedTuple):
    language: str
    text: str
    skipped: bool


def blocks(path: Path) -> list[Block]:
    return [Block(each["language"], each["text"], bool(each["skipped"])) for each in BLOCK.finditer(path.read_text())]


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
        if block.skipped or FILE.match(block.text) or block.language == "text":
            continue
        assert block.language in {"sh", "python"}, f"{path.name} has a block of {block.language}"
        parts.append(block.text if block.language == "sh" else f"python - <<'THE_END'\n{block.text}THE_END")
    return "\n".join(parts)


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
