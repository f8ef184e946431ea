"""Experiments, studies and repetitions as the API shows them: with progress, without hidden parameters."""

from collections import Counter, defaultdict
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field

from sqlalchemy.orm import Session

from gaplab.schemas.lifecycle import State
from gaplab.schemas.records import BestRead, ExperimentRead, FitnessRead, Progress, RepetitionRead, StudyRead
from gaplab.services.core.stored_specs import discrepancy_of
from gaplab.services.core.strategies import strategies
from gaplab.services.experiments.checks import CheckSummary, summaries
from gaplab.services.experiments.fitness import best_of, fitness_of
from gaplab.services.experiments.hiding import hidden
from gaplab.services.experiments.progress import Span, caveat_of, mean_best, progress_of, study_caveat_of
from gaplab.services.plugins.refusals import tells_unavailable
from gaplab.services.specs.measured import needs_readings
from gaplab.services.specs.robots import sensors
from gaplab.services.store.models import ExperimentRow, RepetitionRow, StudyRow
from gaplab.services.store.queries import attempts
from gaplab.services.store.queries.experiments import experiments_of
from gaplab.services.store.queries.progress import Tally, reasons, tallies
from gaplab.services.store.queries.requests import doubtful
from gaplab.services.store.queries.results import best_recorded
from gaplab.services.store.stored_specs import checked, without_truth
from gaplab.services.store.texts import unpack_tags

_MOVING = (State.RUNNING, State.PAUSING, State.STOPPING)


def view_experiments(
    session: Session, rows: Sequence[ExperimentRow], *, reveal: bool = False
) -> tuple[ExperimentRead, ...]:
    """Return the experiments with their progress; `reveal` includes hidden parameters of reality."""
    return _view(session, rows, _work(session, rows), reveal=reveal)


def with_sensors(experiment: ExperimentRead) -> ExperimentRead:
    """Return the experiment with the sensors of its robot."""
    found = sensors(checked(experiment.spec))
    if found is not None:
        found = found.model_copy(update={"needed": needs_readings(discrepancy_of(experiment.spec), found)})
    return experiment.model_copy(update={"sensors": found})


def view_studies(session: Session, rows: Sequence[StudyRow], *, reveal: bool = False) -> tuple[StudyRead, ...]:
    """Return the studies with their experiments; `reveal` includes hidden parameters of reality."""
    experiments = experiments_of(session, [row.id for row in rows])
    work = _work(session, experiments)
    by_study: dict[str, list[ExperimentRead]] = defaultdict(list)
    for experiment in _view(session, experiments, work, reveal=reveal):
        by_study[str(experiment.study)].append(experiment)
    best = best_of(session, by_study)
    return tuple(_study(row, by_study[row.id], work, best.get(row.id)) for row in rows)


def view_repetition(row: RepetitionRow, *, secret: bool) -> RepetitionRead:
    """Return the repetition; `secret` leaves out what reality's code said about an error."""
    return RepetitionRead.filled_from(row, error=row.error if secret else row.hidden_error or row.error)


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


@dataclass(frozen=True)
class _Work:
    """Work on an experiment: sums over its repetitions, and the times of work on them while it is running."""

    tally: Tally = field(default_factory=Tally)
    spans: tuple[Span, ...] = ()

    def __add__(self, other: "_Work") -> "_Work":
        return _Work(self.tally + other.tally, self.spans + other.spans)

    @property
    def progress(self) -> Progress:
        return progress_of(self.tally, self.spans)


def _work(session: Session, rows: Sequence[ExperimentRow]) -> dict[str, _Work]:
    """Return the work on each experiment; a study that runs needs the times of those of its members that ended too."""
    found = tallies(session, [row.id for row in rows])
    running = {row.study_id or row.id for row in rows if row.state in _MOVING}
    spans = attempts.work_spans(session, [row.id for row in rows if (row.study_id or row.id) in running])
    return {row.id: _Work(found.get(row.id, Tally()), tuple(spans.get(row.id, ()))) for row in rows}


def _view(
    session: Session, rows: Sequence[ExperimentRow], work: Mapping[str, _Work], *, reveal: bool
) -> tuple[ExperimentRead, ...]:
    ids = [row.id for row in rows]
    found = _Findings(
        failures=reasons(session, ids),
        checks=summaries(session, rows),
        fitness=fitness_of(session, rows),
        best=best_recorded(session, ids),
        doubts=doubtful(session, ids),
    )
    secret = frozenset() if reveal else hidden(session, rows)
    return tuple(_experiment(row, work[row.id], found, secret=row.id in secret) for row in rows)


@dataclass(frozen=True)
class _Findings:
    """Findings by experiment: reasons of failure, sensitivity check, fitness, doubtful measurements."""

    failures: Mapping[str, tuple[str, ...]]
    checks: Mapping[str, CheckSummary]
    fitness: Mapping[str, FitnessRead]
    best: Mapping[str, Sequence[float]]
    doubts: Mapping[str, tuple[str, ...]]


def _experiment(row: ExperimentRow, work: _Work, found: _Findings, *, secret: bool) -> ExperimentRead:
    check, doubts = found.checks.get(row.id, CheckSummary()), found.doubts.get(row.id, ())
    return ExperimentRead.filled_from(
        row,
        study=row.study_id,
        tags=unpack_tags(row.tags),
        direct=row.strategy in strategies and strategies[row.strategy].in_reality,
        level=not row.tunes,
        caveat=caveat_of(row.state, work.tally),
        spec=without_truth(row.spec) if secret else row.spec,
        priority=-row.precedence,
        progress=work.progress,
        fitness=found.fitness.get(row.id),
        best_fitness=mean_best(found.best[row.id]) if row.id in found.best else None,
        reasons=(*([row.paused_because] if row.paused_because else []), *found.failures.get(row.id, ())),
        sensitivity=check.id,
        doubts=doubts,
        warnings=(*doubts, *check.warnings, *_version_warnings(row, work.tally)),
    )


def _study(
    row: StudyRow, experiments: Sequence[ExperimentRead], work: Mapping[str, _Work], best: BestRead | None
) -> StudyRead:
    together = sum((work[each.id] for each in experiments), _Work())
    states = Counter(each.state for each in experiments)
    stopped = sum(each.state is State.COMPLETED and work[each.id].tally.stopped > 0 for each in experiments)
    state = state_of(states)
    return StudyRead.filled_from(
        row,
        tags=unpack_tags(row.tags),
        state=state,
        caveat=study_caveat_of(state, states, stopped, together.tally),
        best=best,
        experiments=tuple(experiments),
        progress=together.progress,
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
