"""What simulators said of a controller, against what reality said."""

from collections.abc import Sequence
from math import dist, sqrt

from schemas.predictions import Prediction
from services.figures.marks import Axis, Diagonal, Figure, Panel, Points, Table
from services.figures.style import INK, Style, style_of
from services.figures.words import counted, heading, limits, number, printable, with_unit

BEFORE, AFTER = "Before tuning on it", "After tuning on it"

Pair = tuple[Prediction, float, float]
"""A prediction, and what it says: fitness in simulation and in reality."""


def predictions_figure(items: Sequence[Prediction], *, unit: str = "", pending: int = 0, title: str = "") -> Figure:
    """The fitness of each sample in simulation against its fitness in reality, with the diagonal on which they agree.

    Args:
        items: the samples.
        unit: of fitness.
        pending: how many more there are, which are not computed yet.
        title: above the figure.
    """
    before = [(each, each.simulated_before) for each in items]
    after = [(each, each.simulated_after) for each in items]
    drawn = {BEFORE: _pairs(before), AFTER: _pairs(after)}
    values = [value for pairs in drawn.values() for _, *both in pairs for value in both]
    ends = limits(values)
    marks = (
        Diagonal("Simulation agrees with reality", Style(INK, "dashed", "circle")) if values else None,
        _points(BEFORE, drawn[BEFORE], style_of(1), hollow=True),
        _points(AFTER, drawn[AFTER], style_of(0), hollow=False),
    )
    panel = Panel(
        tuple(mark for mark in marks if mark is not None),
        Axis(with_unit("Fitness in reality", {unit}), ends),
        Axis(with_unit("Fitness in simulation", {unit}), ends),
        square=True,
    )
    return Figure(
        name="predictions",
        title=heading(title),
        panels=(panel,),
        caption=_caption(items, drawn, pending, unit),
        alt=_alt(drawn),
        table=_table(items),
        nothing="no results yet" if not pending else "being computed",
    )


def _pairs(said: Sequence[tuple[Prediction, float | None]]) -> list[Pair]:
    return [(each, value, each.fitness) for each, value in said if value is not None and each.fitness is not None]


def _points(name: str, pairs: Sequence[Pair], style: Style, *, hollow: bool) -> Points:
    return Points(
        name,
        tuple(real for _, _, real in pairs),
        tuple(simulated for _, simulated, _ in pairs),
        style,
        hover=tuple(f"repetition {each.repetition}, iteration {each.iteration}" for each, _, _ in pairs),
        hollow=hollow,
    )


def _caption(items: Sequence[Prediction], drawn: dict[str, list[Pair]], pending: int, unit: str) -> str:
    if not items:
        return ""
    repetitions = len({each.repetition for each in items})
    parts = [
        f"{counted([len(items)], 'sample')} of {counted([repetitions], 'repetition')}, each in the simulator that was "
        "the best before it was measured, and in the best that was tuned on it and all before it."
    ]
    shown = f"\N{NO-BREAK SPACE}{printable(unit)}" if unit not in {"", "1"} else ""
    parts += [
        f"{name}: root-mean-square error {number(_error(pairs), 2)}{shown}." for name, pairs in drawn.items() if pairs
    ]
    left_out = sum(None in (each.fitness, each.simulated_before, each.simulated_after) for each in items)
    parts += [f"{counted([left_out], 'sample')} left out: a measurement or the physics failed."] if left_out else []
    parts += [f"{counted([pending], 'sample')} still being computed."] if pending else []
    return " ".join(parts)


def _error(pairs: Sequence[Pair]) -> float:
    _, simulated, real = zip(*pairs, strict=True)
    return dist(simulated, real) / sqrt(len(pairs))  # without squares, which physics that explodes has no numbers for


def _alt(drawn: dict[str, list[Pair]]) -> str:
    told = [
        f"{name.lower()}, {len(pairs)} samples are off by {number(_error(pairs), 2)} on average (root mean square)"
        for name, pairs in drawn.items()
        if pairs
    ]
    return f"Fitness of samples in simulation against fitness in reality: {'; '.join(told) or 'no results yet'}."


def _table(items: Sequence[Prediction]) -> Table:
    return Table(
        ("Repetition", "Iteration", "Before", "After", "In reality"),
        tuple(
            (
                str(each.repetition),
                str(each.iteration),
                number(each.simulated_before),
                number(each.simulated_after),
                number(each.fitness),
            )
            for each in items
        ),
    )
