"""What is asked of experiments and studies: pause, resume, stop, cancel, extend, another turn."""

from typing import Annotated

from fastapi import APIRouter, Body

from gaplab.api.http import examples
from gaplab.api.http.dependencies import Id, LimitedDep, StoreDep
from gaplab.api.http.problems import documented
from gaplab.schemas.lifecycle import State, Verb
from gaplab.schemas.records import ExperimentRead, StudyRead
from gaplab.schemas.schedule import ExtensionSpec, ScheduleChange
from gaplab.services.experiments import lifecycle
from gaplab.services.experiments.extension import extend_experiment as extend_to

router = APIRouter()

_EXTENSIONS = {
    "both": {"summary": "20 iterations and 60 repetitions, in all", "value": {"iterations": 20, "repetitions": 60}}
}
_SCHEDULES = {"urgent": {"summary": "Before all others, on two cores", "value": {"priority": 10, "max_parallel": 2}}}


def _experiment(state: State, description: str) -> dict[str, object]:
    return examples.shown(examples.EXPERIMENT.model_copy(update={"state": state}), description)


def _study(state: State, description: str) -> dict[str, object]:
    return examples.shown(examples.STUDY.model_copy(update={"state": state}), description)


@router.post(
    "/experiments/{id}/pause",
    tags=["experiments"],
    summary="Pause an experiment",
    responses={200: _experiment(State.PAUSING, "Pausing, or paused if nothing ran"), **documented(404, 409)},
)
def pause_experiment(id: Id, store: StoreDep) -> ExperimentRead:  # noqa: A002 - the address says {id}
    """Let running repetitions finish their step and give their core back, and start no other, until it is resumed."""
    return lifecycle.ask_experiment(store, id, Verb.PAUSE)


@router.post(
    "/experiments/{id}/resume",
    tags=["experiments"],
    summary="Resume an experiment",
    responses={200: _experiment(State.QUEUED, "It goes on from where it was"), **documented(404, 409)},
)
def resume_experiment(id: Id, store: StoreDep) -> ExperimentRead:  # noqa: A002 - the address says {id}
    """Go on with an experiment that was paused, with the numbers that it would have had anyway."""
    return lifecycle.ask_experiment(store, id, Verb.RESUME)


@router.post(
    "/experiments/{id}/stop",
    tags=["experiments"],
    summary="Stop an experiment",
    responses={200: _experiment(State.STOPPING, "Stopping, or ended if nothing ran"), **documented(404, 409)},
)
def stop_experiment(id: Id, store: StoreDep) -> ExperimentRead:  # noqa: A002 - the address says {id}
    """Let running repetitions finish their step, then complete the experiment with what is there.

    One of which no repetition has a point of the curve ends as CANCELLED.
    """
    return lifecycle.ask_experiment(store, id, Verb.STOP)


@router.post(
    "/experiments/{id}/cancel",
    tags=["experiments"],
    summary="Cancel an experiment",
    responses={200: _experiment(State.CANCELLED, "Called off; what is stored stays"), **documented(404, 409)},
)
def cancel_experiment(id: Id, store: StoreDep) -> ExperimentRead:  # noqa: A002 - the address says {id}
    """Call an experiment off at once; what is stored stays. One that has ended cannot be."""
    return lifecycle.ask_experiment(store, id, Verb.CANCEL)


@router.post(
    "/experiments/{id}/extend",
    status_code=202,
    tags=["experiments"],
    summary="Extend an experiment",
    responses={202: _experiment(State.QUEUED, "It is queued again"), **documented(404, 409, 413, 415, 422, 429)},
)
def extend_experiment(
    id: Id,  # noqa: A002 - the address says {id}
    extension: Annotated[ExtensionSpec, Body(openapi_examples=_EXTENSIONS)],
    store: StoreDep,
    admitted: LimitedDep,
) -> ExperimentRead:
    """Add iterations or repetitions to a completed experiment: totals, not what is added.

    What is there stands, and the whole equals an experiment that was submitted with these totals. With the totals that
    it has, one that was stopped is brought to its end.
    """
    return extend_to(store, id, extension, admitted)


@router.patch(
    "/experiments/{id}/schedule",
    tags=["experiments"],
    summary="Change an experiment's turn",
    responses={200: _experiment(State.QUEUED, "With its new schedule"), **documented(404, 413, 415, 422)},
)
def schedule_experiment(
    id: Id,  # noqa: A002 - the address says {id}
    change: Annotated[ScheduleChange, Body(openapi_examples=_SCHEDULES)],
    store: StoreDep,
) -> ExperimentRead:
    """Change the priority, or how many repetitions run at once. It changes no number, and stops nothing that runs."""
    return lifecycle.schedule_experiment(store, id, change)


@router.post(
    "/studies/{id}/pause",
    tags=["studies"],
    summary="Pause a study",
    responses={200: _study(State.PAUSING, "Pausing, or paused if nothing ran"), **documented(404, 409)},
)
def pause_study(id: Id, store: StoreDep) -> StudyRead:  # noqa: A002 - the address says {id}
    """Pause every experiment of the study that permits it."""
    return lifecycle.ask_study(store, id, Verb.PAUSE)


@router.post(
    "/studies/{id}/resume",
    tags=["studies"],
    summary="Resume a study",
    responses={200: _study(State.QUEUED, "It goes on from where it was"), **documented(404, 409)},
)
def resume_study(id: Id, store: StoreDep) -> StudyRead:  # noqa: A002 - the address says {id}
    """Resume every experiment of the study that is paused."""
    return lifecycle.ask_study(store, id, Verb.RESUME)


@router.post(
    "/studies/{id}/stop",
    tags=["studies"],
    summary="Stop a study",
    responses={200: _study(State.STOPPING, "Stopping, or ended if nothing ran"), **documented(404, 409)},
)
def stop_study(id: Id, store: StoreDep) -> StudyRead:  # noqa: A002 - the address says {id}
    """Stop every experiment of the study that has not ended, and keep what is there."""
    return lifecycle.ask_study(store, id, Verb.STOP)


@router.post(
    "/studies/{id}/cancel",
    tags=["studies"],
    summary="Cancel a study",
    responses={200: _study(State.CANCELLED, "Called off; what is stored stays"), **documented(404, 409)},
)
def cancel_study(id: Id, store: StoreDep) -> StudyRead:  # noqa: A002 - the address says {id}
    """Call off every experiment of the study that has not ended."""
    return lifecycle.ask_study(store, id, Verb.CANCEL)
