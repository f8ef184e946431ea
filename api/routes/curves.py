"""Curves, as JSON or CSV, and statistical tests between them."""

from dataclasses import replace
from typing import Annotated, Literal

from fastapi import APIRouter, Query, Response
from pydantic import Field

from gaplab.api.http.dependencies import Id, Parameters, StoreDep
from gaplab.api.http.problems import Responses, documented
from gaplab.schemas.curves import Comparison, Curve
from gaplab.services.core.errors import InvalidSpec
from gaplab.services.results import curves
from gaplab.services.results.comparison_tables import comparisons_csv, comparisons_latex

router = APIRouter(tags=["curves"])

Ids = Annotated[list[Id], Field(min_length=1, max_length=100, description="ids of experiments; repeat for more")]
Evaluations = Annotated[int | None, Field(ge=0, le=1_000)]

_ROWS = """experiment,name,strategy,repetition,evaluations,fitness
01f2e3d4c5b6,simulated_fit,simulated_fit,0,0,0.9
"""
_CSV: Responses = {200: {"content": {"text/csv": {"schema": {"type": "string"}, "example": _ROWS}}}}
_TABLE = {"schema": {"type": "string"}, "example": "first,first_name,second,second_name,from_evaluations,…\n"}
_TABLES: Responses = {
    200: {
        "content": {
            "text/csv": _TABLE,
            "application/x-latex": {"schema": {"type": "string"}, "example": "\\begin{table}…"},
        }
    }
}


class CurveQuery(Parameters):
    """The format of curves."""

    format: Literal["json", "csv"] = "json"


class CurvesQuery(CurveQuery):
    """The experiments whose curves to return, and the format."""

    experiment: Ids


class ComparisonQuery(Parameters):
    """The experiments to compare, and the range of real-world evaluations to pool.

    A range of several numbers is pooled as in the paper, and its p-values are too small; ask for a single number.
    """

    experiment: Annotated[Ids, Field(min_length=2)]
    format: Literal["json", "csv", "latex"] = "json"
    from_evaluations: Evaluations = Field(
        default=None, alias="from", description="smallest number to pool; left out: 1"
    )
    to_evaluations: Evaluations = Field(
        default=None, alias="to", description="largest number to pool; left out: the largest of any experiment"
    )


@router.get(
    "/experiments/{id}/curve",
    summary="Read an experiment's curve",
    response_model=Curve,
    response_description="The curve over all repetitions",
    responses=_CSV | documented(404),
)
def read_curve(id: Id, store: StoreDep, query: Annotated[CurveQuery, Query()]) -> Curve | Response:
    """Return mean, SD, n and 95 % interval after each real-world evaluation, and the value of each repetition."""
    curve = curves.curve(store, id)
    return _csv((curve,)) if query.format == "csv" else curve


@router.get(
    "/studies/{id}/curves",
    summary="Read a study's curves",
    response_model=tuple[Curve, ...],
    response_description="One for each experiment",
    responses=_CSV | documented(404, 422),
)
def read_study_curves(id: Id, store: StoreDep, query: Annotated[CurveQuery, Query()]) -> tuple[Curve, ...] | Response:
    """Return the curves of a study's experiments, in the order of the study."""
    return _formatted(curves.study_curves(store, id), query)


@router.get(
    "/curves",
    summary="Read the curves of any experiments",
    response_model=tuple[Curve, ...],
    response_description="In the order of the query",
    responses=_CSV | documented(404, 422),
)
def read_curves(store: StoreDep, query: Annotated[CurvesQuery, Query()]) -> tuple[Curve, ...] | Response:
    """Return the curves of the named experiments, in that order."""
    return _formatted(curves.curves(store, query.experiment), query)


@router.get(
    "/comparisons",
    summary="Compare experiments",
    response_model=tuple[Comparison, ...],
    response_description="One for each pair",
    responses=_TABLES | documented(404, 422),
)
def compare_experiments(
    store: StoreDep, query: Annotated[ComparisonQuery, Query()]
) -> tuple[Comparison, ...] | Response:
    """Compare every pair by the paper's t-test, Welch's and Mann-Whitney's, with Holm's correction over all pairs."""
    first, last = query.from_evaluations, query.to_evaluations
    try:
        pairs = curves.compare(store, query.experiment, from_evaluations=first, to_evaluations=last)
    except InvalidSpec as error:
        renamed = (replace(each, pointer=each.pointer.removesuffix("_evaluations")) for each in error.violations)
        raise InvalidSpec(renamed) from error
    if query.format == "csv":
        return _file(comparisons_csv(pairs), "text/csv", "gaplab-comparisons.csv")
    if query.format == "latex":
        unit = curves.unit_of(store, query.experiment[0])
        return _file(comparisons_latex(pairs, unit), "application/x-latex", "gaplab-comparisons.tex")
    return pairs


def _formatted(found: tuple[Curve, ...], query: CurveQuery) -> tuple[Curve, ...] | Response:
    return _csv(found) if query.format == "csv" else found


def _csv(found: tuple[Curve, ...]) -> Response:
    return _file(curves.curves_csv(found), "text/csv", "gaplab-curves.csv")


def _file(text: str, media_type: str, name: str) -> Response:
    return Response(text, media_type=media_type, headers={"Content-Disposition": f'attachment; filename="{name}"'})
