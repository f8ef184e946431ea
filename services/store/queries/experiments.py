"""Inserts, look-ups and locks of experiments and studies."""

from collections.abc import Sequence
from dataclasses import dataclass
from secrets import choice
from typing import Literal, TypeVar

from sqlalchemy import event, insert, select
from sqlalchemy.orm import Session

from gaplab.schemas.events import EventKind
from gaplab.schemas.lifecycle import OPEN, State
from gaplab.schemas.resolved import SPEC_VERSION, ResolvedSpec
from gaplab.schemas.spec import Schedule
from gaplab.services.core.errors import NotFound, StoreUnavailable
from gaplab.services.store.clock import moment
from gaplab.services.store.models import DeletionRow, ExperimentRow, RepetitionRow, StudyRow
from gaplab.services.store.queries.events import note
from gaplab.services.store.statements import storable

R = TypeVar("R", ExperimentRow, StudyRow)

Noun = Literal["experiment", "study"]

_LETTERS = "abcdefghjkmnpqrstuvwxyz23456789"


@dataclass(frozen=True)
class Extent:
    """The size of one repetition.

    Attributes:
        iterations: number of iterations, number 0 included.
        rollouts: expected number of rollouts.
    """

    iterations: int
    rollouts: int


def new_id() -> str:
    """Return a short random name, without letters that look alike.

    There are 31¹⁰ ≈ 8e14 names. With a million in use, the next one is taken with a probability of 1e-9. The
    database then raises an IntegrityError, and rolls the transaction back.
    """
    return "".join(choice(_LETTERS) for _ in range(10))


def insert_study(session: Session, name: str) -> StudyRow:
    """Add a study without experiments."""
    study = StudyRow(id=new_id(), name=storable(name), created_at=moment(session))
    session.add(study)
    session.flush()
    return study


def insert_experiment(
    session: Session,
    spec: ResolvedSpec,
    extent: Extent,
    *,
    study: StudyRow | None = None,
    position: int = 0,
    token: str | None = None,
) -> ExperimentRow:
    """Add an experiment with its repetitions, all QUEUED; `token` is the id of the token that submitted it."""
    experiment = ExperimentRow(
        id=new_id(),
        study_id=study.id if study else None,
        position=position,
        name=storable(spec.name),
        strategy=spec.strategy.name,
        spec=spec.model_dump(mode="json", exclude=set(Schedule.model_fields)),
        iterations=extent.iterations,
        rollouts=extent.rollouts,
        precedence=-spec.priority,
        max_parallel=spec.max_parallel,
        token_id=token,
        created_at=study.created_at if study else moment(session),
    )
    session.add(experiment)
    session.flush()
    insert_repetitions(session, experiment.id, range(spec.repetitions))
    note(session, EventKind.SUBMITTED, experiment.id, name=experiment.name, repetitions=spec.repetitions)
    return experiment


def insert_repetitions(session: Session, experiment_id: str, numbers: range) -> None:
    """Add QUEUED repetitions with these numbers."""
    rows = [{"experiment_id": experiment_id, "number": each} for each in numbers]
    if rows:
        session.execute(insert(RepetitionRow), rows)


def get_experiment(session: Session, experiment_id: str) -> ExperimentRow:
    """Return the experiment with this id.

    Raises:
        NotFound: there is none.
    """
    return _get(session, ExperimentRow, "experiment", experiment_id)


def get_experiments(session: Session, ids: Sequence[str]) -> tuple[ExperimentRow, ...]:
    """Return the experiments with these ids, in the order of the ids.

    Raises:
        NotFound: an experiment does not exist.
    """
    named = ExperimentRow.id.in_([storable(each) for each in ids])
    found = {row.id: row for row in session.scalars(select(ExperimentRow).where(named))}
    if missing := [each for each in ids if each not in found]:
        raise NotFound(
            _of_another_kind(session, missing[0]) or f"there is no experiment {', '.join(map(repr, missing))}"
        )
    return tuple(found[each] for each in ids)


def get_study(session: Session, study_id: str) -> StudyRow:
    """Return the study with this id.

    Raises:
        NotFound: there is none.
    """
    return _get(session, StudyRow, "study", study_id)


def get(session: Session, noun: Noun, id_: str) -> ExperimentRow | StudyRow:
    """Return the experiment or the study with this id.

    Raises:
        NotFound: there is none.
    """
    return get_study(session, id_) if noun == "study" else get_experiment(session, id_)


def was_deleted(session: Session, id_: str) -> bool:
    """Return whether a study or an experiment with this id was deleted."""
    return session.get(DeletionRow, storable(id_)) is not None


def experiments_of(session: Session, studies: Sequence[str]) -> tuple[ExperimentRow, ...]:
    """Return the experiments of these studies, by study and position."""
    row = ExperimentRow
    return tuple(session.scalars(select(row).where(row.study_id.in_(studies)).order_by(row.study_id, row.position)))


def open_studies(session: Session, studies: Sequence[str]) -> frozenset[str]:
    """Return the ids of the studies in which an experiment has not ended."""
    row = ExperimentRow
    found = session.scalars(select(row.study_id).where(row.study_id.in_(studies), row.state.in_(OPEN)).distinct())
    return frozenset(each for each in found if each is not None)


def repetitions_of(session: Session, experiment_id: str) -> tuple[RepetitionRow, ...]:
    """Return the repetitions of an experiment, by number."""
    row = RepetitionRow
    return tuple(session.scalars(select(row).where(row.experiment_id == experiment_id).order_by(row.number)))


def with_failures(session: Session, experiments: Sequence[str]) -> frozenset[str]:
    """Return the ids of the experiments of which a repetition FAILED."""
    row = RepetitionRow
    failed = select(row.experiment_id).where(row.experiment_id.in_(experiments), row.state == State.FAILED)
    return frozenset(session.scalars(failed.distinct()))


def lock(session: Session, experiments: Sequence[str]) -> dict[str, State]:
    """Lock experiments until the transaction ends, and return their states.

    A transaction that moves repetitions between states locks their experiments first, in the order of ids.
    """
    row = ExperimentRow
    locked = select(row.id, row.state).where(row.id.in_(experiments)).order_by(row.id).with_for_update()
    return dict(session.execute(locked).all())


def _get(session: Session, table: type[R], noun: str, id_: str) -> R:
    if (found := session.get(table, storable(id_))) is not None:
        return found
    if deletion := session.get(DeletionRow, storable(id_)):
        raise NotFound(f"{deletion.name!r} ({id_}) was deleted at {deletion.deleted_at:%Y-%m-%d %H:%M} UTC")
    raise NotFound(_of_another_kind(session, id_) or f"there is no {noun} {id_!r}")


def _of_another_kind(session: Session, id_: str) -> str | None:
    """Return that an id is of a study and not of an experiment, or the reverse; None if it is of neither."""
    if session.get(StudyRow, storable(id_)) is not None:
        names = [f"{row.id} ({row.name})" for row in experiments_of(session, [id_])]
        return f"{id_!r} is a study, and this needs an experiment: {', '.join(names) or 'it has none'}"
    if session.get(ExperimentRow, storable(id_)) is not None:
        return f"{id_!r} is an experiment, and this needs a study"
    return None


@event.listens_for(ExperimentRow, "load")
def _refuse_newer(row: ExperimentRow, _: object) -> None:
    """Refuse a spec of a later version, whose fields may have another meaning."""
    if row.spec_version > SPEC_VERSION:
        msg = f"the spec of experiment {row.id!r} is of version {row.spec_version}, and this gaplab reads up to "
        msg += f"{SPEC_VERSION}: use a later gaplab with this database"
        raise StoreUnavailable(msg)
