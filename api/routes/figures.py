"""Figures to look at and to put into papers."""

from dataclasses import replace
from typing import Annotated, Literal

from fastapi import APIRouter, FastAPI, Query, Request, Response
from pydantic import Field, model_validator

from gaplab.api.http.dependencies import Id, RolloutProcessDep, StoreDep
from gaplab.api.http.figures import Drawing, answer, responses
from gaplab.api.http.problems import documented
from gaplab.schemas.figures import FigureRead
from gaplab.services.core.errors import NotFound
from gaplab.services.experiments import submission
from gaplab.services.figures.kinds.curves import Band, curves_figure
from gaplab.services.figures.kinds.predictions import predictions_figure
from gaplab.services.figures.kinds.simulators import simulators_figure
from gaplab.services.figures.kinds.squared_error import squared_error_figure
from gaplab.services.figures.marks import Figure
from gaplab.services.figures.words import TITLE, spoken
from gaplab.services.replay.predictions import predictions
from gaplab.services.results import curves
from gaplab.services.results.curve_costs import abscissa
from gaplab.services.results.tuned_simulators import tunings
from gaplab.services.specs.resolution import is_direct, spec_of
from gaplab.services.store.session import Store

router = APIRouter(prefix="/figures", tags=["figures"])

EACH: bool = Field(default=False, description="draw every repetition's line behind the mean or median")

NARROW_IN = 5.0
"""In a narrower file, panels stand two in a row; else three."""


DIRECT = "the direct baseline tunes no simulators"
"""What is said in place of what it does not have."""


class CurvesDrawing(Drawing):
    """Which curves are drawn, and how."""

    experiment: list[Id] = Field(default=[], max_length=100, description="repeat it for more")
    study: list[Id] = Field(default=[], max_length=20, description="all of its experiments; repeat it for more")
    band: Band | None = Field(
        default=None,
        description="around each curve: 95 % interval of the mean, or SD; left out: SD below five repetitions",
    )
    x: Literal["evaluations", "rollouts", "time"] = Field(
        default="evaluations", description="number of real-world evaluations, or what was spent until then"
    )
    cost_s: float = Field(
        default=0.0, ge=0, le=1e9, description="seconds that one real-world evaluation takes, where x is time"
    )
    each: bool = EACH

    @model_validator(mode="after")
    def _something_is_drawn(self) -> "CurvesDrawing":
        if not self.experiment and not self.study:
            msg = "name an experiment or a study, as in ?study=… or ?experiment=…&experiment=…"
            raise ValueError(msg)
        return self


class ExperimentDrawing(Drawing):
    """Which experiment is drawn, and how."""

    experiment: Id


class ErrorDrawing(ExperimentDrawing):
    """Which experiment's squared error is drawn, and how."""

    each: bool = EACH


class SimulatorsDrawing(ExperimentDrawing):
    """Which experiment's simulators are drawn, and how."""

    columns: int | None = Field(default=None, ge=1, le=6, description="panels in a row, at most")


@router.get("/curves", summary="Draw curves", response_model=FigureRead, responses=responses())
def draw_curves(store: StoreDep, query: Annotated[CurvesDrawing, Query()]) -> Response:
    """The paper's Fig. 4 for any studies and experiments: curves with their bands, the direct baseline with its SD."""
    return answer(_curves(store, query), query)


@router.get("/squared-error", summary="Draw the squared error", response_model=FigureRead, responses=responses())
def draw_squared_error(store: StoreDep, query: Annotated[ErrorDrawing, Query()]) -> Response:
    """The squared error of an experiment's best tuned simulator, by iteration: median and quartiles of repetitions."""
    found = tunings(store, query.experiment)
    figure = squared_error_figure(found.errors, unit=found.unit, title=_title(store, query), each=query.each)
    return answer(_explained(store, query, figure), query)


@router.get("/simulators", summary="Draw tuned simulators", response_model=FigureRead, responses=responses())
def draw_simulators(store: StoreDep, query: Annotated[SimulatorsDrawing, Query()]) -> Response:
    """An experiment's best simulators in the space of its tunables; with reality once all of its study have ended."""
    found, title = tunings(store, query.experiment), _title(store, query)
    narrow = query.format not in {"html", "json"} and query.width < NARROW_IN
    columns = query.columns or (2 if narrow else 3)
    figure = simulators_figure(found.simulators, found.dimensions, truth=found.truth, title=title, columns=columns)
    return answer(_explained(store, query, figure), query)


@router.get(
    "/predictions",
    summary="Draw what simulators predicted",
    response_model=FigureRead,
    responses=responses() | documented(404, 422, 429),
)
def draw_predictions(
    store: StoreDep, process: RolloutProcessDep, query: Annotated[ExperimentDrawing, Query()]
) -> Response:
    """The fitness of the samples of an experiment in simulation, before and after tuning on it, against reality.

    About two seconds are computed for each question; ask again while some samples are pending, as its caption says.
    """
    found = predictions(store, process, query.experiment)
    counts = {"pending": found.pending, "left_out": found.left_out}
    figure = predictions_figure(found.items, unit=found.unit, **counts, title=_title(store, query))
    return answer(_explained(store, query, figure), query)


def install(app: FastAPI) -> None:
    """Let the address of a figure that is none say which there are; after all routes that draw one."""
    app.add_api_route(f"{router.prefix}/{{kind}}", _draw_nothing, include_in_schema=False)


def _draw_nothing(kind: str, request: Request) -> None:
    prefix = f"{router.prefix}/"
    kinds = sorted(each.removeprefix(prefix) for each in request.app.openapi()["paths"] if each.startswith(prefix))
    msg = f"there is no figure {kind[:64]!r}; permitted: {', '.join(kinds)}"
    raise NotFound(msg)


def _title(store: Store, query: ExperimentDrawing) -> str:
    if query.title is not None:
        return query.title
    return spoken(submission.read_experiment(store, query.experiment).name, TITLE)


def _explained(store: Store, query: ExperimentDrawing, figure: Figure) -> Figure:
    """The figure, which says so if it will always be empty."""
    if not figure.empty or not is_direct(spec_of(submission.read_experiment(store, query.experiment).spec)):
        return figure
    return replace(figure, nothing=DIRECT, alt=f"Nothing: {DIRECT}.")


def _curves(store: Store, query: CurvesDrawing) -> Figure:
    studies = [submission.read_study(store, each) for each in query.study]
    found = [curve for study in studies for curve in curves.study_curves(store, study.id)]
    found += curves.curves(store, query.experiment) if query.experiment else ()
    found = list({curve.experiment: curve for curve in found}.values())  # an experiment that is named twice is one line
    title = query.title if query.title is not None else ", ".join(each.name for each in studies)
    against = None if query.x == "evaluations" else abscissa(store, found, query.x, cost_s=query.cost_s)
    return curves_figure(found, title=title, band=query.band, against=against, each=query.each)
