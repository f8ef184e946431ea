"""Figures of studies, experiments and controllers, for the browser, for notebooks and for papers."""

from collections.abc import Callable
from dataclasses import replace
from typing import TypeVar

from fastapi import APIRouter, FastAPI, Request, Response
from pydantic import Field, Json

from gaplab.api.http.dependencies import Asked, Id, Number, RolloutProcessDep, StoreDep
from gaplab.api.http.figures import SENT, FigureQuery, answer
from gaplab.api.http.problems import documented
from gaplab.api.routes.curves import Ids
from gaplab.api.routes.replays import ReplayQuery
from gaplab.schemas.costs import CostModel
from gaplab.schemas.curves import Fitness
from gaplab.schemas.figures import FigureRead
from gaplab.schemas.replays import Replay
from gaplab.services.core.errors import NotFound
from gaplab.services.core.strategies import strategies
from gaplab.services.experiments import reading
from gaplab.services.figures.kinds.curves import Band, curves_figure
from gaplab.services.figures.kinds.predictions import predictions_figure
from gaplab.services.figures.kinds.replays import gait_figure, readings_figure
from gaplab.services.figures.kinds.simulators import simulators_figure
from gaplab.services.figures.kinds.squared_error import squared_error_figure
from gaplab.services.figures.kinds.toy import toy_figure
from gaplab.services.figures.marks import FigureDefinition
from gaplab.services.figures.words import TITLE, titled
from gaplab.services.replay.process import RolloutProcess
from gaplab.services.replay.replays import predictions, replay
from gaplab.services.results import curves
from gaplab.services.results.costs import cost_axis
from gaplab.services.results.toy import toy_iterations
from gaplab.services.results.tuned_simulators import setting_coordinates, simulator_coordinates, tuned_simulators
from gaplab.services.specs.stored_specs import spec_of
from gaplab.services.store.session import Store

router = APIRouter(prefix="/figures", tags=["figures"])

Endpoint = TypeVar("Endpoint", bound=Callable[..., Response])

EACH: bool = Field(False, description="whether to draw each repetition's line behind the mean or median")

NARROW_IN = 5.0
"""A file narrower than this has two panels in a row, else three."""

DIRECT = "the direct baseline tunes no simulators"
UNTUNED = "its strategy tunes no simulators"
"""The message in place of a figure of simulators that do not exist."""


class CoordinatesDrawing(FigureQuery):
    """The studies to draw, and how."""

    study: Ids


class CurvesDrawing(CoordinatesDrawing, CostModel):
    """The curves to draw, and how."""

    band: Band | None = Field(
        None, description="around each curve: 95 % interval of the mean, or SD; left out: SD below five repetitions"
    )
    each: bool = EACH
    fitness: Fitness | None = Field(
        None, description="as of curves; left out: recorded, with thin lines for transferred controllers alone"
    )
    labels: Json[dict[str, str]] = Field(
        {}, description='names of experiments by their id, name or strategy, as JSON like `{"random": "Chance"}`'
    )
    order: str = Field(
        "", max_length=10_000, description="experiments that come first, by id, name or strategy, like `direct,random`"
    )


class ExperimentDrawing(FigureQuery):
    """The experiment to draw, and how."""

    experiment: Id


class ErrorDrawing(ExperimentDrawing):
    """The experiment whose squared error to draw, and how."""

    each: bool = EACH


class SimulatorsDrawing(ExperimentDrawing):
    """The experiment whose simulators to draw, and how."""

    columns: int | None = Field(None, ge=1, le=6, description="most panels in a row")


class ReplayDrawing(ExperimentDrawing, ReplayQuery):
    """The controller whose motion to draw, and how."""


class ToyDrawing(ExperimentDrawing):
    """The iterations to draw, and how."""

    repetition: Number = Field(0, description="number of the repetition, from 0")
    iteration: list[Number] = Field([], max_length=12, description="repeat for more panels; left out: the last")


def _figure(path: str, summary: str, *statuses: int) -> Callable[[Endpoint], Endpoint]:
    """Return what makes a function the endpoint of a figure, with problems besides those of all figures."""
    return router.get(path, summary=summary, response_model=FigureRead, responses=SENT | documented(*statuses))


@_figure("/curves", "Draw curves")
def draw_curves(store: StoreDep, query: Asked[CurvesDrawing]) -> Response:
    """Draw the paper's Fig. 4 for any studies: curves and levels with bands."""
    return answer(_curves(store, query), query)


@_figure("/squared-error", "Draw the squared error")
def draw_squared_error(store: StoreDep, query: Asked[ErrorDrawing]) -> Response:
    """Draw the error of an experiment's best simulator by iteration, per sample and summed: median and quartiles."""
    tuned = tuned_simulators(store, query.experiment)
    title, samples = _title(store, query), tuned.samples
    figure = squared_error_figure(tuned.errors, tuned.error, samples=samples, title=title, each=query.each)
    return answer(_explained(store, query, figure), query)


@_figure("/simulators", "Draw tuned simulators")
def draw_simulators(store: StoreDep, query: Asked[SimulatorsDrawing]) -> Response:
    """Draw an experiment's best simulators in the space of its tunables, with reality once its study has ended."""
    tuned, title = tuned_simulators(store, query.experiment), _title(store, query)
    narrow = query.format not in {"html", "json"} and query.width < NARROW_IN
    columns = query.columns or (2 if narrow else 3)
    figure = simulators_figure(
        tuned.simulators,
        tuned.dimensions,
        truth=tuned.truth,
        real_engine=tuned.real_engine,
        title=title,
        columns=columns,
    )
    return answer(_explained(store, query, figure), query)


@_figure("/coordinates", "Draw parallel coordinates")
def draw_coordinates(store: StoreDep, query: Asked[CoordinatesDrawing]) -> Response:
    """Draw parallel coordinates: the simulators of one experiment, or the settings that differ between experiments.

    Of one experiment, each line is the best simulator of an iteration: its tunables, its error per sample, and the
    real fitness of the controller that evolved in it. Of several, each line is an experiment with its final fitness.
    """
    if len(query.study) == 1 and len(found := reading.read(store, query.study[0]).experiments) == 1:
        alone = ExperimentDrawing(experiment=found[0].id, title=query.title)
        figure = simulator_coordinates(tuned_simulators(store, alone.experiment), title=_title(store, alone))
        return answer(_explained(store, alone, figure), query)
    return answer(setting_coordinates(store, query.study, title=_names(store, query)), query)


@_figure("/predictions", "Draw what simulators predicted")
def draw_predictions(store: StoreDep, process: RolloutProcessDep, query: Asked[ExperimentDrawing]) -> Response:
    """Draw the simulated fitness of an experiment's samples, before and after tuning on them, against reality.

    Each request computes for about two seconds; repeat it while some samples are pending, as the caption says.
    """
    found = predictions(store, process, query.experiment)
    counts = {"pending": found.pending, "left_out": found.left_out}
    figure = predictions_figure(found.items, unit=found.unit, **counts, title=_title(store, query))
    return answer(_explained(store, query, figure), query)


@_figure("/gait", "Draw a gait", 409)
def draw_gait(store: StoreDep, process: RolloutProcessDep, query: Asked[ReplayDrawing]) -> Response:
    """Draw a controller's footfalls, height and speed over time, in its simulator and in reality.

    Like a replay, it shows reality for controllers that were measured there; before, the answer is 409.
    """
    return answer(gait_figure(_replay(store, process, query), title=query.title), query)


@_figure("/readings", "Draw the readings of sensors", 409)
def draw_readings(store: StoreDep, process: RolloutProcessDep, query: Asked[ReplayDrawing]) -> Response:
    """Draw what the robot's sensors said in reality, and what they say in a tuned simulator."""
    return answer(readings_figure(_replay(store, process, query), title=query.title), query)


@_figure("/toy", "Draw the toy function")
def draw_toy(store: StoreDep, query: Asked[ToyDrawing]) -> Response:
    """Draw the paper's Fig. 3: the true function, its tuned approximations, the samples and the transfer.

    The true function is drawn once every experiment of the study has ended.
    """
    iterations = toy_iterations(store, query.experiment, query.repetition, query.iteration)
    return answer(toy_figure(iterations, title=query.title), query)


def install(app: FastAPI) -> None:
    """Answer the address of an unknown figure with the kinds that exist; call it after including all figures."""
    app.add_api_route(f"{router.prefix}/{{kind}}", _refuse_unknown, include_in_schema=False)


def _refuse_unknown(kind: str, request: Request) -> None:
    prefix = f"{router.prefix}/"
    kinds = sorted(path.removeprefix(prefix) for path in request.app.openapi()["paths"] if path.startswith(prefix))
    raise NotFound(f"unknown figure {kind[:64]!r}; permitted: {', '.join(kinds)}")


def _title(store: Store, query: ExperimentDrawing) -> str:
    if query.title is not None:
        return query.title
    experiment = reading.read_experiment(store, query.experiment)
    return titled(experiment.name, experiment.strategy, TITLE)


def _names(store: Store, query: CoordinatesDrawing) -> str:
    """Return the title; left out, the names of the studies that have several experiments."""
    if query.title is not None:
        return query.title
    studies = (reading.read(store, id) for id in query.study)
    return ", ".join(each.name for each in studies if len(each.experiments) > 1)


def _explained(store: Store, query: ExperimentDrawing, figure: FigureDefinition) -> FigureDefinition:
    """Return the figure, with an explanation if it will always be empty."""
    spec = spec_of(reading.read_experiment(store, query.experiment).spec)
    kind = strategies.get(spec.strategy.name)
    if not figure.empty or kind is None or (kind.takes_samples and kind.tunes):
        return figure
    why = DIRECT if kind.in_reality else UNTUNED
    return replace(figure, nothing=why, alt=f"Nothing: {why}.")


def _curves(store: Store, query: CurvesDrawing) -> FigureDefinition:
    found = curves.curves(store, query.study, query.fitness or Fitness.RECORDED)
    drawn = curves.arranged(found, query.labels, query.order.split(",") if query.order else ())
    beside = () if query.fitness else curves.curves(store, query.study, Fitness.TRANSFERRED)
    against = None if query.x == "evaluations" else cost_axis(store, drawn, query)
    return curves_figure(
        drawn, title=_names(store, query), band=query.band, against=against, each=query.each, beside=beside
    )


def _replay(store: Store, process: RolloutProcess, query: ReplayDrawing) -> Replay:
    return replay(store, process, query.experiment, query.choice())
