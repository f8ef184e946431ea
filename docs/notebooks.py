"""`python -m docs.notebooks`: run the notebooks of examples/ and store them with their outputs.

Each runs from its first cell to its last in an empty folder, with a service of its own. Ids and times differ from run
to run; the numbers do not. tests/unit/test_docs.py checks that the stored outputs name no folder of a machine.
"""

import os
import re
from pathlib import Path
from tempfile import TemporaryDirectory

import nbformat
from nbclient import NotebookClient

ROOT = Path(__file__).parents[1]
NOTEBOOKS = sorted((ROOT / "examples").glob("*.ipynb"))
LONGEST_S = 900


def run(path: Path) -> nbformat.NotebookNode:
    """Return a notebook with the outputs of a run."""
    notebook = nbformat.read(path, as_version=4)
    with TemporaryDirectory() as folder:
        NotebookClient(notebook, timeout=LONGEST_S, resources={"metadata": {"path": folder}}).execute()
        for cell in notebook.cells:
            if cell.cell_type == "code":
                cell.metadata.pop("execution", None)  # the times of the run
                cell.outputs = [_portable(output, folder) for output in cell.outputs if output.get("name") != "stderr"]
    notebook.metadata.pop("widgets", None)
    return notebook


def main() -> None:
    """Run every notebook and replace its file."""
    os.environ.pop("GAPLAB_URL", None)
    os.environ["PYTHONPATH"] = os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])
    for path in NOTEBOOKS:
        nbformat.write(run(path), path)
        print(f"Wrote {path}.")  # noqa: T201


def _portable(output: nbformat.NotebookNode, folder: str) -> nbformat.NotebookNode:
    """Return an output without the folder of the run."""
    text = nbformat.v4.writes_json(nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(outputs=[output])]))
    plain = re.sub(re.escape(folder) + "/?", "", text)
    return nbformat.reads(plain, as_version=4).cells[0].outputs[0]


if __name__ == "__main__":
    main()
