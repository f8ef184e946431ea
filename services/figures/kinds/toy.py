"""The toy function, as in the paper's Fig. 3: the true function, its approximations, the samples, and the transfer."""

from collections.abc import Sequence

from gaplab.schemas.replays import ToyIteration
from gaplab.services.figures.kinds.squared_error import summed
from gaplab.services.figures.marks import Arrow, Axis, FigureDefinition, Line, Mark, Panel, Points, Table
from gaplab.services.figures.style import COLORS, INK, Style
from gaplab.services.figures.words import heading, number, number_of, with_unit

REALITY = Style(INK, "dashed", "circle")
SIMULATION = Style(COLORS[0], "solid", "circle")
SAMPLES = Style(COLORS[1], "solid", "circle")
TRANSFER = Style(COLORS[2], "solid", "star")

SHORTEST = 0.03
"""Shortest arrow, as a share of the figure's height: a shorter one would hide its own start."""


def toy_figure(toys: Sequence[ToyIteration], *, title: str | None = None) -> FigureDefinition:
    """Return a figure with one panel for each iteration of one repetition, at least one, as in the paper.

    The title is by default the experiment and the repetition.
    """
    several = len(toys) > 1
    first = toys[0]
    own = f"{first.name}, repetition {first.repetition}{'' if several else f', iteration {first.iteration}'}"
    return FigureDefinition(
        name="toy",
        title=heading(own if title is None else title),
        panels=tuple(_panel(each, titled=several) for each in toys),
        caption=_caption(toys),
        alt="The fitness of each gene, in reality and in simulation. " + " ".join(map(_description, toys)),
        columns=2 if several else 1,
        table=_table(toys),
        nothing="not computed yet",
    )


def _panel(toy: ToyIteration, *, titled: bool) -> Panel:
    marks: list[Mark] = []
    if toy.truth is not None:
        marks.append(Line("Reality", toy.genes, toy.truth, REALITY, markers=False))
    for rank, each in enumerate(toy.approximations):
        marks.append(Line("Simulation", toy.genes, each, SIMULATION, markers=False, faint=rank > 0))
    marks += [*_samples(toy), *_transfer(toy)]
    low, high = toy.limits
    room = 0.1 * (high - low) or 0.1
    return Panel(
        tuple(marks),
        Axis("Gene", (toy.genes[0], toy.genes[-1])),
        Axis(with_unit("Fitness", [toy.unit]), (low - room, high + room)),
        title=f"Iteration {toy.iteration}" if titled else "",
    )


def _samples(toy: ToyIteration) -> list[Mark]:
    found = [each for each in toy.samples if each.fitness is not None]
    if not found:
        return []
    told = tuple(f"Sample of iteration {each.iteration}" if each.iteration else "Sample from before" for each in found)
    places = tuple(each.gene for each in found), tuple(each.fitness for each in found)
    return [Points("Samples", *places, SAMPLES, hover=told)]


def _transfer(toy: ToyIteration) -> list[Mark]:
    if toy.transfer is None:
        return []
    gene, simulated, real = toy.transfer.gene, toy.transfer.simulated, toy.transfer.real
    marks: list[Mark] = []
    visible = SHORTEST * (toy.limits[1] - toy.limits[0])
    if simulated is not None and real is not None and abs(simulated - real) > visible:
        marks.append(Arrow((gene, simulated), (gene, real), TRANSFER))
    if simulated is not None:
        marks.append(Points("Transferred: fittest in simulation", (gene,), (simulated,), TRANSFER, size=1.4))
    if real is not None and simulated is None:
        marks.append(Points("Fittest in reality", (gene,), (real,), TRANSFER, size=1.4))
    return marks


def _caption(toys: Sequence[ToyIteration]) -> str:
    most = max(len(toy.approximations) for toy in toys)
    cut = ", cut off where they leave the frame" if any(map(_is_cut, toys)) else ""
    parts = [f"Solid: the best simulator{f'; thin: the others{cut}' if most > 1 else ''}."] if most else []
    hidden = "Reality's function is shown once the experiment has ended."
    parts += ["Dashed: reality." if toys[0].truth is not None else hidden]
    parts += ["The arrow goes from the simulated to the real fitness of the transferred controller."]
    return " ".join([*parts, *(map(_description, toys) if len(toys) == 1 else ())])


def _is_cut(toy: ToyIteration) -> bool:
    """Return whether a simulator leaves the frame, which has room for the best one."""
    low, high = toy.limits
    values = [value for each in toy.approximations for value in each if value is not None]
    return bool(values) and not low <= min(values) <= max(values) <= high


def _description(toy: ToyIteration) -> str:
    parts = [f"after {number_of('sample', len(toy.samples))}"]
    if toy.error is not None:
        parts.append(f"the best simulator errs by {number(toy.error)} a sample")
    gene, simulated, real = _transfer_in_words(toy)
    if gene:
        fitness = f"{simulated or 'nothing'} in simulation and {real or 'nothing'} in reality"
        parts.append(f"the transferred gene {gene} reaches {fitness}")
    return f"Iteration {toy.iteration}: {', '.join(parts)}."


def _transfer_in_words(toy: ToyIteration) -> tuple[str, str, str]:
    transfer = toy.transfer
    return (number(transfer.gene), number(transfer.simulated), number(transfer.real)) if transfer else ("", "", "")


def _row(toy: ToyIteration) -> tuple[str, ...]:
    errors = number(toy.error), number(toy.squared_error)
    return str(toy.iteration), str(len(toy.samples)), *errors, *_transfer_in_words(toy)


def _table(toys: Sequence[ToyIteration]) -> Table:
    rows = [_row(toy) for toy in toys]
    head = (
        "Iteration",
        "Samples",
        "Error per sample",
        summed(squares=toys[0].squares),
        "Transferred gene",
        "Fitness in simulation",
        "Fitness in reality",
    )
    return Table(head, tuple(rows))
