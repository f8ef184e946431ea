"""The documents: no link is dead, and the reference is what the code says."""

import json
import re
import subprocess
from collections.abc import Iterator
from pathlib import Path

import nbformat
import pytest

from docs import typescript
from docs.generate import FOLDER, pages
from gaplab.services.engines import engines

ROOT = Path(__file__).parents[2]
DOCUMENTS = sorted(
    path
    for path in (*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md"), *ROOT.glob("services/**/*.md"))
    if ".venv" not in path.parts
)
NOTEBOOKS = sorted((ROOT / "examples").glob("*.ipynb"))
LINK = re.compile(r"\]\(\s*<?([^)\s>]+)>?(?:\s+\"[^\"]*\")?\s*\)")
FENCED = re.compile(r"^(```|~~~).*?^\1", re.MULTILINE | re.DOTALL)


def prose(path: Path) -> str:
    """A document, or a notebook's Markdown, without blocks of code."""
    if path.suffix == ".ipynb":
        cells = nbformat.read(path, as_version=4).cells
        return "\n\n".join(cell.source for cell in cells if cell.cell_type == "markdown")
    return FENCED.sub("", path.read_text())


def anchors(path: Path) -> set[str]:
    """Of its headings, as GitHub makes them."""
    found: set[str] = set()
    for heading in re.findall(r"^#+ (.*)$", prose(path), re.MULTILINE):
        plain = re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", heading).replace("`", "").lower()
        slug = re.sub(r"[^\w\- ]", "", plain).replace(" ", "-")
        repeated = next(n for n in range(1000) if (f"{slug}-{n}" if n else slug) not in found)
        found.add(f"{slug}-{repeated}" if repeated else slug)
    return found


def tables(path: Path) -> Iterator[list[list[str]]]:
    """The cells of each of its tables."""
    for table in re.findall(r"(?:^\|.*\n)+", prose(path) + "\n", re.MULTILINE):
        yield [re.split(r"(?<!\\)\|", line.strip())[1:-1] for line in table.splitlines()]


def dead(path: Path) -> list[str]:
    """Its links that lead nowhere; those to other hosts are not followed."""
    wrong = []
    for link in LINK.findall(re.sub(r"`[^`\n]*`", "", prose(path))):
        if re.match(r"(https?|mailto):", link):
            continue
        name, _, anchor = link.partition("#")
        target = (path.parent / name).resolve() if name else path
        if not target.exists() or (anchor and anchor not in anchors(target)):
            wrong.append(link)
    return wrong


def test_no_link_is_dead() -> None:
    assert {str(path): found for path in (*DOCUMENTS, *NOTEBOOKS) if (found := dead(path))} == {}


def test_each_row_of_a_table_has_the_columns_of_its_heading() -> None:
    read = (
        (path, heading, row) for path in (*DOCUMENTS, *NOTEBOOKS) for heading, *rows in tables(path) for row in rows
    )

    assert [(str(path), row) for path, heading, row in read if len(row) != len(heading)] == []


def test_dead_links_would_be_found(tmp_path: Path) -> None:
    (tmp_path / "other.md").write_text("# A `heading` of two\n\n# A heading of two\n")
    document = tmp_path / "a.md"
    document.write_text(
        "# Here\n[a](other.md) [b](gone.md) [c](#here) [d](#there) [e](other.md#a-heading-of-two) "
        "[f](other.md#a-heading-of-two-1) [g](other.md#no) `[h](code.md)` [i](https://example.org/x)\n"
        "```sh\n[j](code.md)\n```\n"
    )

    assert dead(document) == ["gone.md", "#there", "other.md#no"]


def test_every_document_is_reached_from_the_index() -> None:
    index = ROOT / "docs" / "README.md"
    linked = {(index.parent / link.partition("#")[0]).resolve() for link in LINK.findall(prose(index))}
    folders = {index.parent, index.parent / "how-to", index.parent / "reference"}
    beside = {path for path in DOCUMENTS if path.parent in folders} - {index}

    assert beside - linked == set()
    assert "(docs/README.md)" in (ROOT / "README.md").read_text()


@pytest.fixture(scope="module")
def reference() -> dict[str, str]:
    """The pages of the reference, made from the code."""
    return pages()


@pytest.mark.skipif(not engines["pybullet"].available(), reason="the reference names PyBullet as the default engine")
def test_the_reference_is_what_the_code_says(reference: dict[str, str]) -> None:
    kept = {path.name: path.read_text() for path in FOLDER.glob("*.md")}

    assert {name for name, text in reference.items() if kept.get(name) != text} == set(), "run `make docs`"
    assert set(kept) == set(reference)


def test_the_reference_lists_groups_that_run_by_themselves_or_have_options(reference: dict[str, str]) -> None:
    headings = set(re.findall(r"^## (gaplab.*)$", reference["commands.md"], re.MULTILINE))

    assert {"gaplab", "gaplab views", "gaplab views save", "gaplab token list"} <= headings
    assert headings.isdisjoint({"gaplab token", "gaplab plugin"})


def test_the_types_of_the_page_are_those_of_the_openapi_document() -> None:
    assert typescript.FILE.read_text() == typescript.declarations(), "run `make docs`"


def test_what_is_said_of_other_tools_names_its_source() -> None:
    lines = (ROOT / "docs" / "other-tools.md").read_text().splitlines()
    heads, _, *rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines if line.startswith("|")]

    assert heads[2:] == ["Optuna Dashboard", "MLflow", "Weights & Biases"]
    assert [(row[0], cell) for row in rows for cell in row[2:] if cell and "](https://" not in cell] == []
    assert {len(row) for row in rows} == {len(heads)}


def test_documents_name_no_path_of_a_machine() -> None:
    listed = subprocess.run(
        ["git", "ls-files", "docs", "examples"], cwd=ROOT, capture_output=True, text=True, check=False
    )
    texts = [ROOT / name for name in listed.stdout.split() if name.endswith((".md", ".ipynb"))]

    assert [path for path in texts if re.search(r"(/home|/Users|/work)/\w", path.read_text())] == []


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_has_the_outputs_of_a_whole_run_and_names_no_folder_of_a_machine(path: Path) -> None:
    cells = [cell for cell in nbformat.read(path, as_version=4).cells if cell.cell_type == "code"]

    assert [cell.execution_count for cell in cells] == list(range(1, len(cells) + 1))
    assert sum(bool(cell.outputs) for cell in cells) > len(cells) / 2
    assert not re.search(r"/(root|tmp|home|work|Users|var)/", json.dumps([cell.outputs for cell in cells]))
