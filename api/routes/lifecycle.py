"""The life cycle of experiments and studies: pause, resume, stop, cancel, extend, and change the schedule."""

from typing import Annotated

from fastapi import APIRouter, Body

from gaplab.api.http.dependencies import Id, LimitedDep, StoreDep
from gaplab.api.http.problems import documented
from gaplab.api.routes.studies import Confirming
from gaplab.schemas.lifecycle import ExtensionSpec, ScheduleChange, Verb
from gaplab.schemas.records import ExperimentRead, StudyRead
from gaplab.services.experiments import extension, lifecycle

_experiment = APIRouter(prefix="/experiments/{id}", tags=["experiments"])
_study = APIRouter(prefix="/studies/{id}", tags=["studies"])

Totals = Annotated[ExtensionSpec, Body(openapi_examples=ExtensionSpec.EXAMPLES)]

_VERBS = {
    Verb.PAUSE: (
        "PAUSING, or PAUSED if no repetition is running",
        "Let running repetitions finish their step and free their cores, and start none until the experiment resumes.",
        "Pause every experiment of the study that can be paused.",
    ),
    Verb.RESUME: (
        "RUNNING or QUEUED; it continues where it was",
        "Continue a paused experiment; the pause changes none of its numbers.",
        "Resume every paused experiment of the study.",
    ),
    Verb.STOP: (
        "STOPPING, or ended if no repetition is running",
        "Let running repetitions finish their step, then complete the experiment with the results so far.\n\n"
        "An experiment without a single point of its curve ends as CANCELLED.",
        "Stop every experiment of the study that has not ended, and keep the results so far.",
    ),
    Verb.CANCEL: (
        "CANCELLED; what is stored is kept",
        "Cancel an experiment at once; what is stored is kept. An experiment that has ended cannot be cancelled.",
        "Cancel every experiment of the study that has not ended.",
    ),
    Verb.RETRY: (
        "QUEUED again, or as before if it has not ended",
        "Queue the repetitions that FAILED once more; each goes on from its stored steps.",
        "Queue the FAILED repetitions of every experiment of the study once more.",
    ),
}
"""The state after each verb, and what it does to an experiment and to a study."""


def _add(verb: Verb, returned: str, of_experiment: str, of_study: str) -> None:
    def ask_experiment(id: Id, store: StoreDep) -> ExperimentRead:
        return lifecycle.ask_experiment(store, id, verb)

    def ask_study(id: Id, store: StoreDep) -> StudyRead:
        return lifecycle.ask_study(store, id, verb)

    for router_, endpoint, what, told in (
        (_experiment, ask_experiment, "an experiment", of_experiment),
        (_study, ask_study, "a study", of_study),
    ):
        router_.add_api_route(
            f"/{verb}",
            endpoint,
            methods=["POST"],
            name=f"{verb}_{what.split()[1]}",
            summary=f"{verb.title()} {what}",
            description=told,
            response_description=returned,
            responses=documented(404, 409),
        )


for _verb, _told in _VERBS.items():
    _add(_verb, *_told)


@_experiment.post(
    "/extend",
    status_code=202,
    summary="Extend an experiment",
    response_description="QUEUED again",
    responses=documented(404, 409, 413, 415, 422, 429),
)
def extend_experiment(
    id: Id, totals: Totals, store: StoreDep, admitted: LimitedDep, query: Confirming
) -> ExperimentRead:
    """Set new totals of iterations or repetitions for a completed experiment.

    Existing results stay, and the whole equals an experiment that was submitted with these totals. A stopped experiment
    that is given its own totals is completed.
    """
    return extension.extend_experiment(store, id, totals, query.given(admitted))


@_experiment.patch(
    "/schedule",
    summary="Change an experiment's schedule",
    response_description="With its new schedule",
    responses=documented(404, 413, 415, 422),
)
def schedule_experiment(
    id: Id, change: Annotated[ScheduleChange, Body(openapi_examples=ScheduleChange.EXAMPLES)], store: StoreDep
) -> ExperimentRead:
    """Change its priority, or how many repetitions run at once. This changes no result and stops no repetition."""
    return lifecycle.schedule_experiment(store, id, change)


@_study.post(
    "/extend",
    status_code=202,
    summary="Extend a study",
    response_description="QUEUED again",
    responses=documented(404, 409, 413, 415, 422, 429),
)
def extend_study(id: Id, totals: Totals, store: StoreDep, admitted: LimitedDep, query: Confirming) -> StudyRead:
    """Set new totals of iterations or repetitions for the completed experiments of a study that are smaller.

    Existing results stay. An experiment that is larger keeps its size, and one that takes no samples has no iterations
    to add. A stopped experiment is completed.
    """
    return extension.extend_study(store, id, totals, query.given(admitted))


router = APIRouter(routes=_experiment.routes + _study.routes)
