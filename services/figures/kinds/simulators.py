"""Tuned simulators: the best of each iteration, in the space of the tunables."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

from gaplab.services.figures.marks import Axis, FigureDefinition, Level, Mark, Panel, Points, Table
from gaplab.services.figures.style import INK, Style
from gaplab.services.figures.words import heading, limits, number, number_of, spoken, with_unit

IN_PAIRS = 3
"""Most tunables that are drawn pair by pair; of more, each has a panel against iterations."""

MOST = 5_000
"""Most points in a panel; beyond them, only the first repetitions are drawn."""

REALITY = "Reality"
STAR = Style(INK, "dashed", "star")


@dataclass(frozen=True)
class Dimension:
    """A tunable: its name, its unit and its bounds."""

    name: str
    unit: str
    lower: float
    upper: float


@dataclass(frozen=True)
class SimulatorPoint:
    """The best simulator of one iteration of one repetition.

    Attributes:
        parameters: tuned values, in the order of the dimensions.
        error: its error per sample; None without samples, or if the physics failed on one.
        real: fitness in reality of the controller that evolved in it; None if there is none.
    """

    repetition: int
    iteration: int
    parameters: tuple[float, ...]
    error: float | None = None
    real: float | None = None

    def __str__(self) -> str:
        return f"repetition {self.repetition}, iteration {self.iteration}"


def simulators_figure(
    tuned: Sequence[SimulatorPoint],
    dimensions: Sequence[Dimension],
    *,
    truth: Mapping[str, float] | None,
    real_engine: str | None = None,
    title: str = "",
    columns: int = 3,
) -> FigureDefinition:
    """Return a figure of the best simulators, from light to dark by iteration, and of reality if it may be shown.

    Two or three tunables are drawn pair by pair; one, or more than three, are drawn against iterations. `truth` has the
    known parameters of reality by name, and is None as long as they are hidden. `real_engine` is given if it is not
    that of the simulators: reality then has no such parameters.
    """
    shown = _first_repetitions(sorted(tuned, key=lambda each: (each.iteration, each.repetition)))
    if 1 < len(dimensions) <= IN_PAIRS:
        panels = [_pair(shown, dimensions, pair, truth or {}) for pair in combinations(range(len(dimensions)), 2)]
    else:
        panels = [_alone(shown, dimensions, at, truth or {}) for at in range(len(dimensions))]
    if not shown:
        panels = [replace(panel, marks=()) for panel in panels]  # reality alone is not a result
    return FigureDefinition(
        name="simulators",
        title=heading(title),
        panels=tuple(panels),
        caption=_caption(tuned, shown, truth, real_engine),
        alt=_alt(shown, dimensions, truth or {}),
        columns=min(columns, len(panels)),
        table=_table(shown, dimensions, truth or {}),
    )


def _pair(
    shown: Sequence[SimulatorPoint], dimensions: Sequence[Dimension], pair: tuple[int, int], truth: Mapping[str, float]
) -> Panel:
    one, other = pair
    x, y = dimensions[one], dimensions[other]
    points = _points(shown, [each.parameters[one] for each in shown], [each.parameters[other] for each in shown])
    reality: list[Mark] = []
    if x.name in truth and y.name in truth:
        reality.append(Points(REALITY, (truth[x.name],), (truth[y.name],), STAR, size=2.4))
    elif x.name in truth:
        reality.append(Level(REALITY, truth[x.name], STAR, upright=True))
    elif y.name in truth:
        reality.append(Level(REALITY, truth[y.name], STAR))
    return Panel((*reality, points), _axis(x, truth), _axis(y, truth), square=True)


def _alone(
    shown: Sequence[SimulatorPoint], dimensions: Sequence[Dimension], at: int, truth: Mapping[str, float]
) -> Panel:
    dimension = dimensions[at]
    along = [float(each.iteration) for each in shown]
    points = _points(shown, along, [each.parameters[at] for each in shown])
    reality = [Level(REALITY, truth[dimension.name], STAR)] if dimension.name in truth else []
    last = max([1.0, *along])
    frame = Axis("Iteration", (-0.04 * last, 1.04 * last), whole=True)
    return Panel((*reality, points), frame, _axis(dimension, truth))


def _points(shown: Sequence[SimulatorPoint], x: Sequence[float], y: Sequence[float]) -> Points:
    return Points(
        "Best simulator of a repetition",
        tuple(x),
        tuple(y),
        shades=tuple(each.iteration for each in shown),
        shades_label="Iteration",
        hover=tuple(map(str, shown)),
    )


def _axis(dimension: Dimension, truth: Mapping[str, float]) -> Axis:
    """Return an axis between the bounds, extended to the value of reality if that is known."""
    label = with_unit(spoken(dimension.name), {dimension.unit})
    return Axis(label, limits([dimension.lower, dimension.upper, truth.get(dimension.name)], margin=0.06))


def _first_repetitions(tuned: Sequence[SimulatorPoint]) -> list[SimulatorPoint]:
    iterations = len({each.iteration for each in tuned})
    kept = frozenset(sorted({each.repetition for each in tuned})[: max(1, MOST // max(1, iterations))])
    return [each for each in tuned if each.repetition in kept]


def _caption(
    tuned: Sequence[SimulatorPoint],
    shown: Sequence[SimulatorPoint],
    truth: Mapping[str, float] | None,
    real_engine: str | None,
) -> str:
    if not shown:
        return ""
    repetitions, all_ = (len({each.repetition for each in found}) for found in (shown, tuned))
    of = f" of {all_}" if all_ > repetitions else ""
    parts = [
        f"The best simulator after each iteration of {number_of('repetition', repetitions)}{of}, within the bounds of "
        "tuning; those tuned on no sample are random."
    ]
    if real_engine:
        parts.append(f"Reality is the engine {spoken(real_engine)}: no setting of the simulators is reality.")
    elif truth is None:
        parts.append("Reality is shown once its experiments have ended.")
    return " ".join(parts)


def _alt(shown: Sequence[SimulatorPoint], dimensions: Sequence[Dimension], truth: Mapping[str, float]) -> str:
    if not shown:
        return "Tuned simulators in the space of the tunables: no results yet."
    last = [each for each in shown if each.iteration == shown[-1].iteration]
    told = [
        f"{spoken(dimension.name).lower()} {_range([each.parameters[at] for each in last])}"
        + (f" where reality has {number(truth[dimension.name])}" if dimension.name in truth else "")
        for at, dimension in enumerate(dimensions)
    ]
    return f"Tuned simulators in the space of the tunables, after iteration {shown[-1].iteration}: {'; '.join(told)}."


def _range(values: Sequence[float]) -> str:
    return f"from {number(min(values), 2)} to {number(max(values), 2)}"


def _table(shown: Sequence[SimulatorPoint], dimensions: Sequence[Dimension], truth: Mapping[str, float]) -> Table:
    rows = [(str(each.iteration), str(each.repetition), *map(number, each.parameters)) for each in shown]
    reality = [(REALITY, "", *(number(truth.get(each.name)) for each in dimensions))] if truth else []
    return Table(("Iteration", "Repetition", *(spoken(each.name) for each in dimensions)), (*reality, *rows))
