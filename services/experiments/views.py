"""Experiments, studies and repetitions as the API shows them: with progress, without hidden parameters."""

from collections import defaultdict
from collections.abc import Collection, Mapping, Sequence

from sqlalchemy.orm import Session

from gaplab.schemas.lifecycle import State
from gaplab.schemas.records import ExperimentRead, RepetitionRead, StudyRead
from gaplab.services.experiments.checks import CheckSummary, summaries
from gaplab.services.experiments.hiding import hidden
from gaplab.services.experiments.progress import mean_best, progress_of
from gaplab.services.plugins.refusals import tells_unavailable
from gaplab.services.store.models import ExperimentRow, RepetitionRow, StudyRow
from gaplab.services.store.queries.experiments import experiments_of
from gaplab.services.store.queries.progress import Tally, reasons, tallies
from gaplab.services.store.queries.results import best_recorded
from gaplab.services.store.stored_specs import without_truth
from gaplab.services.store.texts import unpack_tags


def view_experiments(
    session: Session, rows: Sequence[ExperimentRow], *, reveal: bool = False
) -> tuple[ExperimentRead, ...]:
    """Return the experiments with their progress.

    Args:
        session: session of a transaction.
        rows: rows of the experiments.
        reveal: include hidden parameters of reality.
    """
    return _view(session, rows, tallies(session, [row.id for row in rows]), reveal=reveal)


def view_studies(session: Session, rows: Sequence[StudyRow], *, reveal: bool = False) -> tuple[StudyRead, ...]:
    """Return the studies with their experiments; `reveal` includes hidden parameters of reality."""
    experiments = experiments_of(session, [row.id for row in rows])
    progress = tallies(session, [row.id for row in experiments])
    by_study: dict[str | None, list[ExperimentRead]] = defaultdict(list)
    for experiment in _view(session, experiments, progress, reveal=reveal):
        by_study[experiment.study].append(experiment)
    return tuple(_study(row, by_study[row.id], progress) for row in rows)


def view_repetition(row: RepetitionRow, *, secret: bool) -> RepetitionRead:
    """Return the repetition.

    Args:
        row: the repetition.
        secret: keep what reality's code said about an error to itself.
    """
    shown = RepetitionRead(**{name: getattr(row, name) for name in RepetitionRead.model_fields})
    return shown if secret or row.hidden_error is None else shown.model_copy(update={"error": row.hidden_error})


def state_of(states: Collection[State]) -> State:
    """Return the combined state of experiments.

    If all have ended: COMPLETED if at least one is, else FAILED if at least one is, else CANCELLED. Otherwise: the
    state that all open experiments share, else RUNNING.
    """
    open_ = {state for state in states if not state.ended}
    if not open_:
        ends = (State.COMPLETED, State.FAILED, State.CANCELLED)
        return next((end for end in ends if end in states), State.COMPLETED)
    (first, *others) = open_
    if others or (first is State.QUEUED and open_ != set(states)):
        return State.RUNNING
    return first


def _view(
    session: Session, rows: Sequence[ExperimentRow], progress: Mapping[str, Tally], *, reveal: bool
) -> tuple[ExperimentRead, ...]:
    ids = [row.id for row in rows]
    failures, checks, best = reasons(session, ids), summaries(session, rows), best_recorded(session, ids)
    secret = frozenset() if reveal else hidden(session, rows)
    return tuple(
        _experiment(
            row,
            progress.get(row.id, Tally()),
            failures.get(row.id, ()),
            checks.get(row.id, CheckSummary()),
            best=mean_best(best[row.id]) if row.id in best else None,
            secret=row.id in secret,
        )
        for row in rows
    )


def _experiment(
    row: ExperimentRow,
    tally: Tally,
    failures: tuple[str, ...],
    check: CheckSummary,
    *,
    best: float | None,
    secret: bool,
) -> ExperimentRead:
    return ExperimentRead(
        id=row.id,
        study=row.study_id,
        name=row.name,
        notes=row.notes,
        tags=unpack_tags(row.tags),
        edits=row.edits,
        archived_at=row.archived_at,
        strategy=row.strategy,
        direct=row.iterations == 1,  # other strategies have at least one iteration after number 0
        state=row.state,
        spec=without_truth(row.spec) if secret else row.spec,
        priority=-row.precedence,
        max_parallel=row.max_parallel,
        progress=progress_of(tally),
        best_fitness=best,
        reasons=(*([row.paused_because] if row.paused_because else []), *failures),
        sensitivity=check.id,
        warnings=(*check.warnings, *_version_warnings(row, tally)),
        created_at=row.created_at,
        started_at=row.started_at,
        ended_at=row.ended_at,
    )


def _study(row: StudyRow, experiments: Sequence[ExperimentRead], progress: Mapping[str, Tally]) -> StudyRead:
    return StudyRead(
        id=row.id,
        name=row.name,
        notes=row.notes,
        tags=unpack_tags(row.tags),
        edits=row.edits,
        archived_at=row.archived_at,
        state=state_of([experiment.state for experiment in experiments]),
        experiments=tuple(experiments),
        progress=progress_of(sum((progress.get(each.id, Tally()) for each in experiments), Tally())),
        created_at=row.created_at,
    )


def _version_warnings(row: ExperimentRow, tally: Tally) -> tuple[str, ...]:
    """Return why the experiment waits, if a supervisor skipped it because its versions differ."""
    if row.refused_by is None or row.state.ended or tally.running:
        return ()
    if tells_unavailable(row.refused_by):
        return (f"it waits for a supervisor that can use its plug-ins: {row.refused_by}",)
    return (
        f"its first steps were computed with {row.computed_with}, and a supervisor with {row.refused_by} does not go "
        f"on with it: start one with the same as at first, or accept the others (`gaplab accept-versions {row.id}`)",
    )
