"""Experiments: one strategy with one set of settings, repeated."""

from typing import Annotated, Literal

from fastapi import APIRouter, Body, Path, Query, Request, Response
from pydantic import Field

from gaplab.api.http import conditional, links
from gaplab.api.http.attachments import attachment
from gaplab.api.http.dependencies import AdmissionDep, CallerDep, Id, Paging, Parameters, StoreDep, created
from gaplab.api.http.problems import Responses, documented
from gaplab.api.routes.studies import Confirming, EditBody, RecordFilter, RevealingQuery
from gaplab.schemas.lifecycle import State
from gaplab.schemas.misfit import MisfitRead
from gaplab.schemas.records import (
    AttemptRead,
    ExperimentRead,
    MeasurementKind,
    Page,
    RepetitionRead,
    SampleRead,
    SimulatorRead,
)
from gaplab.schemas.spec import ExperimentSpec
from gaplab.services.experiments import editing, listing, reading, submission
from gaplab.services.experiments.views import with_sensors
from gaplab.services.results.misfit import misfit, misfit_csv

router = APIRouter(prefix="/experiments", tags=["experiments"])

Experiment = Annotated[ExperimentSpec, Body(openapi_examples=ExperimentSpec.EXAMPLES)]
Repetition = Annotated[
    int | None, Field(ge=0, le=1_000_000, description="number of a repetition, from 0; left out: all")
]

MANY: int = Field(default=1_000, ge=1, le=5_000, description="most items to return")


_MISFIT_CSV: Responses = {
    200: {"content": {"text/csv": {"schema": {"type": "string"}, "example": "iteration,what,n,mean,sd,…\n"}}}
}


class MisfitQuery(Parameters):
    """The format of the misfit."""

    format: Literal["json", "csv"] = "json"


class ExperimentFilter(RecordFilter):
    """The experiments to list, and their order."""

    study: Id | None = Field(default=None, description="only experiments of this study")
    alone: bool = Field(default=False, description="only experiments without a study")
    state: State | None = Field(default=None, description="only experiments in this state")


class SampleFilter(Paging):
    """The real-world evaluations to list."""

    limit: int = MANY
    repetition: Repetition = None
    kind: MeasurementKind | None = Field(
        default=None, description="only samples, which the strategy learns from, or only probes, which it never sees"
    )


class SimulatorFilter(Paging):
    """The simulators to list."""

    limit: int = MANY
    repetition: Repetition = None
    iteration: int | None = Field(default=None, ge=0, le=1_000_000, description="number of an iteration; left out: all")


@router.post(
    "",
    status_code=202,
    summary="Submit an experiment",
    response_description="Queued; its address is in `Location`",
    responses={202: links.leading_to(*links.FROM_EXPERIMENT), **documented(404, 413, 415, 422, 429)},
)
def submit_experiment(
    spec: Experiment, store: StoreDep, admitted: AdmissionDep, query: Confirming, request: Request, response: Response
) -> ExperimentRead:
    """Queue an experiment. Whatever the spec leaves out has the paper's value."""
    done = submission.admit_experiment(store, spec, query.given(admitted))
    return created(done, response, request.app.url_path_for("read_experiment", id=done.answer.id))


@router.get(
    "",
    summary="List the experiments",
    response_description="The newest first",
    responses=documented(404, 422),
)
def list_experiments(store: StoreDep, query: Annotated[ExperimentFilter, Query()]) -> Page[ExperimentRead]:
    """List experiments, by default the newest first. A cursor is valid only for the list that returned it."""
    return listing.list_experiments(store, query.wanted(), limit=query.limit, cursor=query.cursor)


@router.get(
    "/{id}",
    summary="Read an experiment",
    response_model=ExperimentRead,
    response_description="State, progress, time left",
    responses=conditional.CACHED | documented(404, 422),
)
def read_experiment(id: Id, store: StoreDep, caller: CallerDep, request: Request, query: RevealingQuery) -> Response:
    """Return an experiment with its resolved spec; reality's parameters are null until it has ended."""
    experiment = with_sensors(reading.read_experiment(store, id, reveal=query.permitted(caller)))
    return conditional.tagged(request, experiment, experiment.edits)


@router.patch(
    "/{id}",
    summary="Edit an experiment",
    response_model=ExperimentRead,
    response_description="After the edit",
    responses=conditional.TAGGED | documented(404, 412, 413, 415, 422, 428),
)
def edit_experiment(
    id: Id, edit: EditBody, store: StoreDep, request: Request, if_match: conditional.IfMatch = None
) -> Response:
    """Change its name, notes or tags. `If-Match` names the `ETag` of what you edit; progress does not invalidate it."""
    experiment = editing.edit_experiment(store, id, edit, starting_from=conditional.starting_from(if_match))
    return conditional.tagged(request, experiment, experiment.edits)


@router.get(
    "/{id}/repetitions",
    summary="List an experiment's repetitions",
    response_description="By number",
    responses=documented(404),
)
def list_repetitions(id: Id, store: StoreDep) -> tuple[RepetitionRead, ...]:
    """List every repetition with its state, and its error if it failed."""
    return tuple(reading.list_repetitions(store, id))


@router.get(
    "/{id}/samples",
    summary="List real-world evaluations",
    response_description="By repetition and iteration",
    responses=documented(404, 422),
)
def list_samples(id: Id, store: StoreDep, query: Annotated[SampleFilter, Query()]) -> Page[SampleRead]:
    """List every genome that was tried in reality, with its real fitness."""
    return reading.list_samples(store, id, **query.model_dump())


@router.get(
    "/{id}/simulators",
    summary="List tuned simulators",
    response_description="By repetition, iteration and rank",
    responses=documented(404, 422),
)
def list_simulators(id: Id, store: StoreDep, query: Annotated[SimulatorFilter, Query()]) -> Page[SimulatorRead]:
    """List the simulators that were tuned on the samples; rank 0 is the best of its iteration."""
    return reading.list_simulators(store, id, **query.model_dump())


@router.get(
    "/{id}/misfit",
    summary="Read an experiment's misfit",
    response_model=MisfitRead,
    response_description="By iteration, over repetitions",
    responses=_MISFIT_CSV | documented(404),
)
def read_misfit(id: Id, store: StoreDep, query: Annotated[MisfitQuery, Query()]) -> MisfitRead | Response:
    """Return the error that remains after tuning, also on held-out samples, and which tunables are identified.

    It also has the spread over repetitions, and the share of tunables that end at a bound.
    """
    found = misfit(store, id)
    if query.format == "json":
        return found
    return attachment(misfit_csv(found), "text/csv", f"gaplab-misfit-{id}.csv")


@router.get(
    "/{id}/repetitions/{number}/attempts",
    summary="List the attempts at a repetition",
    response_description="In chronological order",
    responses=documented(404, 422),
)
def list_attempts(id: Id, number: Annotated[int, Path(ge=0, le=1_000_000)], store: StoreDep) -> tuple[AttemptRead, ...]:
    """List the attempts at a repetition: supervisor, start, end, outcome, reason. A lost repetition is queued again."""
    return reading.list_attempts(store, id, number)
