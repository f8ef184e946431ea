"""The life cycle of studies: pause, resume, stop, cancel, retry, extend, change the schedule, accept other versions.

Each address takes the id of a study, or of one experiment of it, which alone is then meant.
"""

from typing import Annotated

from fastapi import APIRouter, Body

from gaplab.api.http.dependencies import Id, LimitedDep, StoreDep
from gaplab.api.http.problems import documented
from gaplab.api.routes.studies import Confirming
from gaplab.schemas.lifecycle import ExtensionSpec, ScheduleChange, Verb
from gaplab.schemas.records import StudyRead
from gaplab.services.experiments import extension, lifecycle
from gaplab.services.running import provenance

router = APIRouter(prefix="/studies/{id}", tags=["studies"])

Totals = Annotated[ExtensionSpec, Body(openapi_examples=ExtensionSpec.EXAMPLES)]
Change = Annotated[ScheduleChange, Body(openapi_examples=ScheduleChange.EXAMPLES)]

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
        f"/{verb}",
        ask,
        methods=["POST"],
        name=f"{verb}_study",
        summary=f"{verb.title()} a study",
        description=told,
        response_description=returned,
        responses=documented(404, 409),
    )


for _verb, _told in _VERBS.items():
    _add(_verb, *_told)


@router.post(
    "/extend",
    status_code=202,
    summary="Extend a study",
    response_description="QUEUED again",
    responses=documented(404, 409, 413, 415, 422, 429),
)
def extend_study(id: Id, totals: Totals, store: StoreDep, admitted: LimitedDep, query: Confirming) -> StudyRead:
    """Set new totals of iterations or repetitions for the completed experiments that are smaller.

    Existing results stay, and the whole equals a study that was submitted with these totals. An experiment that is
    larger keeps its size, and one that takes no samples has no iterations to add. A stopped experiment is completed.
    """
    return extension.extend(store, id, totals, query.given(admitted))


@router.patch(
    "/schedule",
    summary="Change a study's schedule",
    response_description="With its new schedule",
    responses=documented(404, 413, 415, 422),
)
def schedule_study(id: Id, change: Change, store: StoreDep) -> StudyRead:
    """Change the priority of its experiments, or how many repetitions of each run at once.

    This changes no result and stops no repetition.
    """
    return lifecycle.schedule(store, id, change)


@router.post(
    "/accept-versions",
    summary="Continue with other versions",
    response_description="The next supervisor continues it",
    responses=documented(404, 409),
)
def accept_versions(id: Id, store: StoreDep) -> StudyRead:
    """Let its experiments continue with other engines or plug-ins than they started with: the next supervisor's.

    Their results may differ from those of the first versions. The provenance records which versions were used.
    """
    return provenance.accept_versions(store, id)
