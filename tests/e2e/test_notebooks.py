"""The notebooks of examples/, run as their readers run them, all on one real service that has their plug-ins."""

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import nbformat
import pytest
from nbclient import NotebookClient

from api.own import LocalService
from tests.e2e.reading import NOTEBOOKS, plugins_of_notebooks, service_with


@pytest.fixture(scope="module")
def service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LocalService]:
    with service_with(tmp_path_factory.mktemp("notebooks"), plugins_of_notebooks()) as found:
        yield found


def outputs_of(path: Path, folder: Path) -> list[Any]:
    """What the cells of a notebook show, run from its first to its last."""
    notebook = nbformat.read(path, as_version=4)
    NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(folder)}}).execute()
    return [output for cell in notebook.cells for output in cell.get("outputs", ())]


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
@pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::ResourceWarning")
def test_a_notebook_runs_from_its_first_cell_to_its_last(
    path: Path, service: LocalService, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setenv("GAPLAB_URL", service.url)
    monkeypatch.setenv(
        "PYTHONPATH", os.pathsep.join([str(Path(__file__).parents[2]), os.environ.get("PYTHONPATH", "")])
    )

    shown = outputs_of(path, tmp_path)

    data = [output["data"] for output in shown if "data" in output]
    assert any("image/svg+xml" in each for each in data)  # a figure
    assert any("<progress" in each.get("text/html", "") for each in data)  # its progress
    assert any("COMPLETED" in each.get("text/plain", "") for each in data)
    assert not [output for output in shown if output["output_type"] == "stream" and output["name"] == "stderr"]


def test_there_are_three():
    assert [path.stem for path in NOTEBOOKS] == ["compare", "own_robot", "own_strategy"]


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_no_output_is_kept_in_git(path: Path):
    notebook = nbformat.read(path, as_version=4)

    nbformat.validate(notebook)
    assert [cell for cell in notebook.cells if cell.get("outputs") or cell.get("execution_count")] == []
    assert set(notebook.metadata) == {"kernelspec", "language_info"}
