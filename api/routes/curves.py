"""Curves, as JSON or CSV."""

from typing import Annotated, Literal

from fastapi import APIRouter, Query, Response
from pydantic import Field

from gaplab.api.commands.tables import curves
from gaplab.api.http.attachments import attachment
from gaplab.api.http.dependencies import Id, Parameters, StoreDep
from gaplab.api.http.problems import Responses, documented
from gaplab.schemas.results import Curve, Fitness

router = APIRouter(tags=["curves"])

Ids = Annotated[
    list[Id],
    Field(min_length=1, max_length=100, description="id of a study, or of an experiment of one; repeat for more"),
]

FITNESS: Fitness = Field(
    default=Fitness.RECORDED,
    description="`recorded`, as in the paper, is the larger fitness of the transferred controller and the best sample; "
    "`transferred` is that of the transferred controller alone; `equal_chances` is the best of those so far",
)

_ROWS = """experiment,name,strategy,repetition,evaluations,fitness
01f2e3d4c5b6,simulated_fit,simulated_fit,0,0,0.9
"""
_CSV: Responses = {200: {"content": {"text/csv": {"schema": {"type": "string"}, "example": _ROWS}}}}


class CurveQuery(Parameters):
    """Whose fitness curves show, and their format."""

    fitness: Fitness = FITNESS
    format: Literal["json", "csv"] = "json"


class CurvesQuery(CurveQuery):
    """The studies whose curves to return, and the format."""

    study: Ids


@router.get(
    "/experiments/{id}/curve",
    summary="Read an experiment's curve",
    response_model=Curve,
    response_description="The curve over all repetitions",
    responses=_CSV | documented(404),
)
def read_curve(id: Id, store: StoreDep, query: Annotated[CurveQuery, Query()]) -> Curve | Response:
    """Return mean, SD, n and 95 % interval after each real-world evaluation, and the value of each repetition."""
    curve = curves.curve(store, id, query.fitness)
    return _csv((curve,)) if query.format == "csv" else curve


@router.get(
    "/curves",
    summary="Read the curves of studies",
    response_model=tuple[Curve, ...],
    response_description="In the order of the query",
    responses=_CSV | documented(404, 422),
)
def read_curves(store: StoreDep, query: Annotated[CurvesQuery, Query()]) -> tuple[Curve, ...] | Response:
    """Return the curves of studies, and of single experiments, in that order, each once."""
    found = curves.curves(store, query.study, query.fitness)
    return _csv(found) if query.format == "csv" else found


def _csv(found: tuple[Curve, ...]) -> Response:
    return attachment(curves.curves_csv(found), "text/csv", "gaplab-curves.csv")
