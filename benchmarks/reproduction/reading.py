"""Studies from archives."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from datetime import datetime
from pathlib import Path

import numpy as np

from benchmarks.archives import import_file
from benchmarks.reproduction.studies import Arm, Study
from gaplab.schemas.records import ExperimentRead, MeasurementKind
from gaplab.schemas.resolved import ResolvedSpec
from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.stored_specs import spec_of
from gaplab.services.experiments import reading
from gaplab.services.results.curves import curves, recorded_of
from gaplab.services.store.models import MeasurementRow, RepetitionRow
from gaplab.services.store.queries import attempts, experiments
from gaplab.services.store.queries.costs import work_of
from gaplab.services.store.queries.repetition_rows import of_experiments
from gaplab.services.store.session import Session, Store


def samples_of(store: Store, arm: Arm) -> FloatArray:
    """Return the fitness `(r, k)` of samples by repetition and iteration; nan if it failed or is missing."""
    with store.reading() as session:
        return _measured(session, arm.read.id, MeasurementKind.SAMPLE, arm.recorded.shape)


def read_study(store: Store, archives: Sequence[Path]) -> Study:
    """Import archives of studies or of single experiments, and return them as one study, named by the first.

    Raises:
        SystemExit: a file is no archive, or the archives differ in robot, engines, reality, budget, tuner,
            optimizers or seed.
    """
    parts = [_part(store, archive) for archive in archives]
    reads = tuple(read for _, experiments_of in parts for read in experiments_of)
    with store.reading() as session:
        arms = _arms(session, reads)
    if len(parts) > 1 and len({_settings(arm.spec) for arm in arms}) > 1:
        raise SystemExit(
            f"{', '.join(map(str, archives))}: robot, engines, reality, budget, tuner, optimizers or seed differ"
        )
    drawn = curves(store, [read.id for read in reads])
    names = _names(arms)
    return Study(
        tuple(archives),
        parts[0][0],
        tuple(replace(arm, read=arm.read.model_copy(update={"name": names[arm.read.id]})) for arm in arms),
        tuple(curve.model_copy(update={"name": names[curve.experiment]}) for curve in drawn),
    )


def _names(arms: Sequence[Arm]) -> dict[str, str]:
    """Return the name of each experiment by id: its strategy's, as in the paper, unless several share it."""
    times = Counter(arm.strategy for arm in arms)
    return {arm.read.id: arm.strategy if times[arm.strategy] == 1 else arm.read.name for arm in arms}


def _part(store: Store, archive: Path) -> tuple[str, tuple[ExperimentRead, ...]]:
    """Import an archive, and return its name and its experiments."""
    made = import_file(store, archive)
    if made.study is not None:
        study = reading.read_study(store, made.study)
        return study.name, study.experiments
    reads = tuple(reading.read_experiment(store, id_) for id_ in made.experiments)
    return reads[0].name, reads


def _settings(spec: ResolvedSpec) -> str:
    """Return the settings that experiments of one study share."""
    world = {"robot", "controller", "task", "engine", "tunables", "reality", "seed"}
    return spec.model_dump_json(include=world | {"budget", "tuner", "discrepancy", "optimizer", "controller_optimizer"})


def _arms(session: Session, reads: Sequence[ExperimentRead]) -> tuple[Arm, ...]:
    ids = [read.id for read in reads]
    work, (rows, recorded) = work_of(session, ids), recorded_of(session, ids)
    spans = {row.id: _spans(session, row.id, row.spec["repetitions"]) for row in rows}
    return tuple(
        Arm(
            read=read,
            spec=spec_of(experiments.get_experiment(session, read.id).spec),
            recorded=recorded[read.id],
            transferred=_measured(session, read.id, MeasurementKind.PROBE, recorded[read.id].shape),
            seconds=work[read.id].seconds,
            attempts=len(spans[read.id]),
            held_s=sum((end - start).total_seconds() for start, end in spans[read.id]),
        )
        for read in reads
    )


def _measured(session: Session, experiment: str, kind: MeasurementKind, shape: tuple[int, ...]) -> FloatArray:
    """Return measured fitness by repetition and iteration; nan if it failed or is missing."""
    row, values = MeasurementRow, np.full(shape, np.nan)
    query = of_experiments(row, [experiment], RepetitionRow.number, row.iteration, row.fitness)
    for repetition, iteration, fitness in session.execute(query.where(row.kind == kind, row.fitness.is_not(None))):
        values[repetition, iteration] = fitness
    return values


def _spans(session: Session, experiment: str, repetitions: int) -> list[tuple[datetime, datetime]]:
    """Return begin and end of every attempt that has ended."""
    return [
        (each.started_at, each.ended_at)
        for number in range(repetitions)
        for each in attempts.attempts_of(session, experiment, number)
        if each.ended_at is not None
    ]
