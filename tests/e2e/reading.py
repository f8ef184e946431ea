"""What notebooks and documents hold that can be run, and one service for all of it."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

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
