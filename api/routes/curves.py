"""Curves and comparisons of experiments, and the settings in which they differ, as JSON, CSV or LaTeX."""

from typing import Annotated, Literal

from fastapi import APIRouter, Response
from pydantic import Field

from gaplab.api.http.answers import attachment
from gaplab.api.http.dependencies import Asked, Id, Parameters, StoreDep
from gaplab.api.http.documentation import sent
from gaplab.schemas.comparisons import COLUMNS, Comparison, row
from gaplab.schemas.costs import CostModel
from gaplab.schemas.curves import Curve, Fitness
from gaplab.schemas.differences import SpecDiff
from gaplab.services.core.errors import InvalidSpec, Violation
from gaplab.services.csv_tables import csv_text
from gaplab.services.experiments.reading import read_differences
from gaplab.services.findings.tables import comparison, latex
from gaplab.services.results import curves
from gaplab.services.results.comparisons import Margin, compare, warnings_of

router = APIRouter(tags=["curves"])

Ids = Annotated[
    list[Id],
    Field(min_length=1, max_length=100, description="id of a study, or of an experiment of one; repeat for more"),
]

FITNESS: Fitness = Field(
    Fitness.RECORDED,
    description="`recorded`, as in the paper, is the larger fitness of the transferred controller and the best sample; "
    "`transferred` is that of the transferred controller alone; `equal_chances` is the best of those so far",
)

Evaluations = Annotated[int | None, Field(ge=0, le=1_000)]
Width = Annotated[float | None, Field(gt=0, le=1e6, allow_inf_nan=False)]

_ROWS = """experiment,name,strategy,repetition,evaluations,fitness
01f2e3d4c5b6,simulated_fit,simulated_fit,0,0,0.9
"""
_PAIRS = "first,first_name,second,second_name,from_evaluations,…\n"


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
    responses=sent({"text/csv": _ROWS}),
)
def read_curve(id: Id, store: StoreDep, query: Asked[CurveQuery]) -> Curve | Response:
    """Return mean, SD, n and 95 % interval after each real-world evaluation, and the value of each repetition."""
    curve = curves.curve(store, id, query.fitness)
    return _csv((curve,)) if query.format == "csv" else curve


@router.get(
    "/curves",
    summary="Read the curves of studies",
    response_model=tuple[Curve, ...],
    response_description="In the order of the query",
    responses=sent({"text/csv": _ROWS}),
)
def read_curves(store: StoreDep, query: Asked[CurvesQuery]) -> tuple[Curve, ...] | Response:
    """Return the curves of studies, and of single experiments, in that order, each once."""
    found = curves.curves(store, query.study, query.fitness)
    return _csv(found) if query.format == "csv" else found


def _csv(found: tuple[Curve, ...]) -> Response:
    return attachment(curves.curves_csv(found), "text/csv", "gaplab-curves.csv")


class MarginQuery(Parameters):
    """The difference within which two experiments are equivalent."""

    margin: Width = Field(
        None,
        description="test whether pairs are equivalent: whether they differ by less than this, in the unit of fitness",
    )
    margin_of_direct: Width = Field(
        None, description="the same margin as a share of the direct baseline's mean fitness, like 0.03"
    )

    def chosen(self) -> Margin | None:
        """Return the margin; None without one; raise InvalidSpec if there are two."""
        if self.margin is not None and self.margin_of_direct is not None:
            message = "give one margin, either margin or margin_of_direct"
            raise InvalidSpec([Violation("margin_of_direct", self.margin_of_direct, message)])
        if self.margin_of_direct is not None:
            return Margin(self.margin_of_direct, of_direct=True)
        return None if self.margin is None else Margin(self.margin)


class ComparisonQuery(MarginQuery, CostModel):
    """The experiments to compare, and the numbers of real-world evaluations, or what they cost.

    Over a range, each repetition is one value: its mean over the range.
    """

    study: Ids
    format: Literal["json", "csv", "latex"] = "json"
    from_evaluations: Evaluations = Field(
        None, alias="from", description="first number of real-world evaluations; left out: `to`"
    )
    to_evaluations: Evaluations = Field(
        None, alias="to", description="last number; left out: the last that the experiments share"
    )
    at: float | None = Field(
        None,
        ge=0,
        le=1e12,
        description="if x is not evaluations: the rollouts, seconds or cost at which to compare; each experiment has "
        "the last evaluation that it could pay for. Left out: the least that an experiment with samples has spent",
    )
    fitness: Fitness = FITNESS
    intervals: bool | None = Field(None, description="with intervals; left out: for up to 20 experiments")


@router.get(
    "/comparisons",
    summary="Compare experiments",
    response_model=tuple[Comparison, ...],
    response_description="One for each pair",
    responses=sent({"text/csv": _PAIRS, "application/x-latex": "\\begin{table}…"}),
)
def compare_experiments(store: StoreDep, query: Asked[ComparisonQuery]) -> tuple[Comparison, ...] | Response:
    """Compare every pair: tests of means, ranks and spreads, intervals, and equivalence within a margin.

    Each p is given twice: uncorrected, and with Holm's correction over all pairs. `trusted` is the test by which a pair
    is judged: the paired t-test if both experiments draw the same random numbers, else Welch's.
    """
    pairs = compare(
        store,
        query.study,
        from_evaluations=query.from_evaluations,
        to_evaluations=query.to_evaluations,
        margin=query.chosen(),
        intervals=query.intervals,
        fitness=query.fitness,
        model=query,
        at=query.at,
    )
    if query.format == "csv":
        return attachment(csv_text(COLUMNS, map(row, pairs)), "text/csv", "gaplab-comparisons.csv")
    if query.format == "latex":
        return attachment(latex(comparison(pairs)), "application/x-latex", "gaplab-comparisons.tex")
    return pairs


class DifferencesQuery(Parameters):
    """The studies whose settings to compare."""

    study: Ids


@router.get("/differences", summary="Compare settings", response_description="The settings that differ")
def read_spec_differences(store: StoreDep, query: Asked[DifferencesQuery]) -> SpecDiff:
    """Return the settings of the resolved specs that differ, with a column for each study or experiment.

    A single study is compared experiment by experiment. Tunables are compared by name. Parameters of reality are
    compared once they may be shown. Warnings say which experiments should not be compared.
    """
    found = read_differences(store, query.study)
    return found.model_copy(update={"warnings": warnings_of(store, query.study)})
