"""Experiments: one strategy under one setting, repeated."""

from typing import Annotated, Literal

from fastapi import APIRouter, Body, Path, Query, Request, Response
from pydantic import Field

from gaplab.api.http import conditional, examples, links
from gaplab.api.http.dependencies import AdmissionDep, CallerDep, Id, Paging, Revealing, StoreDep, created
from gaplab.api.http.problems import documented
from gaplab.schemas.editing import Edit
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
from gaplab.services.experiments import editing, submission
from gaplab.services.experiments.listing import ListFilter
from gaplab.services.results.misfit import misfit

router = APIRouter(prefix="/experiments", tags=["experiments"])

Repetition = Annotated[int | None, Field(ge=0, le=1_000_000, description="its number, from 0; left out: all")]

MANY: int = Field(default=1_000, ge=1, le=5_000, description="how many at most")


class ExperimentFilter(Paging):
    """Which experiments are listed."""

    study: Id | None = Field(default=None, description="only of this study")
    state: State | None = Field(default=None, description="only in this state")
    strategy: str | None = Field(default=None, max_length=100, pattern=r"^\w+$", description="only of this strategy")
    text: str | None = Field(default=None, max_length=200, description="only with this in the name or the id")
    sort: Literal["created_at", "-created_at", "name", "-name", "strategy", "-strategy", "state", "-state"] = Field(
        default="-created_at", description="a minus turns the order round"
    )


class SampleFilter(Paging):
    """Which real-world evaluations are listed."""

    limit: int = MANY
    repetition: Repetition = None
    kind: MeasurementKind | None = Field(default=None, description="samples are learned from, probes only looked at")


class SimulatorFilter(Paging):
    """Which simulators are listed."""

    limit: int = MANY
    repetition: Repetition = None
    iteration: int | None = Field(default=None, ge=0, le=1_000_000, description="left out: all")


@router.post(
    "",
    status_code=202,
    summary="Submit an experiment",
    responses={
        202: examples.shown(examples.EXPERIMENT, "It is queued, and exists at `Location`")
        | links.leading_to(*links.FROM_EXPERIMENT),
        **documented(413, 415, 422, 429),
    },
)
def submit_experiment(
    spec: Annotated[ExperimentSpec, Body(openapi_examples=examples.EXPERIMENT_SPECS)],
    store: StoreDep,
    admitted: AdmissionDep,
    request: Request,
    response: Response,
) -> ExperimentRead:
    """Queue an experiment. Whatever is left out is the paper's."""
    done = submission.admit_experiment(store, spec, admitted)
    return created(done, response, request.app.url_path_for("read_experiment", id=done.answer.id))


@router.get(
    "",
    summary="List the experiments",
    responses={200: examples.shown(examples.page(examples.EXPERIMENT), "The newest first"), **documented(404, 422)},
)
def list_experiments(store: StoreDep, which: Annotated[ExperimentFilter, Query()]) -> Page[ExperimentRead]:
    """The experiments, the newest first unless sorted otherwise. A cursor is good only for the list that gave it."""
    wanted = ListFilter(**which.model_dump(exclude={"limit", "cursor"}))
    return submission.list_experiments(store, wanted, limit=which.limit, cursor=which.cursor)


@router.get(
    "/{id}",
    summary="Look at an experiment",
    response_model=ExperimentRead,
    responses={
        200: examples.shown(examples.EXPERIMENT, "State, progress, time left") | {"headers": conditional.HEADERS},
        **conditional.NOT_MODIFIED,
        **documented(404, 422),
    },
)
def read_experiment(
    id: Id,  # noqa: A002 - the address says {id}
    store: StoreDep,
    caller: CallerDep,
    request: Request,
    query: Annotated[Revealing, Query()],
) -> Response:
    """An experiment with its resolved spec; reality's parameters are null until it has ended."""
    shown = submission.read_experiment(store, id, reveal=query.permitted(caller))
    return conditional.tagged(request, shown, shown.edits)


@router.patch(
    "/{id}",
    summary="Edit an experiment",
    response_model=ExperimentRead,
    responses={
        200: examples.shown(examples.EXPERIMENT, "As it is now") | {"headers": conditional.HEADERS},
        **documented(404, 412, 413, 415, 422, 428),
    },
)
def edit_experiment(
    id: Id,  # noqa: A002 - the address says {id}
    edit: Annotated[Edit, Body(openapi_examples=examples.EDITS)],
    store: StoreDep,
    request: Request,
    if_match: conditional.IfMatch = None,
) -> Response:
    """Give it another name or notes. `If-Match` names the `ETag` that was looked at; progress does not outdate it."""
    expected = conditional.starting_from(if_match)
    shown = editing.edit_experiment(store, id, edit, starting_from=expected)
    return conditional.tagged(request, shown, shown.edits)


@router.get(
    "/{id}/repetitions",
    summary="List an experiment's repetitions",
    responses={
        200: examples.shown([examples.REPETITION], "In the order of their numbers"),
        **documented(404),
    },
)
def list_repetitions(id: Id, store: StoreDep) -> tuple[RepetitionRead, ...]:  # noqa: A002 - the address says {id}
    """Every repetition with its state, and why it failed if it did."""
    return tuple(submission.list_repetitions(store, id))


@router.get(
    "/{id}/samples",
    summary="List real-world evaluations",
    responses={
        200: examples.shown(examples.page(examples.SAMPLE), "By repetition and iteration"),
        **documented(404, 422),
    },
)
def list_samples(
    id: Id,  # noqa: A002 - the address says {id}
    store: StoreDep,
    which: Annotated[SampleFilter, Query()],
) -> Page[SampleRead]:
    """Every genome that was tried in reality, with its fitness there."""
    return submission.list_samples(store, id, **which.model_dump())


@router.get(
    "/{id}/simulators",
    summary="List tuned simulators",
    responses={
        200: examples.shown(examples.page(examples.SIMULATOR), "By repetition, iteration and rank"),
        **documented(404, 422),
    },
)
def list_simulators(
    id: Id,  # noqa: A002 - the address says {id}
    store: StoreDep,
    which: Annotated[SimulatorFilter, Query()],
) -> Page[SimulatorRead]:
    """The simulators that were tuned on the samples, rank 0 the best of its iteration."""
    return submission.list_simulators(store, id, **which.model_dump())


@router.get(
    "/{id}/misfit",
    summary="Read an experiment's misfit",
    responses={200: examples.shown(examples.MISFIT, "By iteration, over repetitions"), **documented(404)},
)
def read_misfit(id: Id, store: StoreDep) -> MisfitRead:  # noqa: A002 - the address says {id}
    """The error that remains after tuning, how far repetitions agree, and coefficients that are stuck at a bound."""
    return misfit(store, id)


@router.get(
    "/{id}/repetitions/{number}/attempts",
    summary="List the attempts at a repetition",
    responses={200: examples.shown([examples.ATTEMPT], "In their order"), **documented(404, 422)},
)
def list_attempts(
    id: Id,  # noqa: A002 - the address says {id}
    number: Annotated[int, Path(ge=0, le=1_000_000)],
    store: StoreDep,
) -> tuple[AttemptRead, ...]:
    """Who had the repetition, from when to when, how it ended, and why. One that was lost is queued again."""
    return submission.list_attempts(store, id, number)
