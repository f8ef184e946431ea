"""Experiments, studies and repetitions as the API shows them: with progress, without hidden parameters."""

from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field

from sqlalchemy.orm import Session

from gaplab.schemas.lifecycle import State
from gaplab.schemas.records import BestRead, ExperimentRead, FitnessRead, Progress, RepetitionRead, StudyRead
from gaplab.services.core.strategies import strategies
from gaplab.services.experiments.checks import CheckSummary, summaries
from gaplab.services.experiments.fitness import best_of, fitness_of
from gaplab.services.experiments.hiding import hidden
from gaplab.services.experiments.progress import Span, caveat_of, caveat_of_several, mean_best, progress_of
from gaplab.services.plugins.external import tells_unavailable
from gaplab.services.specs.measured import needs_readings
from gaplab.services.specs.robots import sensors
from gaplab.services.specs.stored_specs import checked, discrepancy_of, without_truth
from gaplab.services.store.models import ExperimentRow, RepetitionRow
from gaplab.services.store.queries import attempts
from gaplab.services.store.queries.experiments import Members
from gaplab.services.store.queries.progress import Tally, reasons, tallies
from gaplab.services.store.queries.requests import doubtful
from gaplab.services.store.queries.results import best_recorded
from gaplab.services.store.texts import unpack_tags

_MOVING = (State.RUNNING, State.PAUSING, State.STOPPING)


def view(session: Session, *found: Members, reveal: bool = False) -> tuple[StudyRead, ...]:
    """Return studies, or each as one experiment of it alone; `reveal` includes hidden parameters of reality."""
    rows = [row for each in found for row in each.experiments]
    work = _work(session, rows)
    shown = {each.id: each for each in _view(session, rows, work, reveal=reveal)}
    by_id = {each.named.id: [shown[id_] for id_ in each.ids] for each in found}
    best = best_of(session, by_id)
    return tuple(_study(each, by_id[each.named.id], work, best.get(each.named.id)) for each in found)


def view_experiments(session: Session, rows: Sequence[ExperimentRow], *, reveal: bool = False) -> list[ExperimentRead]:
    """Return experiments with their progress; `reveal` includes hidden parameters of reality."""
    return _view(session, rows, _work(session, rows), reveal=reveal)


def with_sensors(experiment: ExperimentRead) -> ExperimentRead:
    """Return the experiment with the sensors of its robot."""
    found = sensors(checked(experiment.spec))
    if found is not None:
        found = found.model_copy(update={"needed": needs_readings(discrepancy_of(experiment.spec), found)})
    return experiment.model_copy(update={"sensors": found})


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
    running = {row.study_id for row in rows if row.state in _MOVING}
    spans = attempts.work_spans(session, [row.id for row in rows if row.study_id in running])
    return {row.id: _Work(found.get(row.id, Tally()), tuple(spans.get(row.id, ()))) for row in rows}


def _view(
    session: Session, rows: Sequence[ExperimentRow], work: Mapping[str, _Work], *, reveal: bool
) -> list[ExperimentRead]:
    ids = [row.id for row in rows]
    found = _Findings(
        failures=reasons(session, ids),
        checks=summaries(session, rows),
        fitness=fitness_of(session, rows),
        best=best_recorded(session, ids),
        doubts=doubtful(session, ids),
    )
    secret = frozenset() if reveal else hidden(session, rows)
    return [_experiment(row, work[row.id], found, secret=row.id in secret) for row in rows]


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
    found: Members, experiments: Sequence[ExperimentRead], work: Mapping[str, _Work], best: BestRead | None
) -> StudyRead:
    together = sum((work[each.id] for each in experiments), _Work())
    states = Counter(each.state for each in experiments)
    stopped = sum(each.state is State.COMPLETED and work[each.id].tally.stopped > 0 for each in experiments)
    state = state_of(states)
    alone = experiments[0].caveat if len(experiments) == 1 else None
    return StudyRead.filled_from(
        found.study,
        id=found.named.id,
        name=found.named.name,
        tags=unpack_tags(found.study.tags),
        state=state,
        caveat=alone or caveat_of_several(state, states, stopped, together.tally),
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
