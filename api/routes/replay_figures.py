"""Figures of one controller or one iteration: its gait, its sensors, and the toy function of the paper's Fig. 3."""

from typing import Annotated

from fastapi import APIRouter, Query, Response
from pydantic import Field

from gaplab.api.http.dependencies import Id, RolloutProcessDep, StoreDep
from gaplab.api.http.figures import FigureQuery, answer, responses
from gaplab.api.routes.replays import ReplayQuery
from gaplab.schemas.figures import FigureRead
from gaplab.schemas.replays import Replay
from gaplab.services.figures.kinds.replays import gait_figure, readings_figure
from gaplab.services.figures.kinds.toy import toy_figure
from gaplab.services.replay.process import RolloutProcess
from gaplab.services.replay.replays import replay
from gaplab.services.results.toy import toy_iterations
from gaplab.services.store.session import Store

router = APIRouter(prefix="/figures", tags=["figures"])


class ReplayDrawing(FigureQuery, ReplayQuery):
    """The controller whose motion to draw, and how."""

    experiment: Id


class ToyDrawing(FigureQuery):
    """The iterations to draw, and how."""

    experiment: Id
    repetition: int = Field(default=0, ge=0, le=1_000_000, description="number of the repetition, from 0")
    iteration: list[Annotated[int, Field(ge=0, le=1_000_000)]] = Field(
        default=[], max_length=12, description="repeat for more panels; left out: the last"
    )


@router.get("/gait", summary="Draw a gait", response_model=FigureRead, responses=responses(409))
def draw_gait(store: StoreDep, process: RolloutProcessDep, query: Annotated[ReplayDrawing, Query()]) -> Response:
    """Draw a controller's footfalls, height and speed over time, in its simulator and in reality.

    Like a replay, it shows reality for controllers that were measured there; before, the answer is 409.
    """
    return answer(gait_figure(_replay(store, process, query), title=query.title), query)


@router.get("/readings", summary="Draw the readings of sensors", response_model=FigureRead, responses=responses(409))
def draw_readings(store: StoreDep, process: RolloutProcessDep, query: Annotated[ReplayDrawing, Query()]) -> Response:
    """Draw what the robot's sensors said in reality, and what they say in a tuned simulator."""
    return answer(readings_figure(_replay(store, process, query), title=query.title), query)


@router.get("/toy", summary="Draw the toy function", response_model=FigureRead, responses=responses())
def draw_toy(store: StoreDep, query: Annotated[ToyDrawing, Query()]) -> Response:
    """Draw the paper's Fig. 3: the true function, its tuned approximations, the samples and the transfer.

    The true function is drawn once every experiment of the study has ended.
    """
    iterations = toy_iterations(store, query.experiment, query.repetition, query.iteration)
    return answer(toy_figure(iterations, title=query.title), query)


def _replay(store: Store, process: RolloutProcess, query: ReplayDrawing) -> Replay:
    return replay(store, process, query.experiment, query.choice())
