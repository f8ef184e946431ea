"""Experiments: one strategy with one set of settings, repeated; and checks of what their tunables do to fitness."""

from typing import Literal

from fastapi import APIRouter, Request, Response
from pydantic import Field

from gaplab.api.http.answers import CACHED, attachment, created, tagged
from gaplab.api.http.dependencies import (
    AdmissionDep,
    Asked,
    CallerDep,
    Confirming,
    Id,
    Number,
    Paging,
    Parameters,
    Revealing,
    StoreDep,
)
from gaplab.api.http.documentation import FROM_CHECK, FROM_EXPERIMENT, leading_to, sent
from gaplab.api.http.problems import documented
from gaplab.schemas.misfit import MisfitRead
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
from gaplab.schemas.sensitivity import SensitivityRead, SensitivitySpec
from gaplab.schemas.spec import ExperimentSpec
from gaplab.services.experiments import checks, reading, submission
from gaplab.services.experiments.views import with_sensors
from gaplab.services.results.misfit import misfit, misfit_csv
from gaplab.services.running import provenance

router = APIRouter(prefix="/experiments", tags=["experiments"])
check_router = APIRouter(prefix="/sensitivity", tags=["sensitivity"])

REPETITION: int | None = Field(None, description="number of a repetition, from 0; left out: all")

MANY: int = Field(1_000, ge=1, le=5_000, description="most items to return")


class MisfitQuery(Parameters):
    """The format of the misfit."""

    format: Literal["json", "csv"] = "json"


class SampleFilter(Paging):
    """The real-world evaluations to list."""

    limit: int = MANY
    repetition: Number | None = REPETITION
    kind: MeasurementKind | None = Field(
        None, description="only samples, which the strategy learns from, or only probes, which it never sees"
    )


class SimulatorFilter(Paging):
    """The simulators to list."""

    limit: int = MANY
    repetition: Number | None = REPETITION
    iteration: Number | None = Field(None, description="number of an iteration; left out: all")


@router.post(
    "",
    status_code=202,
    summary="Submit an experiment",
    response_description="Queued; its address is in `Location`",
    responses=leading_to(*FROM_EXPERIMENT) | documented(404, 429),
)
def submit_experiment(
    spec: ExperimentSpec, store: StoreDep, admitted: AdmissionDep, query: Confirming, response: Response
) -> ExperimentRead:
    """Queue an experiment, alone in a study with its id and name. What the spec leaves out has the paper's value."""
    done = submission.submit_once(store, spec, query.given(admitted))
    return created(done, response, f"/experiments/{done.answer.id}").experiments[0]


@router.get(
    "/{id}",
    summary="Read an experiment",
    response_model=ExperimentRead,
    response_description="State, progress, time left",
    responses=CACHED,
)
def read_experiment(id: Id, store: StoreDep, caller: CallerDep, request: Request, query: Asked[Revealing]) -> Response:
    """Return an experiment with its resolved spec; reality's parameters are null until its study has ended."""
    experiment = with_sensors(reading.read_experiment(store, id, reveal=query.permitted(caller)))
    return tagged(request, experiment)


@router.get("/{id}/repetitions", summary="List an experiment's repetitions", response_description="By number")
def list_repetitions(id: Id, store: StoreDep) -> tuple[RepetitionRead, ...]:
    """List every repetition with its state, and its error if it failed."""
    return tuple(reading.list_repetitions(store, id))


@router.get("/{id}/samples", summary="List real-world evaluations", response_description="By repetition and iteration")
def list_samples(id: Id, store: StoreDep, query: Asked[SampleFilter]) -> Page[SampleRead]:
    """List every genome that was tried in reality, with its real fitness."""
    return reading.list_samples(store, id, **query.model_dump())


@router.get(
    "/{id}/simulators", summary="List tuned simulators", response_description="By repetition, iteration and rank"
)
def list_simulators(id: Id, store: StoreDep, query: Asked[SimulatorFilter]) -> Page[SimulatorRead]:
    """List the simulators that were tuned on the samples; rank 0 is the best of its iteration."""
    return reading.list_simulators(store, id, **query.model_dump())


@router.get(
    "/{id}/misfit",
    summary="Read an experiment's misfit",
    response_model=MisfitRead,
    response_description="By iteration, over repetitions",
    responses=sent({"text/csv": "iteration,what,n,mean,sd,…\n"}),
)
def read_misfit(id: Id, store: StoreDep, query: Asked[MisfitQuery]) -> MisfitRead | Response:
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
)
def list_attempts(id: Id, number: Number, store: StoreDep) -> tuple[AttemptRead, ...]:
    """List the attempts at a repetition: supervisor, start, end, outcome, reason. A lost repetition is queued again."""
    return reading.list_attempts(store, id, number)


@router.get(
    "/{id}/provenance", summary="Read an experiment's provenance", response_description="In chronological order"
)
def read_provenance(id: Id, store: StoreDep) -> ProvenanceRead:
    """Return the versions of gaplab, Python, engines and libraries, the commit and the machine of each supervisor."""
    return provenance.read(store, id)


@check_router.post(
    "",
    status_code=202,
    summary="Check what tunables do",
    response_description="Queued or already known; its address is in `Location`",
    responses=leading_to(*FROM_CHECK),
)
def submit_sensitivity(
    spec: SensitivitySpec, store: StoreDep, admitted: AdmissionDep, response: Response
) -> SensitivityRead:
    """Queue a check of whether each tunable changes fitness, how much, and how smoothly.

    It depends on robot, engine and tunables alone, and the same check is computed once. Every submitted experiment
    queues its check.
    """
    done = checks.admit(store, spec, admitted)
    return created(done, response, f"/sensitivity/{done.answer.id}")


@check_router.get(
    "/{id}", summary="Read a sensitivity check", response_description="With its results, once it is COMPLETED"
)
def read_sensitivity(id: Id, store: StoreDep) -> SensitivityRead:
    """Return the check, with the profile of each tunable once it is COMPLETED."""
    return checks.read(store, id)
