"""Studies: experiments that belong together to be compared."""

from typing import Annotated

from fastapi import APIRouter, Body, Query, Request, Response

from api import examples
from api.dependencies import Id, Paging, StoreDep
from api.problems import documented
from schemas.records import Page, StudyRead
from schemas.spec import StudySpec
from services import experiments

router = APIRouter(prefix="/studies", tags=["studies"])


@router.post(
    "",
    status_code=202,
    summary="Submit a study",
    responses={202: examples.shown(examples.STUDY, "It is queued, and exists at `Location`"), **documented(413, 422)},
)
def submit_study(
    spec: Annotated[StudySpec, Body(openapi_examples=examples.STUDY_SPECS)],
    store: StoreDep,
    request: Request,
    response: Response,
) -> StudyRead:
    """Queue one experiment for each strategy, all else equal. Whatever is left out is the paper's."""
    study = experiments.submit_study(store, spec)
    response.headers["Location"] = str(request.app.url_path_for("read_study", id=study.id))
    return study


@router.get(
    "",
    summary="List the studies",
    responses={200: examples.shown(examples.page(examples.STUDY), "The newest first"), **documented(422)},
)
def list_studies(store: StoreDep, paging: Annotated[Paging, Query()]) -> Page[StudyRead]:
    """The studies, the newest first."""
    return experiments.list_studies(store, limit=paging.limit, cursor=paging.cursor)


@router.get(
    "/{id}",
    summary="Look at a study",
    responses={200: examples.shown(examples.STUDY, "The study with its experiments"), **documented(404)},
)
def read_study(id: Id, store: StoreDep) -> StudyRead:  # noqa: A002 - the address says {id}
    """A study with its experiments, their states and progress, and the time left."""
    return experiments.read_study(store, id)
