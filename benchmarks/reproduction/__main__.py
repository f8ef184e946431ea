"""The paper's figures and claims beside stored studies, as a Markdown document with pictures.

`python -m benchmarks.reproduction ARCHIVE.zip … -o docs/reproduction.md`; without -o, it prints the text alone.
"""

from argparse import ArgumentParser
from collections.abc import Iterator, Sequence
from pathlib import Path

from benchmarks.archives import private_store
from benchmarks.reproduction.document import ROOT, Document
from benchmarks.reproduction.reading import read_study
from benchmarks.reproduction.studies import Study
from benchmarks.reproduction.tables import FIGURE_3, is_toy
from gaplab.services.figures.kinds.curves import curves_figure
from gaplab.services.figures.kinds.toy import toy_figure
from gaplab.services.figures.marks import FigureDefinition
from gaplab.services.figures.matplotlib.files import render_file
from gaplab.services.results.toy import toy_iterations
from gaplab.services.store.session import Store

WIDTH_IN = 7.2
FOLDER = "figures"
"""Folder of the pictures, beside the document."""


def figures(store: Store, label: str, study: Study) -> Iterator[tuple[int, FigureDefinition]]:
    """Yield the paper's figures as the study has them, each with its number."""
    yield 4, curves_figure(study.curves, title=study.name or label)
    shown = [count for count in FIGURE_3[1:] if count <= study.last]
    first = next((arm for name in study.present if (arm := study.arm(name))), None)
    if is_toy(study) and first and shown:
        yield 3, toy_figure(toy_iterations(store, first.read.id, 0, shown))


def pictures(store: Store, studies: dict[str, Study], folder: Path) -> dict[tuple[str, int], str]:
    """Write the figures as SVG, and return their addresses, by label and number of the figure."""
    (folder / FOLDER).mkdir(parents=True, exist_ok=True)
    addresses = {}
    for label, study in studies.items():
        for number, figure in figures(store, label, study):
            address = f"{FOLDER}/reproduction-{label}-{number}.svg"
            (folder / address).write_bytes(render_file(figure, "svg", width_in=WIDTH_IN))
            addresses[label, number] = address
    return addresses


Archives = tuple[Path, ...]
"""The archives of a study; the first one's name is its label."""


def archives_of(argument: str) -> Archives:
    """Return the archives of a study, split at commas."""
    return tuple(Path(each).resolve() for each in argument.split(","))


def write(archives: Sequence[Archives], control_archives: Sequence[Archives], output: Path | None) -> None:
    """Write the document and its pictures, or print it."""
    with private_store() as store:
        read = {each: read_study(store, each) for each in dict.fromkeys([*archives, *control_archives])}
        studies, controls = ({each[0].stem: read[each] for each in files} for files in (archives, control_archives))
        if output is None:
            print(Document(store, studies, ROOT / "docs", {}, controls).text(), end="")
            return
        folder = output.resolve().parent
        text = Document(store, studies, folder, pictures(store, studies, folder), controls).text()
        output.write_text(text, encoding="utf-8")


def main() -> None:
    """Read the command, and write the document."""
    parser = ArgumentParser(prog="python -m benchmarks.reproduction", description=__doc__)
    parser.add_argument(
        "archives",
        nargs="+",
        type=archives_of,
        help="archives of studies, in the order of the document; commas between those of one study",
    )
    parser.add_argument("-o", "--output", type=Path, help="file of the document; its pictures go to figures/ beside it")
    parser.add_argument(
        "--control",
        action="append",
        type=archives_of,
        default=[],
        help="archive of a control, repeatable; it may be a study as well",
    )
    arguments = parser.parse_args()
    archives = {*arguments.archives, *arguments.control}
    if len({each[0].stem for each in archives}) < len(archives):
        parser.error("two archives have one name; a name is the label of a study, so rename one")
    write(arguments.archives, arguments.control, arguments.output)


if __name__ == "__main__":
    main()
