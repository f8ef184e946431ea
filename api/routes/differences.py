"""The settings in which studies and experiments differ."""

from typing import Annotated

from fastapi import APIRouter, Query
from pydantic import Field, model_validator

from gaplab.api.http.dependencies import Id, Parameters, StoreDep
from gaplab.api.http.problems import documented
from gaplab.schemas.differences import SpecDiff
from gaplab.services.experiments.reading import read_differences

router = APIRouter(tags=["curves"])


class DifferencesQuery(Parameters):
    """The studies and experiments whose settings to compare."""

    experiment: list[Id] = Field(default=[], max_length=100, description="id of an experiment; repeat for more")
    study: list[Id] = Field(
        default=[],
        max_length=20,
        description="id of a study, which is one column; a single study alone is compared experiment by experiment",
    )

    @model_validator(mode="after")
    def _something_is_compared(self) -> "DifferencesQuery":
        if not self.experiment and not self.study:
            raise ValueError("name what to compare, as in ?experiment=…&experiment=… or ?study=…&study=…")
        return self


@router.get(
    "/differences",
    summary="Compare settings",
    response_description="The settings that differ",
    responses=documented(404, 422),
)
def read_spec_differences(store: StoreDep, query: Annotated[DifferencesQuery, Query()]) -> SpecDiff:
    """Return the settings of the resolved specs that differ: studies first, then experiments, one column each.

    Tunables are compared by name. Parameters of reality are compared once they may be shown.
    """
    return read_differences(store, list(dict.fromkeys(query.study)), list(dict.fromkeys(query.experiment)))
