"""Predictions: the fitness of samples in simulation against their fitness in reality."""

from collections.abc import Sequence
from math import dist, sqrt

from gaplab.schemas.replays import Prediction
from gaplab.services.figures.marks import Axis, Diagonal, FigureDefinition, Panel, Points, Table
from gaplab.services.figures.style import INK, Style, style_of
from gaplab.services.figures.words import drawable, heading, limits, number, number_of, printable, with_unit

BEFORE, AFTER = "Before tuning on it", "After tuning on it"
KNOWN = "From before the experiment, after tuning on it"


Pair = tuple[float, float]
"""Fitness in simulation and in reality."""


def predictions_figure(
    items: Sequence[Prediction], *, unit: str = "", pending: int = 0, left_out: int = 0, title: str = ""
) -> FigureDefinition:
    """Return a figure of the samples, with the diagonal on which simulation and reality agree.

    A sample is left out if one of its three fitnesses is missing or too large to compute with, so that before and after
    are compared over the same samples. The caption says how many are `pending`, and how many of later repetitions are
    `left_out`, which will not be computed.
    """
    told, drawn = _pairs(items)
    values = [value for pairs in drawn.values() for both in pairs for value in both]
    ends = limits(values)
    marks = (
        Diagonal("Simulation agrees with reality", Style(INK, "dashed", "circle")) if values else None,
        _points(BEFORE, drawn, told, style_of(1), hollow=True),
        _points(AFTER, drawn, told, style_of(0), hollow=False),
        _points(KNOWN, drawn, told, style_of(2), hollow=False) if drawn[KNOWN] else None,
    )
    panel = Panel(
        tuple(mark for mark in marks if mark is not None),
        Axis(with_unit("Fitness in reality", {unit}), ends),
        Axis(with_unit("Fitness in simulation", {unit}), ends),
        square=True,
    )
    return FigureDefinition(
        name="predictions",
        title=heading(title),
        panels=(panel,),
        caption=_caption(items, drawn, unit, pending, left_out),
        alt=_alt(drawn),
        table=_table(items),
        nothing="no results yet" if not pending else "being computed",
    )


def _pairs(items: Sequence[Prediction]) -> tuple[dict[bool, list[str]], dict[str, list[Pair]]]:
    told, drawn = {True: list[str](), False: list[str]()}, {name: list[Pair]() for name in (BEFORE, AFTER, KNOWN)}
    for each in items:
        before, after, real = map(drawable, (each.simulated_before, each.simulated_after, each.fitness))
        if after is None or real is None or (before is None and each.iteration):
            continue
        told[each.iteration == 0].append(f"repetition {each.repetition}, iteration {each.iteration}")
        drawn[AFTER if each.iteration else KNOWN].append((after, real))
        if before is not None:
            drawn[BEFORE].append((before, real))
    return told, drawn


def _points(
    name: str, drawn: dict[str, list[Pair]], told: dict[bool, list[str]], style: Style, *, hollow: bool
) -> Points:
    simulated, real = tuple(each for each, _ in drawn[name]), tuple(each for _, each in drawn[name])
    return Points(name, real, simulated, style, hover=tuple(told[name == KNOWN]), hollow=hollow)


def _caption(items: Sequence[Prediction], drawn: dict[str, list[Pair]], unit: str, pending: int, left_out: int) -> str:
    if not items:
        return ""
    repetitions = len({each.repetition for each in items})
    parts = [
        f"{number_of('sample', len(items))} of {number_of('repetition', repetitions)}, each in the best simulator "
        f"{'before it was measured, and in the best simulator ' if drawn[BEFORE] else ''}after tuning on it."
    ]
    shown = f"\N{NO-BREAK SPACE}{printable(unit)}" if unit not in {"", "1"} else ""
    parts += [
        f"{name}: root-mean-square error {number(_error(pairs), 2)}{shown}." for name, pairs in drawn.items() if pairs
    ]
    failed = len(items) - len(drawn[AFTER]) - len(drawn[KNOWN])
    parts += [f"{number_of('sample', failed)} left out: a measurement or the physics failed."] if failed else []
    parts += [f"{number_of('sample', left_out)} of later repetitions left out: there are too many."] if left_out else []
    parts += [f"{number_of('sample', pending)} still being computed."] if pending else []
    return " ".join(parts)


def _error(pairs: Sequence[Pair]) -> float:
    simulated, real = zip(*pairs, strict=True)
    return dist(simulated, real) / sqrt(len(pairs))  # squares of diverging physics would overflow


def _alt(drawn: dict[str, list[Pair]]) -> str:
    told = [
        f"{name.lower()}, the root-mean-square error of {number_of('sample', len(pairs))} is {number(_error(pairs), 2)}"
        for name, pairs in drawn.items()
        if pairs
    ]
    return f"Fitness of samples in simulation against fitness in reality: {'; '.join(told) or 'no results yet'}."


def _table(items: Sequence[Prediction]) -> Table:
    return Table(
        ("Repetition", "Iteration", "Before", "After", "In reality"),
        tuple(
            (
                *map(str, (each.repetition, each.iteration)),
                *map(number, (each.simulated_before, each.simulated_after, each.fitness)),
            )
            for each in items
        ),
    )
