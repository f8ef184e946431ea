"""Studies: experiments to be compared, or one alone; and their life cycle.

An address that takes the id of a study also takes that of one of its experiments, which alone is then meant.
"""

from typing import Annotated

from fastapi import APIRouter, Request, Response
from pydantic import Field

from gaplab.api.http.answers import CACHED, TAGGED, IfMatch, created, starting_from, tagged
from gaplab.api.http.dependencies import (
    AdmissionDep,
    Asked,
    CallerDep,
    Confirming,
    Id,
    LimitedDep,
    LimitsDep,
    Paging,
    Revealing,
    StoreDep,
    of_app,
)
from gaplab.api.http.documentation import FROM_STUDY, leading_to
from gaplab.api.http.problems import documented
from gaplab.schemas.editing import Edit, Order
from gaplab.schemas.estimates import EstimateRead
from gaplab.schemas.lifecycle import ExtensionSpec, ScheduleChange, State, Verb
from gaplab.schemas.records import Page, StudyRead
from gaplab.schemas.spec import AnySpec, SpecRead
from gaplab.services.experiments import editing, estimates, lifecycle, listing, reading, submission
from gaplab.services.experiments.listing import ListFilter
from gaplab.services.running import provenance

router = APIRouter(prefix="/studies", tags=["studies"])

CoresDep = Annotated[int, of_app("cores")]


class StudyFilter(Paging):
    """The studies to list, and their order."""

    state: State | None = Field(None, description="only studies in this state, which follows from their experiments")
    strategy: str | None = Field(
        None, max_length=100, pattern=r"^\w+$", description="only those with an experiment of this strategy"
    )
    text: str | None = Field(
        None, max_length=200, description="only those whose name, id, notes or tags contain this text"
    )
    q: str | None = Field(
        None,
        max_length=1_000,
        description="query, like `strategy = informative and fitness > 0.5`, or words; archived ones are left out "
        "unless it mentions `archived`",
    )
    sort: Order = Field("-created_at", description="field to sort by; a minus reverses the order")

    def wanted(self) -> ListFilter:
        """Return the selection and the order for the service."""
        return ListFilter(**self.model_dump(exclude={"limit", "cursor"}))


@router.post(
    "",
    status_code=202,
    summary="Submit a study",
    response_description="Queued; its address is in `Location`",
    responses=leading_to(*FROM_STUDY) | documented(404, 429),
)
def submit_study(
    spec: AnySpec, store: StoreDep, admitted: AdmissionDep, query: Confirming, response: Response
) -> StudyRead:
    """Queue one experiment for each strategy, all else equal. Whatever the spec leaves out has the paper's value.

    A spec that names a `strategy`, and no `strategies`, is that of an experiment, and makes a study of one.
    """
    done = submission.submit_once(store, spec, query.given(admitted))
    return created(done, response, f"/studies/{done.answer.id}")


@router.post("/estimate", summary="Estimate a study", response_description="The expected cost")
def estimate_study(spec: AnySpec, store: StoreDep, limits: LimitsDep, cores: CoresDep) -> EstimateRead:
    """Check a spec as on submission, and return its rollouts and the time they take here; nothing is stored.

    A reader's token suffices. The seconds per rollout are those that this service measured in its newest experiments
    with the same robot and engine.
    """
    return estimates.estimate(store, spec, limits=limits, cores=cores)


@router.get("", summary="List the studies", response_description="The newest first")
def list_studies(store: StoreDep, query: Asked[StudyFilter]) -> Page[StudyRead]:
    """List studies, by default the newest first. A cursor is valid only for the list that returned it."""
    return listing.list_studies(store, query.wanted(), limit=query.limit, cursor=query.cursor)


@router.get(
    "/{id}",
    summary="Read a study",
    response_model=StudyRead,
    response_description="The study with its experiments",
    responses=CACHED,
)
def read_study(id: Id, store: StoreDep, caller: CallerDep, request: Request, query: Asked[Revealing]) -> Response:
    """Return a study with its experiments, their states and progress, and the time left.

    By the id of one of its experiments, it is a study of that one alone.
    """
    study = reading.read(store, id, reveal=query.permitted(caller))
    return tagged(request, study, study.edits)


@router.patch(
    "/{id}",
    summary="Edit a study",
    response_model=StudyRead,
    response_description="After the edit",
    responses=TAGGED | documented(409, 412, 428),
)
def edit_study(id: Id, edit: Edit, store: StoreDep, request: Request, if_match: IfMatch = None) -> Response:
    """Change its name, notes or tags; by the id of one of its experiments, the name of that.

    `If-Match` names the `ETag` of what you edit; progress does not invalidate it.
    """
    study = editing.edit(store, id, edit, starting_from=starting_from(if_match))
    return tagged(request, study, study.edits)


@router.get("/{id}/spec", summary="Read a study's spec", response_description="To submit it again")
def read_spec(id: Id, store: StoreDep, caller: CallerDep, query: Asked[Revealing]) -> SpecRead:
    """Return the spec of a study, or of one experiment of it, as it was submitted; and the complete ones."""
    return reading.read_spec(store, id, reveal=query.permitted(caller))


_VERBS = {
    Verb.PAUSE: (
        "PAUSING, or PAUSED if no repetition is running",
        "Let running repetitions finish their step and free their cores, and start none until it resumes.",
    ),
    Verb.RESUME: (
        "RUNNING or QUEUED; it continues where it was",
        "Continue every paused experiment; the pause changes none of its numbers.",
    ),
    Verb.STOP: (
        "STOPPING, or ended if no repetition is running",
        "Let running repetitions finish their step, then complete every experiment with the results so far.\n\n"
        "An experiment without a single point of its curve ends as CANCELLED.",
    ),
    Verb.CANCEL: (
        "CANCELLED; what is stored is kept",
        "Cancel every experiment that has not ended at once; what is stored is kept.",
    ),
    Verb.RETRY: (
        "QUEUED again, or as before if it has not ended",
        "Queue the repetitions that FAILED once more; each goes on from its stored steps.",
    ),
}
"""The state after each verb, and what it does."""


def _add(verb: Verb, returned: str, told: str) -> None:
    def ask(id: Id, store: StoreDep) -> StudyRead:
        return lifecycle.ask(store, id, verb)

    router.add_api_route(
        f"/{{id}}/{verb}",
        ask,
        methods=["POST"],
        name=f"{verb}_study",
        summary=f"{verb.title()} a study",
        description=told,
        response_description=returned,
        responses=documented(409),
    )


for _verb, _told in _VERBS.items():
    _add(_verb, *_told)


@router.post(
    "/{id}/extend",
    status_code=202,
    summary="Extend a study",
    response_description="QUEUED again",
    responses=documented(409, 429),
)
def extend_study(id: Id, totals: ExtensionSpec, store: StoreDep, admitted: LimitedDep, query: Confirming) -> StudyRead:
    """Set new totals of iterations or repetitions for the completed experiments that are smaller.

    Existing results stay, and the whole equals a study that was submitted with these totals. An experiment that is
    larger keeps its size, and one that takes no samples has no iterations to add. A stopped experiment is completed.
    """
    return lifecycle.extend(store, id, totals, query.given(admitted))


@router.patch("/{id}/schedule", summary="Change a study's schedule", response_description="With its new schedule")
def schedule_study(id: Id, change: ScheduleChange, store: StoreDep) -> StudyRead:
    """Change the priority of its experiments, or how many repetitions of each run at once.

    This changes no result and stops no repetition.
    """
    return lifecycle.schedule(store, id, change)


@router.post(
    "/{id}/accept-versions",
    summary="Continue with other versions",
    response_description="The next supervisor continues it",
    responses=documented(409),
)
def accept_versions(id: Id, store: StoreDep) -> StudyRead:
    """Let its experiments continue with other engines or plug-ins than they started with: the next supervisor's.

    Their results may differ from those of the first versions. The provenance records which versions were used.
    """
    return provenance.accept_versions(store, id)
