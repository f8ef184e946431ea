"""What a notification says about a study or an experiment that has ended."""

from gaplab.schemas.notifications import EndedExperiment, Notification
from gaplab.services.experiments.views import state_of
from gaplab.services.store.models import EventRow, ExperimentRow, StudyRow
from gaplab.services.store.queries.experiments import experiments_of
from gaplab.services.store.session import Session


def of_experiment(event: EventRow, row: ExperimentRow) -> Notification:
    """Return the notification of an experiment's end."""
    return Notification(
        id=f"{event.number}-{row.id}",
        kind="experiment",
        subject=row.id,
        name=row.name,
        state=row.state,
        text=f"The experiment {row.name} is {row.state}.",
        experiments=(EndedExperiment(id=row.id, name=row.name, state=row.state),),
        ended_at=event.at,
    )


def of_study(session: Session, event: EventRow, row: StudyRow) -> Notification:
    """Return the notification of a study's end."""
    experiments = experiments_of(session, [row.id])
    state = state_of([experiment.state for experiment in experiments])
    return Notification(
        id=f"{event.number}-{row.id}",
        kind="study",
        subject=row.id,
        name=row.name,
        state=state,
        text=f"The study {row.name} is {state}: {_counted([each.state.value for each in experiments])}.",
        experiments=tuple(EndedExperiment(id=each.id, name=each.name, state=each.state) for each in experiments),
        ended_at=event.at,
    )


def _counted(states: list[str]) -> str:
    return ", ".join(f"{states.count(state)} {state}" for state in sorted(set(states)))
