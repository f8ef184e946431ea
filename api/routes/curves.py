"""Curves, as JSON or CSV, and the tests between them."""

from dataclasses import replace
from typing import Annotated, Literal

from fastapi import APIRouter, Query, Response
from pydantic import Field

from gaplab.api.http import examples
from gaplab.api.http.dependencies import Id, Parameters, StoreDep
from gaplab.api.http.problems import documented
from gaplab.schemas.curves import Comparison, Curve
from gaplab.services.core.errors import InvalidSpec
from gaplab.services.results import curves

router = APIRouter(tags=["curves"])

Ids = Annotated[list[Id], Field(min_length=1, max_length=100, description="repeat it for more")]
Evaluations = Annotated[int | None, Field(ge=0, le=1_000)]


class CurveQuery(Parameters):
    """How curves are wanted."""

    format: Literal["json", "csv"] = "json"


class CurvesQuery(CurveQuery):
    """Which curves are wanted, and how."""

    experiment: Ids


class ComparisonQuery(Parameters):
    """Which experiments are compared, and over which counts of real-world evaluations."""

    experiment: Annotated[Ids, Field(min_length=2)]
    from_evaluations: Evaluations = Field(
        default=None, alias="from", description="pool from this count on; left out: 1"
    )
    to_evaluations: Evaluations = Field(
        default=None, alias="to", description="pool up to this count; left out: the last that any has"
    )


@router.get(
    "/experiments/{id}/curve",
    summary="Read an experiment's curve",
    response_model=Curve,
    responses={200: examples.shown(examples.CURVE, "Over its repetitions", csv=examples.CSV), **documented(404)},
)
def read_curve(
    id: Id,  # noqa: A002 - the address says {id}
    store: StoreDep,
    query: Annotated[CurveQuery, Query()],
) -> Curve | Response:
    """Mean, SD, n and 95 % interval after each real-world evaluation, and the value of each repetition."""
    curve = curves.curve(store, id)
    return _csv((curve,)) if query.format == "csv" else curve


@router.get(
    "/studies/{id}/curves",
    summary="Read a study's curves",
    response_model=tuple[Curve, ...],
    responses={
        200: examples.shown([examples.CURVE], "One for each experiment", csv=examples.CSV),
        **documented(404, 422),
    },
)
def read_study_curves(
    id: Id,  # noqa: A002 - the address says {id}
    store: StoreDep,
    query: Annotated[CurveQuery, Query()],
) -> tuple[Curve, ...] | Response:
    """The curves of a study's experiments, in its order."""
    return _wanted(curves.study_curves(store, id), query)


@router.get(
    "/curves",
    summary="Read the curves of any experiments",
    response_model=tuple[Curve, ...],
    responses={
        200: examples.shown([examples.CURVE], "In the order asked for", csv=examples.CSV),
        **documented(404, 422),
    },
)
def read_curves(store: StoreDep, query: Annotated[CurvesQuery, Query()]) -> tuple[Curve, ...] | Response:
    """The curves of the experiments that are named, in that order."""
    return _wanted(curves.curves(store, query.experiment), query)


@router.get(
    "/comparisons",
    summary="Compare experiments",
    responses={200: examples.shown([examples.COMPARISON], "One for each pair"), **documented(404, 422)},
)
def compare_experiments(store: StoreDep, query: Annotated[ComparisonQuery, Query()]) -> tuple[Comparison, ...]:
    """Every pair, by the paper's t-test and by Welch's and Mann-Whitney's, corrected after Holm over all pairs."""
    first, last = query.from_evaluations, query.to_evaluations
    try:
        return curves.compare(store, query.experiment, from_evaluations=first, to_evaluations=last)
    except InvalidSpec as error:
        renamed = (replace(each, pointer=each.pointer.removesuffix("_evaluations")) for each in error.violations)
        raise InvalidSpec(renamed) from error


def _wanted(found: tuple[Curve, ...], query: CurveQuery) -> tuple[Curve, ...] | Response:
    return _csv(found) if query.format == "csv" else found


def _csv(found: tuple[Curve, ...]) -> Response:
    disposition = {"Content-Disposition": 'attachment; filename="gaplab-curves.csv"'}
    return Response(curves.curves_csv(found), media_type="text/csv", headers=disposition)
