"""Experiments: one strategy with one set of settings, repeated."""

from typing import Annotated, Literal

from fastapi import APIRouter, Body, Path, Query, Request, Response
from pydantic import Field

from gaplab.api.http import conditional, links
from gaplab.api.http.attachments import attachment
from gaplab.api.http.dependencies import AdmissionDep, CallerDep, Id, Paging, Parameters, StoreDep, created
from gaplab.api.http.problems import Responses, documented
from gaplab.api.routes.studies import Confirming, RevealingQuery
from gaplab.schemas.provenance import ProvenanceRead
from gaplab.schemas.records import (
    AttemptRead,
    ExperimentRead,
    MeasurementKind,
    Page,
    RepetitionRead,
    SampleRead,
    SimulatorRead,
)
from gaplab.schemas.results import MisfitRead
from gaplab.schemas.spec import ExperimentSpec
from gaplab.services.experiments import reading, submission
from gaplab.services.experiments.views import with_sensors
from gaplab.services.results.misfit import misfit, misfit_csv
from gaplab.services.running import provenance

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
    """Queue an experiment, alone in a study with its id and name. What the spec leaves out has the paper's value."""
    done = submission.submit_once(store, spec, query.given(admitted))
    return created(done, response, request.app.url_path_for("read_experiment", id=done.answer.id)).experiments[0]


@router.get(
    "/{id}",
    summary="Read an experiment",
    response_model=ExperimentRead,
    response_description="State, progress, time left",
    responses=conditional.CACHED | documented(404, 422),
)
def read_experiment(id: Id, store: StoreDep, caller: CallerDep, request: Request, query: RevealingQuery) -> Response:
    """Return an experiment with its resolved spec; reality's parameters are null until its study has ended."""
    experiment = with_sensors(reading.read_experiment(store, id, reveal=query.permitted(caller)))
    return conditional.tagged(request, experiment)


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


@router.get(
    "/{id}/provenance",
    summary="Read an experiment's provenance",
    response_description="In chronological order",
    responses=documented(404),
)
def read_provenance(id: Id, store: StoreDep) -> ProvenanceRead:
    """Return the versions of gaplab, Python, engines and libraries, the commit and the machine of each supervisor."""
    return provenance.read(store, id)
