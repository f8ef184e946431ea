"""Studies: experiments to be compared, or one alone. Most addresses also take the id of one experiment of a study."""

from typing import Annotated

from fastapi import APIRouter, Body, Query, Request, Response
from pydantic import Field

from gaplab.api.http import conditional, links
from gaplab.api.http.dependencies import (
    AdmissionDep,
    CallerDep,
    Confirmation,
    Id,
    LimitsDep,
    Paging,
    Revealing,
    StoreDep,
    created,
    of_app,
)
from gaplab.api.http.problems import documented
from gaplab.schemas.estimates import EstimateRead
from gaplab.schemas.keeping import Edit, Order
from gaplab.schemas.lifecycle import State
from gaplab.schemas.records import Page, StudyRead
from gaplab.schemas.spec import AnySpec, ExperimentSpec, SpecRead, StudySpec
from gaplab.services.experiments import editing, estimates, listing, reading, submission
from gaplab.services.experiments.listing import ListFilter

router = APIRouter(prefix="/studies", tags=["studies"])

CoresDep = Annotated[int, of_app("cores")]
Confirming = Annotated[Confirmation, Query()]
RevealingQuery = Annotated[Revealing, Query()]
Spec = Annotated[AnySpec, Body(openapi_examples=ExperimentSpec.EXAMPLES | StudySpec.EXAMPLES)]
EditBody = Annotated[Edit, Body(openapi_examples=Edit.EXAMPLES)]


class StudyFilter(Paging):
    """The studies to list, and their order."""

    state: State | None = Field(
        default=None, description="only studies in this state, which follows from their experiments"
    )
    strategy: str | None = Field(
        default=None, max_length=100, pattern=r"^\w+$", description="only those with an experiment of this strategy"
    )
    text: str | None = Field(
        default=None, max_length=200, description="only those whose name, id, notes or tags contain this text"
    )
    q: str | None = Field(
        default=None,
        max_length=1_000,
        description="query, like `strategy = informative and fitness > 0.5`, or words; archived ones are left out "
        "unless it mentions `archived`",
    )
    sort: Order = Field(default="-created_at", description="field to sort by; a minus reverses the order")

    def wanted(self) -> ListFilter:
        """Return the selection and the order for the service."""
        return ListFilter(**self.model_dump(exclude={"limit", "cursor"}))


@router.post(
    "",
    status_code=202,
    summary="Submit a study",
    response_description="Queued; its address is in `Location`",
    responses={202: links.leading_to(*links.FROM_STUDY), **documented(404, 413, 415, 422, 429)},
)
def submit_study(
    spec: Spec, store: StoreDep, admitted: AdmissionDep, query: Confirming, request: Request, response: Response
) -> StudyRead:
    """Queue one experiment for each strategy, all else equal. Whatever the spec leaves out has the paper's value.

    A spec that names a `strategy`, and no `strategies`, is that of an experiment, and makes a study of one.
    """
    done = submission.submit_once(store, spec, query.given(admitted))
    return created(done, response, request.app.url_path_for("read_study", id=done.answer.id))


@router.post(
    "/estimate",
    summary="Estimate a study",
    response_description="The expected cost",
    responses=documented(413, 415, 422),
)
def estimate_study(spec: Spec, store: StoreDep, limits: LimitsDep, cores: CoresDep) -> EstimateRead:
    """Check a spec as on submission, and return its rollouts and the time they take here; nothing is stored.

    A reader's token suffices. The seconds per rollout are those that this service measured in its newest experiments
    with the same robot and engine.
    """
    return estimates.estimate(store, spec, limits=limits, cores=cores)


@router.get("", summary="List the studies", response_description="The newest first", responses=documented(422))
def list_studies(store: StoreDep, query: Annotated[StudyFilter, Query()]) -> Page[StudyRead]:
    """List studies, by default the newest first. A cursor is valid only for the list that returned it."""
    return listing.list_studies(store, query.wanted(), limit=query.limit, cursor=query.cursor)


@router.get(
    "/{id}",
    summary="Read a study",
    response_model=StudyRead,
    response_description="The study with its experiments",
    responses=conditional.CACHED | documented(404, 422),
)
def read_study(id: Id, store: StoreDep, caller: CallerDep, request: Request, query: RevealingQuery) -> Response:
    """Return a study with its experiments, their states and progress, and the time left.

    By the id of one of its experiments, it is a study of that one alone.
    """
    study = reading.read(store, id, reveal=query.permitted(caller))
    return conditional.tagged(request, study, study.edits)


@router.patch(
    "/{id}",
    summary="Edit a study",
    response_model=StudyRead,
    response_description="After the edit",
    responses=conditional.TAGGED | documented(404, 409, 412, 413, 415, 422, 428),
)
def edit_study(
    id: Id, edit: EditBody, store: StoreDep, request: Request, if_match: conditional.IfMatch = None
) -> Response:
    """Change its name, notes or tags; by the id of one of its experiments, the name of that.

    `If-Match` names the `ETag` of what you edit; progress does not invalidate it.
    """
    study = editing.edit(store, id, edit, starting_from=conditional.starting_from(if_match))
    return conditional.tagged(request, study, study.edits)


@router.get(
    "/{id}/spec",
    summary="Read a study's spec",
    response_description="To submit it again",
    responses=documented(404, 422),
)
def read_spec(id: Id, store: StoreDep, caller: CallerDep, query: RevealingQuery) -> SpecRead:
    """Return the shortest spec that gives the same study, or one experiment of it, and the complete ones."""
    return reading.read_spec(store, id, reveal=query.permitted(caller))
