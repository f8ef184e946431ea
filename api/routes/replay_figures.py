"""Figures of one controller and of one iteration: its gait, and the toy of the paper's Fig. 3."""

from typing import Annotated

from fastapi import APIRouter, Query, Response
from pydantic import Field

from gaplab.api.http.dependencies import Id, RolloutProcessDep, StoreDep
from gaplab.api.http.figures import Drawing, answer, responses
from gaplab.api.http.problems import documented
from gaplab.api.routes.replays import ReplayQuery
from gaplab.schemas.figures import FigureRead
from gaplab.services.figures.kinds.gait import gait_figure
from gaplab.services.figures.kinds.toy import toy_figure
from gaplab.services.replay.replays import replay
from gaplab.services.replay.rollout import ReplayChoice
from gaplab.services.results.toy import toys

router = APIRouter(prefix="/figures", tags=["figures"])


class GaitDrawing(Drawing, ReplayQuery):
    """Whose gait is drawn, and how."""

    experiment: Id


class ToyDrawing(Drawing):
    """Which iterations are drawn, and how."""

    experiment: Id
    repetition: int = Field(default=0, ge=0, le=1_000_000, description="its number, from 0")
    iteration: list[Annotated[int, Field(ge=0, le=1_000_000)]] = Field(
        default=[], max_length=12, description="repeat it for more panels; left out: the last"
    )


@router.get(
    "/gait", summary="Draw a gait", response_model=FigureRead, responses=responses() | documented(404, 409, 422, 429)
)
def draw_gait(store: StoreDep, process: RolloutProcessDep, query: Annotated[GaitDrawing, Query()]) -> Response:
    """A controller's footfalls, height and speed over time, in its simulator and in reality.

    As of a replay, reality is shown of controllers that were measured there; 409 before they are.
    """
    wanted = ReplayChoice(query.repetition, query.iteration, query.kind, query.simulator)
    return answer(gait_figure(replay(store, process, query.experiment, wanted), title=query.title), query)


@router.get("/toy", summary="Draw the toy function", response_model=FigureRead, responses=responses())
def draw_toy(store: StoreDep, query: Annotated[ToyDrawing, Query()]) -> Response:
    """The paper's Fig. 3: the true function, tuned approximations, samples and transfer after some iterations.

    The true function is drawn once the experiment has ended, and with it all others of its study.
    """
    found = toys(store, query.experiment, query.repetition, query.iteration)
    return answer(toy_figure(found, title=query.title), query)
