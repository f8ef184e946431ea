"""Studies: experiments that belong together to be compared."""

from typing import Annotated, Literal

from fastapi import APIRouter, Body, Query, Request, Response
from pydantic import Field

from gaplab.api.http import conditional, examples, links
from gaplab.api.http.dependencies import AdmissionDep, CallerDep, Id, Paging, Revealing, StoreDep, created
from gaplab.api.http.problems import documented
from gaplab.schemas.editing import Edit
from gaplab.schemas.lifecycle import State
from gaplab.schemas.records import Page, StudyRead
from gaplab.schemas.spec import StudySpec
from gaplab.services.experiments import editing, submission
from gaplab.services.experiments.listing import ListFilter

router = APIRouter(prefix="/studies", tags=["studies"])


class StudyFilter(Paging):
    """Which studies are listed."""

    state: State | None = Field(default=None, description="only in this state, its experiments taken together")
    strategy: str | None = Field(default=None, max_length=100, pattern=r"^\w+$", description="only with this strategy")
    text: str | None = Field(default=None, max_length=200, description="only with this in the name or the id")
    sort: Literal["created_at", "-created_at", "name", "-name"] = Field(
        default="-created_at", description="a minus turns the order round"
    )


@router.post(
    "",
    status_code=202,
    summary="Submit a study",
    responses={
        202: examples.shown(examples.STUDY, "It is queued, and exists at `Location`")
        | links.leading_to(*links.FROM_STUDY),
        **documented(413, 415, 422, 429),
    },
)
def submit_study(
    spec: Annotated[StudySpec, Body(openapi_examples=examples.STUDY_SPECS)],
    store: StoreDep,
    admitted: AdmissionDep,
    request: Request,
    response: Response,
) -> StudyRead:
    """Queue one experiment for each strategy, all else equal. Whatever is left out is the paper's."""
    done = submission.admit_study(store, spec, admitted)
    return created(done, response, request.app.url_path_for("read_study", id=done.answer.id))


@router.get(
    "",
    summary="List the studies",
    responses={200: examples.shown(examples.page(examples.STUDY), "The newest first"), **documented(422)},
)
def list_studies(store: StoreDep, which: Annotated[StudyFilter, Query()]) -> Page[StudyRead]:
    """The studies, the newest first unless sorted otherwise. A cursor is good only for the list that gave it."""
    wanted = ListFilter(**which.model_dump(exclude={"limit", "cursor"}))
    return submission.list_studies(store, wanted, limit=which.limit, cursor=which.cursor)


@router.get(
    "/{id}",
    summary="Look at a study",
    response_model=StudyRead,
    responses={
        200: examples.shown(examples.STUDY, "The study with its experiments") | {"headers": conditional.HEADERS},
        **conditional.NOT_MODIFIED,
        **documented(404, 422),
    },
)
def read_study(
    id: Id,  # noqa: A002 - the address says {id}
    store: StoreDep,
    caller: CallerDep,
    request: Request,
    query: Annotated[Revealing, Query()],
) -> Response:
    """A study with its experiments, their states and progress, and the time left."""
    shown = submission.read_study(store, id, reveal=query.permitted(caller))
    return conditional.tagged(request, shown, shown.edits)


@router.patch(
    "/{id}",
    summary="Edit a study",
    response_model=StudyRead,
    responses={
        200: examples.shown(examples.STUDY, "As it is now") | {"headers": conditional.HEADERS},
        **documented(404, 412, 413, 415, 422, 428),
    },
)
def edit_study(
    id: Id,  # noqa: A002 - the address says {id}
    edit: Annotated[Edit, Body(openapi_examples=examples.EDITS)],
    store: StoreDep,
    request: Request,
    if_match: conditional.IfMatch = None,
) -> Response:
    """Give it another name or notes. `If-Match` names the `ETag` that was looked at; progress does not outdate it."""
    expected = conditional.starting_from(if_match)
    shown = editing.edit_study(store, id, edit, starting_from=expected)
    return conditional.tagged(request, shown, shown.edits)
