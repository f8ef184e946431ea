"""The paper's figures and claims beside stored studies, as two Markdown pages with pictures.

`python -m benchmarks.reproduction ARCHIVE.zip … -o docs/reproduction.md`; without -o, it prints the claims alone.
"""

from argparse import ArgumentParser
from collections.abc import Mapping
from pathlib import Path

from benchmarks.findings import private_store
from benchmarks.reproduction.page import CLAIMS_PAGE, ROOT, Page
from benchmarks.reproduction.results import FIGURE_3
from benchmarks.reproduction.studies import Study, read_study
from gaplab.services.figures.kinds.curves import curves_figure
from gaplab.services.figures.kinds.toy import toy_figure
from gaplab.services.figures.marks import FigureDefinition
from gaplab.services.figures.matplotlib.files import Look, render_file
from gaplab.services.results.toy import toy_iterations
from gaplab.services.store.session import Store

WIDTH_IN = 7.2
FOLDER = "figures"
"""Folder of the pictures, beside the page."""


def pictures(store: Store, studies: Mapping[str, Study], folder: Path) -> dict[tuple[str, int], str]:
    """Write the paper's figures as SVG, and return their addresses, by label and number of the figure."""
    figures: dict[tuple[str, int], FigureDefinition] = {}
    for label, study in studies.items():
        figures[label, 4] = curves_figure(study.curves, title=study.name or label, beside=study.beside)
        shown = [count for count in FIGURE_3[1:] if count <= study.last]
        if study.toy and study.present and shown:
            figures[label, 3] = toy_figure(toy_iterations(store, study.of()[0].read.id, 0, shown))
    addresses = {(label, number): f"{FOLDER}/reproduction-{label}-{number}.svg" for label, number in figures}
    (folder / FOLDER).mkdir(parents=True, exist_ok=True)
    for at, figure in figures.items():
        (folder / addresses[at]).write_bytes(render_file(figure, "svg", Look(WIDTH_IN)))
    return addresses


def archives_of(argument: str) -> tuple[Path, ...]:
    """Return the archives of a study, split at commas; the first one's name is its label."""
    return tuple(Path(each).resolve() for each in argument.split(","))


def main() -> None:
    """Read the command, and write the page."""
    parser = ArgumentParser(prog="python -m benchmarks.reproduction", description=__doc__)
    several = "archives of studies, in the order of the page; commas between those of one study"
    once = "archive of a control, repeatable; it may be a study as well"
    output = f"file of the first page; beside it are {CLAIMS_PAGE} and the pictures in figures/"
    parser.add_argument("archives", nargs="+", type=archives_of, help=several)
    parser.add_argument("-o", "--output", type=Path, help=output)
    parser.add_argument("--control", action="append", type=archives_of, default=[], help=once)
    arguments = parser.parse_args()
    every = list(dict.fromkeys([*arguments.archives, *arguments.control]))
    if len({each[0].stem for each in every}) < len(every):
        parser.error("two archives have one name; a name is the label of a study, so rename one")
    with private_store() as store:
        read = {each: read_study(store, each) for each in every}
        studies, controls = (
            {each[0].stem: read[each] for each in part} for part in (arguments.archives, arguments.control)
        )
        if arguments.output is None:
            print(Page(studies, controls, ROOT / "docs", {}).text(), end="")
            return
        folder = arguments.output.resolve().parent
        page = Page(studies, controls, folder, pictures(store, studies, folder))
        arguments.output.write_text(page.first(), encoding="utf-8")
        (folder / CLAIMS_PAGE).write_text(page.text(), encoding="utf-8")


if __name__ == "__main__":
    main()
