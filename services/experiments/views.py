"""Experiments, studies and repetitions as the API shows them: with progress and fitness, without hidden parameters.

The experiments of a study share one reality, so an ended experiment stays hidden until all of its study have ended.
Their fitness in one number agrees with their curves: it is a point that all have reached.
"""

from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

from sqlalchemy.orm import Session

from gaplab.schemas.lifecycle import State
from gaplab.schemas.records import (
    BestRead,
    ExperimentRead,
    FitnessRead,
    RepetitionRead,
    StudyRead,
    common_count,
)
from gaplab.services.core.arrays import frozen
from gaplab.services.core.curves import mean_and_deviation
from gaplab.services.core.strategies import strategies
from gaplab.services.experiments.checks import summaries
from gaplab.services.experiments.progress import caveat_of, caveat_of_several, mean_best, progress_of
from gaplab.services.plugins.external import tells_unavailable
from gaplab.services.specs.measured import needs_readings
from gaplab.services.specs.robots import sensors
from gaplab.services.specs.stored_specs import checked, discrepancy_of, without_truth
from gaplab.services.store.models import ExperimentRow, RepetitionRow
from gaplab.services.store.queries import attempts
from gaplab.services.store.queries.experiments import Members, open_studies
from gaplab.services.store.queries.progress import Tally, reasons, tallies
from gaplab.services.store.queries.requests import doubtful
from gaplab.services.store.queries.results import best_recorded, last_common, recorded_at
from gaplab.services.store.texts import unpack_tags


def hidden(session: Session, experiments: Sequence[ExperimentRow]) -> frozenset[str]:
    """Return the ids of the experiments whose reality's parameters may not be shown yet."""
    open_ = open_studies(session, [row.study_id for row in experiments])
    return frozenset(row.id for row in experiments if row.study_id in open_)


def fitness_of(session: Session, rows: Sequence[ExperimentRow]) -> dict[str, FitnessRead]:
    """Return the point of each experiment's curve after the last common number of evaluations, if it has a mean."""
    return points_at(session, last_common(session, [row.id for row in rows]), {row.id: row.known for row in rows})


def points_at(session: Session, counts: Mapping[str, int], known: Mapping[str, int]) -> dict[str, FitnessRead]:
    """Return the point of each experiment's curve after its number of real-world evaluations, if it has a mean.

    `counts` are these numbers, `known` those of samples from before.
    """
    points = {
        experiment: mean_and_deviation(frozen(values)) for experiment, values in recorded_at(session, counts).items()
    }
    return {
        experiment: FitnessRead(evaluations=counts[experiment], known=known[experiment], n=n, mean=mean, sd=sd)
        for experiment, (n, mean, sd) in points.items()
        if mean is not None
    }


def best_of(session: Session, studies: Mapping[str, Sequence[ExperimentRead]]) -> dict[str, BestRead]:
    """Return the fittest experiment of each study, after the last number of evaluations that its experiments share.

    It is the fittest of those with the most repetitions.
    """
    shared = {study: common_count(experiments) for study, experiments in studies.items()}
    counts = {study: count for study, count in shared.items() if count is not None}
    rivals = {study: _rivals(studies[study]) for study in counts}
    points = {each.id: each.fitness for found in rivals.values() for each in found if each.fitness}
    wanted = {each.id: counts[study] for study, found in rivals.items() for each in found if not each.level}
    elsewhere = {id_: count for id_, count in wanted.items() if points[id_].evaluations != count}
    points |= points_at(session, elsewhere, {id_: point.known for id_, point in points.items()})
    return {
        study: _fittest(
            [(each, points[each.id]) for each in found if each.level or points[each.id].evaluations == counts[study]]
        )
        for study, found in rivals.items()
    }


def _rivals(experiments: Sequence[ExperimentRead]) -> list[ExperimentRead]:
    """Return the experiments with a fitness; the direct baseline only if there is no other."""
    found = [each for each in experiments if each.fitness]
    return [each for each in found if not each.direct] or found


def _fittest(points: Sequence[tuple[ExperimentRead, FitnessRead]]) -> BestRead:
    experiment, point = max(points, key=lambda each: (each[1].n, each[1].mean))  # of few, the best is luck
    return BestRead(**point.model_dump(), experiment=experiment.id, name=experiment.name, strategy=experiment.strategy)


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


def _work(session: Session, rows: Sequence[ExperimentRow]) -> dict[str, Tally]:
    """Return the work on each experiment; a study that runs needs the times of those of its members that ended too."""
    found = tallies(session, [row.id for row in rows])
    running = {row.study_id for row in rows if row.state in _MOVING}
    spans = attempts.work_spans(session, [row.id for row in rows if row.study_id in running])
    return {row.id: replace(found.get(row.id, Tally()), spans=tuple(spans.get(row.id, ()))) for row in rows}


def _view(
    session: Session, rows: Sequence[ExperimentRow], work: Mapping[str, Tally], *, reveal: bool
) -> list[ExperimentRead]:
    ids = [row.id for row in rows]
    failures, checks, doubts = reasons(session, ids), summaries(session, rows), doubtful(session, ids)
    fitness, best = fitness_of(session, rows), best_recorded(session, ids)
    secret = frozenset() if reveal else hidden(session, rows)

    def read(row: ExperimentRow) -> ExperimentRead:
        check, warnings = checks.get(row.id, (None, ()))
        return ExperimentRead.filled_from(
            row,
            study=row.study_id,
            direct=row.strategy in strategies and strategies[row.strategy].in_reality,
            level=row.level,
            caveat=caveat_of(row.state, work[row.id]),
            spec=without_truth(row.spec) if row.id in secret else row.spec,
            priority=-row.precedence,
            progress=progress_of(work[row.id]),
            fitness=fitness.get(row.id),
            best_fitness=mean_best(best[row.id]) if row.id in best else None,
            reasons=(*([row.paused_because] if row.paused_because else []), *failures.get(row.id, ())),
            sensitivity=check,
            doubts=doubts.get(row.id, ()),
            warnings=(*doubts.get(row.id, ()), *warnings, *_version_warnings(row, work[row.id])),
        )

    return list(map(read, rows))


def _study(
    found: Members, experiments: Sequence[ExperimentRead], work: Mapping[str, Tally], best: BestRead | None
) -> StudyRead:
    together = sum((work[each.id] for each in experiments), Tally())
    states = Counter(each.state for each in experiments)
    stopped = sum(each.state is State.COMPLETED and work[each.id].stopped > 0 for each in experiments)
    state = state_of(states)
    alone = experiments[0].caveat if len(experiments) == 1 else None
    return StudyRead.filled_from(
        found.study,
        id=found.named.id,
        name=found.named.name,
        tags=unpack_tags(found.study.tags),
        state=state,
        caveat=alone or caveat_of_several(state, states, stopped, together),
        best=best,
        experiments=tuple(experiments),
        progress=progress_of(together),
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
