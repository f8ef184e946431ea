"""Notebooks, tutorial and how-tos, run as their readers run them, on one real service that has their plug-ins.

Of each kind, one is run for every change.
"""

import json
import os
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import nbformat
import pytest
from nbclient import NotebookClient

from gaplab.api.process.local_service import LocalService
from tests.e2e.reading import (
    DOCUMENTS,
    NOTEBOOKS,
    ROOT,
    blocks,
    commands,
    plugins_of_documents,
    plugins_of_notebooks,
    script,
    service_with,
)
from tests.parameters import few

WITHOUT_SERVICE = {"own_row", "run", "tuning"}
"""Notebooks that need no service."""

LEAVES = {
    "tutorial": ["curves.svg", "curves.pdf", "curves.html", "study.zip"],
    "day": [
        "report.html",
        "curves.pdf",
        "simulators.pdf",
        "study.zip",
        "copy.db",
        "again.json",
    ],
    "scripts": ["ended.json"],
}
"""Files that a document promises."""

SMALL_TOY = {
    "strategies": ["simulated_fit", "random"],
    "robot": "toy_function",
    "iterations": 3,
    "repetitions": 2,
    "budget": "smoke",
    "seed": 2012,
}


def one_of(paths: list[Path], name: str) -> list[Any]:
    """Parameters of a test, of which only one is for every change."""
    return few(paths, lambda path: path.stem == name, lambda path: path.stem)


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the service."""
    return tmp_path_factory.mktemp("reading")


@pytest.fixture(scope="module")
def service(home: Path) -> Iterator[LocalService]:
    with service_with(home, plugins_of_notebooks() | plugins_of_documents()) as found:
        yield found


def outputs_of(path: Path, folder: Path, **environment: str) -> list[Any]:
    """What the cells of a notebook show, run from its first to its last."""
    notebook = nbformat.read(path, as_version=4)
    NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(folder)}}).execute(
        env=os.environ | environment
    )
    return [output for cell in notebook.cells for output in cell.get("outputs", ())]


@pytest.mark.parametrize("path", one_of(NOTEBOOKS, "compare"))
@pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::ResourceWarning")
def test_a_notebook_runs_from_its_first_cell_to_its_last(path: Path, service: LocalService, tmp_path: Path) -> None:
    found = os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])

    shown = outputs_of(path, tmp_path, GAPLAB_URL=service.url, PYTHONPATH=found)

    data = [output["data"] for output in shown if "data" in output]
    assert any("image/svg+xml" in each for each in data)  # a figure
    if path.stem not in WITHOUT_SERVICE:
        assert any(" repetitions; " in each.get("text/html", "") for each in data)  # its progress
        assert any("COMPLETED" in each.get("text/plain", "") for each in data)
    assert not [output for output in shown if output["output_type"] == "stream" and output["name"] == "stderr"]


def test_there_are_six_with_the_outputs_of_one_run_and_no_place_of_the_machine_that_ran_it() -> None:
    assert [path.stem for path in NOTEBOOKS] == ["compare", "own_robot", "own_row", "own_strategy", "run", "tuning"]
    for path in NOTEBOOKS:
        notebook = nbformat.read(path, as_version=4)
        nbformat.validate(notebook)
        cells = [cell for cell in notebook.cells if cell.cell_type == "code"]
        outputs = {output.output_type for cell in cells for output in cell.outputs}
        places = [each for each in ("/tmp/", "/root/", "/home/", "/var/", "/Users/") if each in path.read_text()]
        assert [cell.execution_count for cell in cells] == list(range(1, len(cells) + 1)), path
        assert outputs & {"display_data", "execute_result"}, path
        assert "error" not in outputs, path
        assert places == [], path
        assert set(notebook.metadata) == {"kernelspec", "language_info"}, path


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Where a reader is: in a clone, here with a small toy."""
    shutil.copytree(ROOT / "examples", tmp_path / "examples")
    (tmp_path / "examples" / "toy.json").write_text(json.dumps(SMALL_TOY))
    (tmp_path / "docs").symlink_to(ROOT / "docs")
    return tmp_path


HERE = [path for path in DOCUMENTS if any(each.mark is None for each in blocks(path))]


@pytest.mark.parametrize("path", one_of(HERE, "scripts"))
def test_what_a_document_says_can_be_done(path: Path, service: LocalService, home: Path, folder: Path) -> None:
    environment = os.environ | {
        "GAPLAB_URL": service.url,
        "GAPLAB_DATABASE_URL": f"sqlite:///{home / 'gaplab.db'}",
        "PATH": os.pathsep.join([str(commands(folder)), os.environ["PATH"]]),
        "PYTHONPATH": os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")]),
    }

    run = ["bash", "-c", script(path)]
    done = subprocess.run(run, cwd=folder, env=environment, capture_output=True, text=True, timeout=900, check=False)

    assert done.returncode == 0, done.stdout + done.stderr
    assert [name for name in LEAVES.get(path.stem, ()) if not (folder / name).stat().st_size] == []
    assert "Traceback" not in done.stderr


def test_the_documents_have_code_and_what_is_not_run_says_why() -> None:
    every = {path.stem: blocks(path) for path in DOCUMENTS}

    assert sum(each.mark is None for found in every.values() for each in found) > 12
    assert {"spread.py", "tug.py", "motor_torque.py", "molasses.py", "scout.py", "hopper.py"} == set(
        plugins_of_documents()
    )
    assert all(text.count("```") % 2 == 0 for text in (path.read_text() for path in DOCUMENTS))
