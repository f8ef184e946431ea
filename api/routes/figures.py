"""Figures to look at and to put into papers."""

from typing import Annotated, Literal

from fastapi import APIRouter, Query, Response
from pydantic import Field, model_validator

from api.dependencies import Id, Parameters, StoreDep
from api.pages import page
from api.problems import documented
from services import experiments, reports
from services.figures.definition import Band, Figure, curves_figure
from services.figures.html import render_html
from services.figures.svg import render_svg
from services.store.session import Store

router = APIRouter(prefix="/figures", tags=["curves"])

MEDIA_TYPES = {"html": "text/html", "svg": "image/svg+xml"}
RENDERERS = {"html": render_html, "svg": render_svg}


class FigureQuery(Parameters):
    """What is drawn, and how."""

    experiment: list[Id] = Field(default=[], max_length=100, description="repeat it for more")
    study: list[Id] = Field(default=[], max_length=20, description="all of its experiments; repeat it for more")
    format: Literal["html", "svg"] = "html"
    band: Band | None = Field(
        default=None,
        description="around each curve: 95 % interval of the mean, or SD; left out: SD below five repetitions",
    )
    title: str | None = Field(default=None, max_length=200, description="left out: the study's name")

    @model_validator(mode="after")
    def _something_is_drawn(self) -> "FigureQuery":
        if not self.experiment and not self.study:
            msg = "name an experiment or a study, as in ?study=… or ?experiment=…&experiment=…"
            raise ValueError(msg)
        return self


@router.get(
    "/curves",
    summary="Draw curves",
    response_class=Response,
    responses={
        200: {
            "description": "A page that needs nothing else, or a file for a paper",
            "content": {
                "text/html": {"schema": {"type": "string"}, "example": "<!doctype html><html lang='en'>…"},
                "image/svg+xml": {"schema": {"type": "string"}, "example": "<svg xmlns='http://www.w3.org/2000/svg'>…"},
            },
        },
        **documented(404, 422),
    },
)
def draw_curves(store: StoreDep, query: Annotated[FigureQuery, Query()]) -> Response:
    """The paper's Fig. 4 for any studies and experiments: curves with their bands, the direct baseline with its SD."""
    drawn = RENDERERS[query.format](_figure(store, query))
    return page(drawn) if query.format == "html" else Response(drawn, media_type=MEDIA_TYPES[query.format])


def _figure(store: Store, query: FigureQuery) -> Figure:
    studies = [experiments.read_study(store, each) for each in query.study]
    curves = [curve for each in studies for curve in reports.study_curves(store, each.id)]
    curves += reports.curves(store, query.experiment) if query.experiment else ()
    title = query.title if query.title is not None else ", ".join(each.name for each in studies)
    return curves_figure(curves, title=title, band=query.band)
