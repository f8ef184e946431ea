"""All systems on one robot, reality, budget and statistics: `python -m benchmarks.systems.comparison`.

Studies are read from docs/studies, or computed there; docs/comparison.md and its figure are written from the realities
of which all are there. With names of studies, like `inside-fitness`, only these are computed.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path

from benchmarks.findings import import_file, private_store
from benchmarks.reproduction.results import table
from benchmarks.systems.judging import FOLDER, SMOKE, asked, computed
from benchmarks.systems.rows import REALITIES, ROWS, SETTINGS, label, study
from gaplab.schemas.comparisons import Comparison
from gaplab.schemas.costs import CostModel
from gaplab.schemas.curves import Fitness
from gaplab.services.figures.marks import Axis, Bars, FigureDefinition, Level, Panel, Points
from gaplab.services.figures.matplotlib.files import Look, render_file
from gaplab.services.figures.style import Style, strategy_style
from gaplab.services.findings.statistics import SIGNIFICANT
from gaplab.services.findings.wording import MISSING, listed
from gaplab.services.results.comparisons import compare
from gaplab.services.store.session import Store

IN_SHORT = {Fitness.TRANSFERRED: "transferred alone", Fitness.EQUAL_CHANCES: "equal chances"}
KINDS = tuple(IN_SHORT)
EQUAL: dict[str, tuple[CostModel, float | None]] = {
    "ten evaluations": (CostModel(), None),
    "7,000 rollouts": (CostModel(x="rollouts"), 7_000.0),
    "a cost of 10": (CostModel(x="cost", cost_s=120.0, rollout_s=1.0, cores=2.0, attention=40.0), 10.0),
}
"""What is equal. An evaluation takes two minutes of a person at 40 an hour, a rollout a second on one of two cores of a
machine at 1 an hour; 7,000 rollouts are what systems take that tune nothing."""

TITLES = {
    "inside": "inside",
    "inside-noisy": "inside with noise",
    "outside": "outside",
    "outside-noisy": "outside with noise",
}
NEITHER = "- No pair of systems is shown in both directions. Where leaders change above, chance may have chosen them."
WIDTH_IN = 9.0
HEIGHT = 4.6
"""Of a panel, as a factor of the usual height: each system has a line of text."""


@dataclass(frozen=True)
class Cell:
    """A system in a column: fitness over direct and its interval, and whether others are shown to be better."""

    mean: float
    lower: float
    upper: float
    beaten: bool


@dataclass(frozen=True)
class Column:
    """Systems in one reality at one thing equal; places are those of `ROWS`.

    Attributes:
        cells: by place; none where a system ended with less.
        above: pairs of places of which the first is shown to be better, after Holm's correction over all pairs.
    """

    cells: Mapping[int, Cell]
    above: frozenset[tuple[int, int]]

    @property
    def unbeaten(self) -> list[int]:
        """Return the places of systems that none is shown to be better than, the best mean first."""
        ranked = sorted(self.cells, key=lambda place: -self.cells[place].mean)
        return [place for place in ranked if not self.cells[place].beaten]


def column(store: Store, ids: Sequence[str], kind: Fitness, equal: str) -> Column:
    """Return a column of the table; the reference is `direct`, the last row."""
    model, amount = EQUAL[equal]
    pairs = compare(store, ids, fitness=kind, model=model, at=amount, intervals=True)
    found = dict[int, tuple[float, float, float]]()
    above = set[tuple[int, int]]()
    for (first, second), pair in zip(combinations(range(len(ids)), 2), pairs, strict=True):
        for place, summary in ((first, pair.summary_first), (second, pair.summary_second)):
            if (value := summary.mean.value) is not None:
                lower, upper = (value if end is None else end for end in (summary.mean.lower, summary.mean.upper))
                found[place] = (value, lower, upper)
        if _shown(pair):
            above.add((first, second) if (pair.difference or 0.0) > 0 else (second, first))
    unit = found[len(ids) - 1][0]
    beaten = {worse for better, worse in above if better < len(ids) - 1}
    return Column(
        {
            place: Cell(mean / unit, lower / unit, upper / unit, place in beaten)
            for place, (mean, lower, upper) in sorted(found.items())
        },
        frozenset(above),
    )


def _shown(pair: Comparison) -> bool:
    return pair.trusted.p_holm is not None and pair.trusted.p_holm < SIGNIFICANT


Columns = Mapping[tuple[str, str, Fitness], Column]
"""By reality, what is equal, and whose fitness counts."""


def columns(folder: Path, realities: Iterable[str] = REALITIES) -> dict[tuple[str, str, Fitness], Column]:
    """Return the columns of realities, from the studies in a folder; one that is missing is computed."""
    found = dict[tuple[str, str, Fitness], Column]()
    for reality in realities:
        with private_store() as store:
            ids = dict[int, str]()
            for settings in SETTINGS:
                archive = computed(label(reality, settings), study(reality, settings), folder)
                places = [place for place, row in enumerate(ROWS) if row.settings == settings]
                ids |= zip(places, import_file(store, archive).experiments, strict=True)
            ordered = [ids[place] for place in range(len(ROWS))]
            for equal in EQUAL:
                found |= {(reality, equal, kind): column(store, ordered, kind, equal) for kind in KINDS}
    return found


def _systems() -> range:
    """Return the places of all but `direct`."""
    return range(len(ROWS) - 1)


def _realities(found: Columns) -> list[str]:
    return list(dict.fromkeys(reality for reality, *_ in found))


def drawn(found: Columns) -> bytes:
    """Return the figure as SVG."""
    return render_file(figure(found), "svg", Look(WIDTH_IN))


def figure(found: Columns) -> FigureDefinition:
    """Return the fitness of all systems after ten evaluations: a panel for each reality, a row for each system."""
    ticks = tuple((float(-place), row.name) for place, row in enumerate(ROWS))
    at = {reality: [found[reality, "ten evaluations", kind] for kind in KINDS] for reality in _realities(found)}
    every = [cell for both in at.values() for each in both for cell in each.cells.values()]
    ends = (min(cell.lower for cell in every) - 0.02, max(cell.upper for cell in every) + 0.02)
    panels = []
    for number, (reality, (alone, chances)) in enumerate(at.items()):
        marks = [Level("direct", 1.0, upright=True), *_dots(alone), *_hollow(chances)]
        left = Axis("", (0.5 - len(ROWS), 0.5), ticks=ticks if number == 0 else tuple((y, "") for y, _ in ticks))
        below = Axis("fitness over direct", ends)
        panels.append(Panel(tuple(marks), below, left, title=TITLES[reality], height=HEIGHT))
    caption = (
        "Ten real-world evaluations, n = 10. Dots: transferred controllers, with 95 % intervals; rings: equal chances."
    )
    return FigureDefinition("comparison", "", tuple(panels), caption, caption, columns=len(at))


def _dots(one: Column) -> Iterator[Bars | Points]:
    for place, cell in one.cells.items():
        style = _style(place)
        yield Bars("", ((cell.lower, cell.upper, float(-place)),), style, thickness=0.12)
        yield Points("", (cell.mean,), (float(-place),), style, size=0.8)


def _hollow(one: Column) -> Iterator[Points]:
    for place, cell in one.cells.items():
        yield Points("", (cell.mean,), (float(-place),), _style(place), size=0.8, hollow=True)


def _style(place: int) -> Style:
    given = ROWS[place].strategy
    style = strategy_style(given if isinstance(given, str) else given["name"])
    return Style(style.color, "solid", "circle")


def rows(found: Columns) -> str:
    """Return the tables: percent of direct, of transferred controllers alone and with equal chances."""
    return "\n\n".join(f"**Equal: {equal}**\n\n{_rows(found, equal)}" for equal in EQUAL)


def _rows(found: Columns, equal: str) -> str:
    lines, group = [], ""
    for place, row in enumerate(ROWS):
        if row.group != group:
            group = row.group
            lines.append([f"*{group}*", *[""] * len(_realities(found))])
        cells = [[found[each, equal, kind].cells.get(place) for kind in KINDS] for each in _realities(found)]
        lines.append([row.name, *(" · ".join(map(_percent, pair)) for pair in cells)])
    return table(["system", *(TITLES[each] for each in _realities(found))], lines)


def _percent(cell: Cell | None) -> str:
    if cell is None:
        return MISSING
    return f"{100 * cell.mean:.0f}" if cell.beaten else f"**{100 * cell.mean:.0f}**"


def reversals(found: Columns) -> list[str]:
    """Return the pairs of which each is shown to be better than the other in some column, in words."""
    told = []
    for first, second in combinations(_systems(), 2):
        wins, losses = (
            [_where(key) for key, one in found.items() if pair in one.above]
            for pair in ((first, second), (second, first))
        )
        if wins and losses:
            names = ROWS[first].name, ROWS[second].name
            told.append(f"{names[0]} above {names[1]}: {'; '.join(wins)}. The other way: {'; '.join(losses)}.")
    return told


def _where(key: tuple[str, str, Fitness]) -> str:
    reality, equal, kind = key
    return f"{TITLES[reality]}, {equal}, {kind.words}"


def page(found: Columns) -> str:
    """Return the document."""
    text = (Path(__file__).parent / "comparison.txt").read_text("utf-8")
    turned = "\n".join(f"- {line}" for line in reversals(found)) or NEITHER
    left = [title for reality, title in TITLES.items() if reality not in _realities(found)]
    missing = f"\nNot computed: {listed(left)}.\n" if left else ""
    return text.format(
        table=rows(found),
        answers=answers(found),
        last=leaders(found, "ten evaluations", Fitness.TRANSFERRED)[-1],
        kept=leaders(found, "ten evaluations", Fitness.EQUAL_CHANCES)[-1],
        undecided=undecided(found),
        systems=len(_systems()),
        reversals=turned,
        missing=missing,
    )


def answers(found: Columns) -> str:
    """Return which system leads: a row for what is equal and whose fitness counts, a column for a reality."""
    lines = [[f"{equal}, {words}", *leaders(found, equal, kind)] for equal in EQUAL for kind, words in IN_SHORT.items()]
    return table(["equal", *(TITLES[each] for each in _realities(found)), "on average"], lines)


def leaders(found: Columns, equal: str, kind: Fitness) -> list[str]:
    """Return the system with the best mean in each reality, and on average of those that are in every reality."""
    ones = [found[each, equal, kind] for each in _realities(found)]
    means = [{place: cell.mean for place, cell in one.cells.items() if place in _systems()} for one in ones]
    everywhere = set.intersection(*map(set, means))
    means.append({place: sum(each[place] for each in means) / len(means) for place in everywhere})
    best = [max((mean, place) for place, mean in each.items()) for each in means]
    return [f"{ROWS[place].name} {100 * mean:.0f}" for mean, place in best]


def undecided(found: Columns) -> str:
    """Return how many systems no other is shown to be better than, at ten evaluations, in words."""
    told = []
    for reality in _realities(found):
        ones = [found[reality, "ten evaluations", kind] for kind in KINDS]
        left = [sum(place in _systems() for place in one.unbeaten) for one in ones]
        told.append(f"{left[0]} and {left[1]} {TITLES[reality]}")
    return listed(told)


def main() -> None:
    """Compute what is missing, and write the page."""
    every = {f"{reality}-{settings}": (reality, settings) for reality in REALITIES for settings in SETTINGS}
    given = asked("python -m benchmarks.systems.comparison", __doc__, every)
    for name in given.names or every:
        reality, settings = every[name]
        computed(label(reality, settings), study(reality, settings) | (SMOKE if given.smoke else {}), given.folder)
    if (realities := whole(given.folder)) and not given.smoke:
        write(columns(given.folder, realities), FOLDER.parent)


def whole(folder: Path) -> list[str]:
    """Return the realities of which all studies are in a folder."""
    archives = {each.stem for each in folder.glob("*.zip")}
    return [each for each in REALITIES if archives >= {label(each, settings) for settings in SETTINGS}]


def write(found: Columns, folder: Path) -> None:
    """Write the document and its figure into a folder."""
    (folder / "comparison.md").write_text(page(found), "utf-8")
    (folder / "figures" / "comparison.svg").write_bytes(drawn(found))


if __name__ == "__main__":
    main()
