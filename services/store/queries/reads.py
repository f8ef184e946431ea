"""Experiments, studies and repetitions as they are shown: rows, their progress, and nothing that is secret yet."""

from collections import defaultdict
from collections.abc import Collection, Mapping, Sequence
from typing import Any

from sqlalchemy.orm import Session

from gaplab.schemas.lifecycle import State
from gaplab.schemas.records import ExperimentRead, RepetitionRead, StudyRead
from gaplab.services.store.models import ExperimentRow, RepetitionRow, StudyRow
from gaplab.services.store.queries.experiments import experiments_of, open_studies
from gaplab.services.store.queries.progress import Tally, reasons, tallies
from gaplab.services.store.queries.results import best_recorded
from gaplab.services.store.queries.sensitivity import Warned, warned


def read_experiments(
    session: Session, rows: Sequence[ExperimentRow], *, reveal: bool = False
) -> tuple[ExperimentRead, ...]:
    """The experiments as they are shown, with their progress.

    Reality's parameters are null until the experiment has ended, and with it all others of its study: they share one
    reality, and what one of them shows is known of all. `reveal` shows them nevertheless.
    """
    return _read(session, rows, tallies(session, [row.id for row in rows]), reveal=reveal)


def _read(
    session: Session, rows: Sequence[ExperimentRow], progress: Mapping[str, Tally], *, reveal: bool
) -> tuple[ExperimentRead, ...]:
    ids = [row.id for row in rows]
    failed, warnings, best = reasons(session, ids), warned(session, rows), best_recorded(session, ids)
    secret = frozenset() if reveal else hidden(session, rows)
    return tuple(
        _experiment(
            row,
            progress.get(row.id, Tally()),
            failed.get(row.id, ()),
            warnings.get(row.id, Warned()),
            best=best.get(row.id),
            secret=row.id in secret,
        )
        for row in rows
    )


def hidden(session: Session, rows: Sequence[ExperimentRow]) -> frozenset[str]:
    """The ids of those of these experiments whose reality's parameters may not be shown yet."""
    going_on = open_studies(session, [row.study_id for row in rows if row.study_id])
    return frozenset(row.id for row in rows if not row.state.ended or row.study_id in going_on)


def without_truth(spec: Mapping[str, Any]) -> dict[str, Any]:
    """The spec with null in place of each of reality's parameters."""
    reality = spec["reality"]
    return {**spec, "reality": reality | {"parameters": dict.fromkeys(reality["parameters"])}}


def read_studies(session: Session, rows: Sequence[StudyRow], *, reveal: bool = False) -> tuple[StudyRead, ...]:
    """The studies as they are shown, with their experiments."""
    experiments = experiments_of(session, [row.id for row in rows])
    progress = tallies(session, [row.id for row in experiments])
    shown: dict[str | None, list[ExperimentRead]] = defaultdict(list)
    for each in _read(session, experiments, progress, reveal=reveal):
        shown[each.study].append(each)
    return tuple(_study(row, shown[row.id], progress) for row in rows)


def read_repetition(row: RepetitionRow) -> RepetitionRead:
    """The repetition as it is shown."""
    return RepetitionRead(
        number=row.number,
        state=row.state,
        iterations_done=row.iterations_done,
        rollouts_done=row.rollouts_done,
        attempts=row.attempts,
        error=row.error,
        started_at=row.started_at,
        ended_at=row.ended_at,
    )


def state_of(states: Collection[State]) -> State:
    """The state of experiments taken together: once all have ended, COMPLETED if one is, else FAILED if one is.

    Before, the state of those that have not, if they have one in common; else RUNNING, for some may go on.
    """
    left = {each for each in states if not each.ended}
    if not left:
        ends = (State.COMPLETED, State.FAILED, State.CANCELLED)
        return next((end for end in ends if end in states), State.COMPLETED)
    (first, *others) = left
    if others or (first is State.QUEUED and left != set(states)):
        return State.RUNNING
    return first


def _experiment(
    row: ExperimentRow, tally: Tally, failed: tuple[str, ...], warned: Warned, *, best: float | None, secret: bool
) -> ExperimentRead:
    return ExperimentRead(
        id=row.id,
        study=row.study_id,
        name=row.name,
        notes=row.notes,
        edits=row.edits,
        strategy=row.strategy,
        direct=row.iterations == 1,  # other strategies have at least one iteration after number 0
        state=row.state,
        spec=without_truth(row.spec) if secret else row.spec,
        priority=-row.precedence,
        max_parallel=row.max_parallel,
        progress=tally.progress(),
        best_fitness=best,
        reasons=failed,
        sensitivity=warned.check,
        warnings=(*warned.warnings, *_refusal(row, tally)),
        created_at=row.created_at,
        started_at=row.started_at,
        ended_at=row.ended_at,
    )


def _study(row: StudyRow, experiments: Sequence[ExperimentRead], progress: Mapping[str, Tally]) -> StudyRead:
    return StudyRead(
        id=row.id,
        name=row.name,
        notes=row.notes,
        edits=row.edits,
        state=state_of([each.state for each in experiments]),
        experiments=tuple(experiments),
        progress=sum((progress.get(each.id, Tally()) for each in experiments), Tally()).progress(),
        created_at=row.created_at,
    )


def _refusal(row: ExperimentRow, tally: Tally) -> tuple[str, ...]:
    """Why it does not go on, if that is for a supervisor's versions."""
    if row.refused_by is None or row.state.ended or tally.running:
        return ()
    return (
        f"its first steps were computed with {row.computed_with}, and a supervisor with {row.refused_by} does not go "
        f"on with it: start one with the same as at first, or accept the others (`gaplab accept-versions {row.id}`)",
    )
