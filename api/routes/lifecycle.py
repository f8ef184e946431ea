"""The life cycle of experiments and studies: pause, resume, stop, cancel, extend, and change the schedule."""

from typing import Annotated

from fastapi import APIRouter, Body, Query

from gaplab.api.http.dependencies import Confirmation, Id, LimitedDep, StoreDep
from gaplab.api.http.problems import documented
from gaplab.schemas.lifecycle import Verb
from gaplab.schemas.records import ExperimentRead, StudyRead
from gaplab.schemas.schedule import ExtensionSpec, ScheduleChange
from gaplab.services.experiments import extension, lifecycle

_experiment = APIRouter(prefix="/experiments/{id}", tags=["experiments"])
_study = APIRouter(prefix="/studies/{id}", tags=["studies"])

_PAUSED = "PAUSING, or PAUSED if no repetition is running"
_RESUMED = "RUNNING or QUEUED; it continues where it was"
_STOPPED = "STOPPING, or ended if no repetition is running"
_CANCELLED = "CANCELLED; what is stored is kept"

_RETRIED = "QUEUED again, or as before if it has not ended"


@_experiment.post("/pause", summary="Pause an experiment", response_description=_PAUSED, responses=documented(404, 409))
def pause_experiment(id: Id, store: StoreDep) -> ExperimentRead:
    """Let running repetitions finish their step and free their cores, and start none until the experiment resumes."""
    return lifecycle.ask_experiment(store, id, Verb.PAUSE)


@_experiment.post(
    "/resume", summary="Resume an experiment", response_description=_RESUMED, responses=documented(404, 409)
)
def resume_experiment(id: Id, store: StoreDep) -> ExperimentRead:
    """Continue a paused experiment; the pause changes none of its numbers."""
    return lifecycle.ask_experiment(store, id, Verb.RESUME)


@_experiment.post("/stop", summary="Stop an experiment", response_description=_STOPPED, responses=documented(404, 409))
def stop_experiment(id: Id, store: StoreDep) -> ExperimentRead:
    """Let running repetitions finish their step, then complete the experiment with the results so far.

    An experiment without a single point of its curve ends as CANCELLED.
    """
    return lifecycle.ask_experiment(store, id, Verb.STOP)


@_experiment.post(
    "/cancel", summary="Cancel an experiment", response_description=_CANCELLED, responses=documented(404, 409)
)
def cancel_experiment(id: Id, store: StoreDep) -> ExperimentRead:
    """Cancel an experiment at once; what is stored is kept. An experiment that has ended cannot be cancelled."""
    return lifecycle.ask_experiment(store, id, Verb.CANCEL)


@_experiment.post(
    "/retry", summary="Retry an experiment", response_description=_RETRIED, responses=documented(404, 409)
)
def retry_experiment(id: Id, store: StoreDep) -> ExperimentRead:
    """Queue the repetitions that FAILED once more; each goes on from its stored steps."""
    return lifecycle.ask_experiment(store, id, Verb.RETRY)


@_experiment.post(
    "/extend",
    status_code=202,
    summary="Extend an experiment",
    response_description="QUEUED again",
    responses=documented(404, 409, 413, 415, 422, 429),
)
def extend_experiment(
    id: Id,
    totals: Annotated[ExtensionSpec, Body(openapi_examples=ExtensionSpec.EXAMPLES)],
    store: StoreDep,
    admitted: LimitedDep,
    query: Annotated[Confirmation, Query()],
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


@_study.post("/pause", summary="Pause a study", response_description=_PAUSED, responses=documented(404, 409))
def pause_study(id: Id, store: StoreDep) -> StudyRead:
    """Pause every experiment of the study that can be paused."""
    return lifecycle.ask_study(store, id, Verb.PAUSE)


@_study.post("/resume", summary="Resume a study", response_description=_RESUMED, responses=documented(404, 409))
def resume_study(id: Id, store: StoreDep) -> StudyRead:
    """Resume every paused experiment of the study."""
    return lifecycle.ask_study(store, id, Verb.RESUME)


@_study.post("/stop", summary="Stop a study", response_description=_STOPPED, responses=documented(404, 409))
def stop_study(id: Id, store: StoreDep) -> StudyRead:
    """Stop every experiment of the study that has not ended, and keep the results so far."""
    return lifecycle.ask_study(store, id, Verb.STOP)


@_study.post("/cancel", summary="Cancel a study", response_description=_CANCELLED, responses=documented(404, 409))
def cancel_study(id: Id, store: StoreDep) -> StudyRead:
    """Cancel every experiment of the study that has not ended."""
    return lifecycle.ask_study(store, id, Verb.CANCEL)


@_study.post("/retry", summary="Retry a study", response_description=_RETRIED, responses=documented(404, 409))
def retry_study(id: Id, store: StoreDep) -> StudyRead:
    """Queue the FAILED repetitions of every experiment of the study once more."""
    return lifecycle.ask_study(store, id, Verb.RETRY)


@_study.post(
    "/extend",
    status_code=202,
    summary="Extend a study",
    response_description="QUEUED again",
    responses=documented(404, 409, 413, 415, 422, 429),
)
def extend_study(
    id: Id,
    totals: Annotated[ExtensionSpec, Body(openapi_examples=ExtensionSpec.EXAMPLES)],
    store: StoreDep,
    admitted: LimitedDep,
    query: Annotated[Confirmation, Query()],
) -> StudyRead:
    """Set new totals of iterations or repetitions for the completed experiments of a study that are smaller.

    Existing results stay. An experiment that is larger keeps its size, and one that takes no samples has no iterations
    to add. A stopped experiment is completed.
    """
    return extension.extend_study(store, id, totals, query.given(admitted))


router = APIRouter()
router.include_router(_experiment)
router.include_router(_study)
