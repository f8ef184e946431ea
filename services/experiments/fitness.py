"""The fitness of experiments in one number that agrees with their curves: a point that all have reached."""

from collections.abc import Mapping, Sequence

from sqlalchemy.orm import Session

from gaplab.schemas.records import BestRead, ExperimentRead, FitnessRead, common_count
from gaplab.services.core.arrays import frozen
from gaplab.services.core.curves import mean_and_deviation
from gaplab.services.store.models import ExperimentRow
from gaplab.services.store.queries.results import last_common, recorded_at


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
