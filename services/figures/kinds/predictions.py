"""What simulators said of a controller, against what reality said."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import dist, sqrt

from gaplab.schemas.predictions import Prediction
from gaplab.services.figures.marks import Axis, Diagonal, Figure, Panel, Points, Table
from gaplab.services.figures.style import INK, Style, style_of
from gaplab.services.figures.words import counted, drawable, heading, limits, number, printable, with_unit

BEFORE, AFTER = "Before tuning on it", "After tuning on it"


@dataclass(frozen=True)
class _Whole:
    """A sample with its fitness in all three: in the simulators before and after tuning on it, and in reality."""

    sample: Prediction
    before: float
    after: float
    real: float


Pair = tuple[float, float]
"""Fitness in simulation and in reality."""


def predictions_figure(
    items: Sequence[Prediction], *, unit: str = "", pending: int = 0, left_out: int = 0, title: str = ""
) -> Figure:
    """The fitness of each sample in simulation against its fitness in reality, with the diagonal on which they agree.

    A sample that misses one of the three, or has one too large to be reckoned with, is left out: before and after are
    compared over the same samples.

    Args:
        items: the samples.
        unit: of fitness.
        pending: how many more there are, which are not computed yet.
        left_out: how many more there are, of later repetitions, which never will be.
        title: above the figure.
    """
    whole = _whole(items)
    drawn = {BEFORE: [(each.before, each.real) for each in whole], AFTER: [(each.after, each.real) for each in whole]}
    told = tuple(f"repetition {each.sample.repetition}, iteration {each.sample.iteration}" for each in whole)
    values = [value for pairs in drawn.values() for both in pairs for value in both]
    ends = limits(values)
    marks = (
        Diagonal("Simulation agrees with reality", Style(INK, "dashed", "circle")) if values else None,
        _points(BEFORE, drawn[BEFORE], told, style_of(1), hollow=True),
        _points(AFTER, drawn[AFTER], told, style_of(0), hollow=False),
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
        caption=_caption(items, drawn, unit, pending, left_out),
        alt=_alt(drawn),
        table=_table(items),
        nothing="no results yet" if not pending else "being computed",
    )


def _whole(items: Sequence[Prediction]) -> list[_Whole]:
    found = []
    for each in items:
        before, after, real = map(drawable, (each.simulated_before, each.simulated_after, each.fitness))
        if before is not None and after is not None and real is not None:
            found.append(_Whole(each, before, after, real))
    return found


def _points(name: str, pairs: Sequence[Pair], told: tuple[str, ...], style: Style, *, hollow: bool) -> Points:
    simulated, real = tuple(each for each, _ in pairs), tuple(each for _, each in pairs)
    return Points(name, real, simulated, style, hover=told, hollow=hollow)


def _caption(items: Sequence[Prediction], drawn: dict[str, list[Pair]], unit: str, pending: int, left_out: int) -> str:
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
    failed = len(items) - len(drawn[BEFORE])
    parts += [f"{counted([failed], 'sample')} left out: a measurement or the physics failed."] if failed else []
    parts += [f"{counted([left_out], 'sample')} of later repetitions left out: they are too many."] if left_out else []
    parts += [f"{counted([pending], 'sample')} still being computed."] if pending else []
    return " ".join(parts)


def _error(pairs: Sequence[Pair]) -> float:
    simulated, real = zip(*pairs, strict=True)
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
