"""Curves and figures for the tests of figures."""

from gaplab.schemas.curves import Curve, CurvePoint
from gaplab.schemas.lifecycle import State
from gaplab.schemas.replays import Prediction
from gaplab.services.figures.kinds.coordinates import Coordinate, coordinates_figure
from gaplab.services.figures.kinds.curves import curves_figure
from gaplab.services.figures.kinds.predictions import predictions_figure
from gaplab.services.figures.kinds.simulators import Dimension, SimulatorPoint, simulators_figure
from gaplab.services.figures.kinds.squared_error import ErrorKind, squared_error_figure
from gaplab.services.figures.marks import (
    Arrow,
    Axis,
    Bars,
    Diagonal,
    FigureDefinition,
    Label,
    Level,
    Line,
    Panel,
    Points,
    Polylines,
    Table,
)
from gaplab.services.figures.style import style_of

NAMES = [
    "<script>alert(1)</script>",
    "a $\\frac{ b",
    "--> x",
    "\x01\x1b[31m",
    "%",
    "_a_b^c_",
    "x" * 200,
    "{braces}",
    "%{y}</script>",
    "走る 🤖",
]
"""Names that a careless renderer takes for something else."""


def point(evaluations: int, mean: float | None, n: int = 30, sd: float | None = 0.1) -> CurvePoint:
    ends = (mean - 0.2, mean + 0.2) if mean is not None and sd is not None else (None, None)
    values = (mean,) if n < 2 else (mean, None if mean is None else mean + 0.1)
    return CurvePoint(evaluations=evaluations, n=n, mean=mean, sd=sd, lower=ends[0], upper=ends[1], values=values)


def curve(name: str, *points: CurvePoint, direct: bool = False, unit: str = "m/s") -> Curve:
    return Curve(
        experiment=f"id-of-{name[:20]}",
        name=name,
        strategy=name if name.isidentifier() else "s",
        state=State.RUNNING,
        unit=unit,
        direct=direct,
        level=direct,
        points=points,
    )


RISING = curve("simulated_fit", point(0, 0.9), point(1, 1.2), point(2, 1.3))
DIRECT = curve("direct", point(0, 1.33, n=100, sd=0.1), direct=True)

_X, _Y = Axis("time (s)", (0, 4)), Axis("height (m)", (-1, 2))

EVERYTHING = FigureDefinition(
    name="everything",
    title="Every mark",
    panels=(
        Panel(
            (
                Bars("reality", ((0, 1, 0), (2, 3.5, 1)), style_of(1), 0.3),
                Level("landing", 2.5, upright=True, lower=2.4, upper=2.6),
            ),
            _X,
            Axis("", (-0.5, 1.5), ticks=((0, "left"), (1, "right"))),
            title="Footfall",
            height=0.5,
        ),
        Panel(
            (
                Line(
                    "simulator", (0, 1, None, 3, 4), (0, 1, None, 1, 0.5), style_of(0), hover=("a", "b", "", "c", "d")
                ),
                Line("simulator", (0, 2, 4), (0.1, 0.2, 0.1), style_of(0), faint=True),
                Line("second", (0, 2, 4), (-0.5, 0.2, 0.1), style_of(2), (-1, 0, 0), (0, 0.3, 0.2)),
                Level("mean", 0.5, lower=0.4, upper=0.6),
                Diagonal("equal"),
                Points("tuned", (1, 2, 3), (0.5, 1, 1.5), style_of(3), shades=(0, 1, 2), shades_label="Iteration"),
                Polylines("paths", (0, 2, 4), ((0, 1, 0), (1, None, 1)), (0, 2), "Iteration", ("a", "b")),
                Points("truth", (2,), (1.8,), style_of(4), size=2, hollow=True),
                Arrow((1, 0), (3, 1), style_of(5)),
                Arrow((1, 0), (3, -0.5)),
                Label("here", 1, 0, beside=True),
            ),
            _X,
            _Y,
        ),
        Panel((Line("error", (0, 2, 4), (1e-6, 1e-3, 20)),), _X, Axis("squared error", (1e-7, 100), log=True)),
    ),
    caption="Two repetitions; bands: what is between.",
    alt="A figure with every kind of mark.",
    share_x=True,
    table=Table(("", "a"), (("b", "1"),)),
)

DIMENSIONS = (
    Dimension("static_friction", "1", 0, 1.5),
    Dimension("dynamic_friction", "1", 0.2, 1.5),
    Dimension("body_mass", "kg", 1, 5),
    Dimension("motor_force", "N", 1, 9),
)
"""Four tunables."""

TRUTH = {"static_friction": 1.0, "dynamic_friction": 0.8}
"""Where reality is, as far as it is known."""


def tuned(dimensions: int, repetitions: int = 3, iterations: int = 2) -> list[SimulatorPoint]:
    return [
        SimulatorPoint(
            repetition, iteration, tuple(each.lower + 0.1 * (1 + repetition) for each in DIMENSIONS[:dimensions])
        )
        for repetition in range(repetitions)
        for iteration in range(iterations + 1)
    ]


def prediction(before: float | None, after: float | None, fitness: float | None, repetition: int = 0) -> Prediction:
    return Prediction(
        repetition=repetition, iteration=1, simulated_before=before, simulated_after=after, fitness=fitness
    )


PREDICTIONS = [
    prediction(0.5, 0.9, 1.0),
    prediction(1.5, 1.1, 1.0, 1),
    prediction(None, 0.3, 0.3),
    prediction(1, 1, None),
]
ERRORS = {1: {0: 1e-6, 1: 1e-4, 2: None}, 2: {0: 0.0, 1: 1.0, 2: 0.5}}

COORDINATES = (
    Coordinate("Strategy", ("simulated fit", "random", "<b>own</b>")),
    Coordinate("Static friction", (0.2, 0.4, 1.0), 0.0, 1.5),
    Coordinate("RMS error (m/s)", (1e-6, None, 0.5), wide=True),
    Coordinate("Repetitions", (8.0, 8.0, 8.0)),
)


def coordinates(lines: int = 3, title: str = "") -> FigureDefinition:
    axes = [Coordinate(axis.label, axis.values[:lines], axis.lower, axis.upper, axis.wide) for axis in COORDINATES]
    shades, hover = [0.25, 0.5, 0.75][:lines], ["a", "<i>b</i>", "c"][:lines]
    return coordinates_figure(
        axes, shades=shades, shades_label="Final fitness", hover=hover, what="experiment", title=title
    )


FIGURES = [
    coordinates(title="coordinates"),
    curves_figure([RISING, DIRECT], title="curves", each=True),
    curves_figure([]),
    EVERYTHING,
    simulators_figure(tuned(3), DIMENSIONS[:3], truth=TRUTH, title="simulators"),
    predictions_figure(PREDICTIONS, unit="m/s", title="predictions"),
    squared_error_figure(ERRORS, ErrorKind("m/s"), title="squared error", each=True),
]
"""One of each kind, and one of nothing: what every renderer must draw."""

MORE_FIGURES = [
    coordinates(1),
    coordinates(0),
    curves_figure([curve("a")]),
    curves_figure([DIRECT]),
    curves_figure([curve(f"line {each}", point(0, each)) for each in range(40)]),
    curves_figure([curve("alone", point(0, 1.0, n=1, sd=None), point(1, None, n=0, sd=None))]),
    *(simulators_figure(tuned(each), DIMENSIONS[:each], truth=TRUTH, title="simulators") for each in (1, 2, 4)),
    simulators_figure(tuned(3), DIMENSIONS[:3], truth=None, columns=2),
    simulators_figure([], DIMENSIONS[:3], truth=TRUTH, columns=2),
    predictions_figure(PREDICTIONS[:1]),
    predictions_figure([], pending=5),
    squared_error_figure({1: {0: 0.0}}),
    squared_error_figure({1: {0: None}}),
]
"""Others of each kind."""
