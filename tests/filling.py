"""A database as after years of use: studies with results, written in bulk through the models."""

from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from itertools import islice
from typing import Any

import numpy as np
from sqlalchemy import insert
from sqlalchemy.orm import Session

from gaplab.schemas.lifecycle import State
from gaplab.schemas.spec import ExperimentSpec
from gaplab.services.core.types import Cost, Measured, Probed, Sample, Selected, Simulator, Transferred, Tuned
from gaplab.services.specs.resolution import expected_rollouts, resolve_experiment
from gaplab.services.store.models import Base, ExperimentRow, RepetitionRow, StepKind, StepRow, StudyRow
from gaplab.services.store.queries.logs import columns_of
from gaplab.services.store.session import Store

IN_A_STUDY = 7
"""Experiments in a study, as in the paper's Fig. 4."""

REPETITIONS, SAMPLES = 4, 10
"""Repetitions of an experiment, and samples of a repetition: 10 000 experiments have 400 000 samples."""

SPEC = {
    "strategy": "simulated_fit",
    "robot": "toy_function",
    "iterations": SAMPLES,
    "repetitions": REPETITIONS,
    "budget": "smoke",
}

Row = dict[str, Any]

_BEGINNING = datetime(2020, 1, 1, tzinfo=UTC)
_AT_ONCE = 500


def fill(store: Store, experiments: int) -> None:
    """Add COMPLETED experiments with 40 samples each, in studies of `IN_A_STUDY`.

    Args:
        store: store at the latest revision, without repetitions.
        experiments: number of experiments to add.
    """
    spec = resolve_experiment(ExperimentSpec.model_validate(SPEC))
    stored, rollouts = spec.model_dump(mode="json"), expected_rollouts(spec)
    rng = np.random.default_rng(0)
    numbers = iter(range(experiments))
    while batch := list(islice(numbers, _AT_ONCE)):
        with store.transaction() as session:
            studies = sorted({each // IN_A_STUDY for each in batch if each % IN_A_STUDY == 0})
            _insert(session, StudyRow, [_study(each) for each in studies])
            _insert(session, ExperimentRow, [_experiment(each, stored, rollouts) for each in batch])
            repetitions = [(experiment, number) for experiment in batch for number in range(REPETITIONS)]
            _insert(session, RepetitionRow, [_repetition(*each, rollouts) for each in repetitions])
            iterations = [(_id_of(*each), iteration) for each in repetitions for iteration in range(SAMPLES + 1)]
            _insert(session, StepRow, [row for each in iterations for row in _steps(*each, rng.random(9))])
    with store.transaction() as session:
        if session.get_bind().dialect.name == "postgresql":  # its sequence does not know the inserted ids
            session.connection().exec_driver_sql(
                f"SELECT setval('repetition_id_seq', {max(1, experiments * REPETITIONS)})"
            )
        session.connection().exec_driver_sql("ANALYZE")


def study_id(number: int) -> str:
    """Return the id of a study."""
    return f"study{number:06d}"


def experiment_id(number: int) -> str:
    """Return the id of an experiment."""
    return f"experiment{number:06d}"


def _insert(session: Session, model: type[Base], rows: list[Row]) -> None:
    if rows:
        session.execute(insert(model), rows)


def _moment(number: int) -> datetime:
    return _BEGINNING + timedelta(minutes=number)


def _id_of(experiment: int, repetition: int) -> int:
    return experiment * REPETITIONS + repetition + 1


def _study(number: int) -> Row:
    return {"id": study_id(number), "name": f"study {number}", "created_at": _moment(number * IN_A_STUDY)}


def _experiment(number: int, spec: Row, rollouts: int) -> Row:
    study, position = divmod(number, IN_A_STUDY)
    created = _moment(study * IN_A_STUDY)
    return {
        "id": experiment_id(number),
        "study_id": study_id(study),
        "position": position,
        "name": "simulated_fit",
        "strategy": "simulated_fit",
        "state": State.COMPLETED,
        "claimable": False,
        "spec": spec,
        "iterations": SAMPLES + 1,
        "rollouts": rollouts,
        "created_at": created,
        "started_at": created,
        "ended_at": created + timedelta(seconds=30),
    }


def _repetition(experiment: int, number: int, rollouts: int) -> Row:
    return {
        "id": _id_of(experiment, number),
        "experiment_id": experiment_id(experiment),
        "number": number,
        "state": State.COMPLETED,
        "epoch": 1,
        "attempts": 1,
        "steps": 5 * SAMPLES + 3,
        "rollouts_done": rollouts,
        "seconds": 20.0,
        "started_at": _moment(experiment),
        "ended_at": _moment(experiment) + timedelta(seconds=20),
    }


def _steps(repetition: int, iteration: int, chance: np.ndarray) -> Iterator[Row]:
    genome, fitness = chance[:1], chance[1:4].tolist()
    cost = Cost(20)
    steps = (
        Selected(iteration, genome, cost),
        Measured(iteration, Sample(genome, fitness[0])),
        Tuned(iteration, (Simulator(chance[4:7], chance[7]),), Cost(20 * iteration)),
        Transferred(iteration, genome, fitness[1], cost),
        Probed(iteration, fitness[2], chance[8]),
    )
    for step in steps if iteration else steps[2:]:
        columns = columns_of(step)
        measured = "analytic" if columns["kind"] in (StepKind.MEASURED, StepKind.PROBED) else None
        own = {"repetition_id": repetition, "measured_by": measured, "seconds": 0.4, "at": _moment(repetition)}
        yield own | columns
