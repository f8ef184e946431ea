"""Statistical comparisons of experiments, as JSON, CSV or LaTeX; and the settings in which they differ."""

from dataclasses import replace
from typing import Annotated, Literal

from fastapi import APIRouter, Query, Response
from pydantic import Field

from gaplab.api.http.attachments import attachment
from gaplab.api.http.dependencies import Parameters, StoreDep
from gaplab.api.http.problems import Responses, documented
from gaplab.api.routes.curves import FITNESS, Ids
from gaplab.schemas.comparisons import COLUMNS, Comparison, row
from gaplab.schemas.differences import SpecDiff
from gaplab.schemas.results import Fitness
from gaplab.services.core.errors import InvalidSpec, Violation
from gaplab.services.csv_tables import csv_text
from gaplab.services.experiments.reading import read_differences
from gaplab.services.findings.tables import comparison, latex
from gaplab.services.results.comparisons import Margin, compare, warnings_of

router = APIRouter(tags=["curves"])

Evaluations = Annotated[int | None, Field(ge=0, le=1_000)]
Width = Annotated[float | None, Field(gt=0, le=1e6, allow_inf_nan=False)]

_TEXT = {"type": "string"}
_CONTENT = {
    "text/csv": {"schema": _TEXT, "example": "first,first_name,second,second_name,from_evaluations,…\n"},
    "application/x-latex": {"schema": _TEXT, "example": "\\begin{table}…"},
}
_TABLES: Responses = {200: {"content": _CONTENT}}


class MarginQuery(Parameters):
    """The difference within which two experiments are equivalent."""

    margin: Width = Field(
        default=None,
        description="test whether pairs are equivalent: whether they differ by less than this, in the unit of fitness",
    )
    margin_of_direct: Width = Field(
        default=None, description="the same margin as a share of the direct baseline's mean fitness, like 0.03"
    )

    def chosen(self) -> Margin | None:
        """Return the margin; None without one.

        Raises:
            InvalidSpec: there are two.
        """
        if self.margin is not None and self.margin_of_direct is not None:
            message = "give one margin, either margin or margin_of_direct"
            raise InvalidSpec([Violation("margin_of_direct", self.margin_of_direct, message)])
        if self.margin_of_direct is not None:
            return Margin(self.margin_of_direct, of_direct=True)
        return None if self.margin is None else Margin(self.margin)


class ComparisonQuery(MarginQuery):
    """The experiments to compare, and the numbers of real-world evaluations.

    Over a range, each repetition is one value: its mean over the range.
    """

    study: Ids
    format: Literal["json", "csv", "latex"] = "json"
    from_evaluations: Evaluations = Field(
        default=None, alias="from", description="first number of real-world evaluations; left out: `to`"
    )
    to_evaluations: Evaluations = Field(
        default=None, alias="to", description="last number; left out: the last that the experiments share"
    )
    fitness: Fitness = FITNESS
    intervals: bool | None = Field(default=None, description="with intervals; left out: for up to 20 experiments")


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
    """Compare every pair: tests of means, ranks and spreads, intervals, and equivalence within a margin.

    Each p is given twice: uncorrected, and with Holm's correction over all pairs. `trusted` is the test by which a pair
    is judged: the paired t-test if both experiments draw the same random numbers, else Welch's.
    """
    try:
        pairs = compare(
            store,
            query.study,
            from_evaluations=query.from_evaluations,
            to_evaluations=query.to_evaluations,
            margin=query.chosen(),
            intervals=query.intervals,
            fitness=query.fitness,
        )
    except InvalidSpec as error:
        renamed = (replace(each, pointer=each.pointer.removesuffix("_evaluations")) for each in error.violations)
        raise InvalidSpec(renamed) from error
    if query.format == "csv":
        return attachment(csv_text(COLUMNS, map(row, pairs)), "text/csv", "gaplab-comparisons.csv")
    if query.format == "latex":
        return attachment(latex(comparison(pairs)), "application/x-latex", "gaplab-comparisons.tex")
    return pairs


class DifferencesQuery(Parameters):
    """The studies whose settings to compare."""

    study: Ids


@router.get(
    "/differences",
    summary="Compare settings",
    response_description="The settings that differ",
    responses=documented(404, 422),
)
def read_spec_differences(store: StoreDep, query: Annotated[DifferencesQuery, Query()]) -> SpecDiff:
    """Return the settings of the resolved specs that differ, with a column for each study or experiment.

    A single study is compared experiment by experiment. Tunables are compared by name. Parameters of reality are
    compared once they may be shown. Warnings say which experiments should not be compared.
    """
    found = read_differences(store, query.study)
    return found.model_copy(update={"warnings": warnings_of(store, query.study)})
