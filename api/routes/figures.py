"""Figures to look at and to put into papers."""

from typing import Annotated

from fastapi import APIRouter, Query, Response
from pydantic import Field, model_validator

from api.dependencies import Id, StoreDep
from api.figures import Drawing, answer, responses
from schemas.figures import FigureRead
from services import experiments, reports
from services.figures.curves import Band, curves_figure
from services.figures.marks import Figure
from services.store.session import Store

router = APIRouter(prefix="/figures", tags=["figures"])


class CurvesDrawing(Drawing):
    """Which curves are drawn, and how."""

    experiment: list[Id] = Field(default=[], max_length=100, description="repeat it for more")
    study: list[Id] = Field(default=[], max_length=20, description="all of its experiments; repeat it for more")
    band: Band | None = Field(
        default=None,
        description="around each curve: 95 % interval of the mean, or SD; left out: SD below five repetitions",
    )
    each: bool = Field(default=False, description="draw every repetition's line behind the mean")

    @model_validator(mode="after")
    def _something_is_drawn(self) -> "CurvesDrawing":
        if not self.experiment and not self.study:
            msg = "name an experiment or a study, as in ?study=… or ?experiment=…&experiment=…"
            raise ValueError(msg)
        return self


@router.get("/curves", summary="Draw curves", response_model=FigureRead, responses=responses())
def draw_curves(store: StoreDep, query: Annotated[CurvesDrawing, Query()]) -> Response:
    """The paper's Fig. 4 for any studies and experiments: curves with their bands, the direct baseline with its SD."""
    return answer(_curves(store, query), query)


def _curves(store: Store, query: CurvesDrawing) -> Figure:
    studies = [experiments.read_study(store, each) for each in query.study]
    curves = [curve for each in studies for curve in reports.study_curves(store, each.id)]
    curves += reports.curves(store, query.experiment) if query.experiment else ()
    title = query.title if query.title is not None else ", ".join(each.name for each in studies)
    return curves_figure(curves, title=title, band=query.band, each=query.each)
