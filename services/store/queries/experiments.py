"""Inserts, look-ups and locks of experiments and studies."""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from secrets import choice
from typing import Any

from sqlalchemy import ColumnElement, Select, event, insert, literal_column, or_, select
from sqlalchemy.orm import QueryContext, Session

from gaplab.schemas.events import EventKind
from gaplab.schemas.lifecycle import OPEN, State
from gaplab.schemas.records import MeasurementKind
from gaplab.schemas.resolved import SPEC_VERSION, ResolvedSpec
from gaplab.schemas.spec import Schedule
from gaplab.services.core.errors import Conflict, NotFound
from gaplab.services.store.clock import moment
from gaplab.services.store.database_errors import StoreUnavailable
from gaplab.services.store.models import (
    LOG,
    AnswerRow,
    AttemptRow,
    CheckpointRow,
    DeletionRow,
    ExperimentRow,
    RepetitionRow,
    RequestRow,
    StepKind,
    StepRow,
    StudyRow,
)
from gaplab.services.store.queries import files
from gaplab.services.store.queries.events import note
from gaplab.services.store.statements import storable

_LETTERS = "abcdefghjkmnpqrstuvwxyz23456789"


@dataclass(frozen=True)
class Extent:
    """The size of one repetition: iterations with number 0, expected rollouts, and the hardware that it needs."""

    iterations: int
    rollouts: int
    hardware: str | None = None


@dataclass(frozen=True)
class Members:
    """The experiments that an id names: all of a study, or one of them alone.

    Attributes:
        study: their study.
        experiments: in the order of the study.
        one: the experiment that alone is meant; None if these are all of the study.
    """

    study: StudyRow
    experiments: tuple[ExperimentRow, ...]
    one: ExperimentRow | None = None

    @property
    def named(self) -> StudyRow | ExperimentRow:
        """The study, or the one experiment: it has the id and the name."""
        return self.one or self.study

    @property
    def ids(self) -> list[str]:
        """The ids of the experiments."""
        return [each.id for each in self.experiments]

    def __str__(self) -> str:
        return f"{'study' if self.one is None else 'experiment'} {self.named.id!r}"


def new_id() -> str:
    """Return a short random name, without letters that look alike.

    There are 31¹⁰ ≈ 8e14 names. With a million in use, the next one is taken with a probability of 1e-9. The
    database then raises an IntegrityError, and rolls the transaction back.
    """
    return "".join(choice(_LETTERS) for _ in range(10))


def insert_study(
    session: Session,
    name: str,
    specs: Sequence[tuple[ResolvedSpec, Extent]],
    token: str | None = None,
    submitted: dict[str, Any] | None = None,
) -> Members:
    """Add a study with its experiments, whose repetitions are all QUEUED; one alone has the id of its study.

    `token` is the id of the token that submitted it, and `submitted` the spec as it is kept.
    """
    study = StudyRow(id=new_id(), name=storable(name), submitted=submitted, created_at=moment(session))
    session.add(study)
    session.flush()
    rows = [
        ExperimentRow(
            id=study.id if len(specs) == 1 else new_id(),
            study_id=study.id,
            position=position,
            name=storable(spec.name),
            strategy=spec.strategy.name,
            spec=spec.model_dump(mode="json", exclude=set(Schedule.model_fields)),
            iterations=extent.iterations,
            rollouts=extent.rollouts,
            precedence=-spec.priority,
            max_parallel=spec.max_parallel,
            hardware=extent.hardware,
            token_id=token,
            created_at=study.created_at,
        )
        for position, (spec, extent) in enumerate(specs)
    ]
    session.add_all(rows)
    session.flush()
    for row, (spec, _) in zip(rows, specs, strict=True):
        insert_repetitions(session, row.id, range(spec.repetitions))
        note(session, EventKind.SUBMITTED, row.id, name=row.name, repetitions=spec.repetitions)
    return Members(study, tuple(rows))


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
    if (found := session.get(ExperimentRow, storable(experiment_id))) is not None:
        return found
    names = [f"{row.id} ({row.name})" for row in members(session, experiment_id).experiments]
    raise NotFound(f"{experiment_id!r} is a study, and this needs an experiment: {', '.join(names)}")


def members(session: Session, id_: str) -> Members:
    """Return the experiments that an id names: those of a study, or one of them; the only one stands for its study.

    Raises:
        NotFound: there is neither.
    """
    one, study = None, session.get(StudyRow, storable(id_))
    if study is None:
        if (one := session.get(ExperimentRow, storable(id_))) is None:
            raise NotFound(_missing(session, id_))
        study = session.get_one(StudyRow, one.study_id)
    (found,) = of_studies(session, [study])
    return found if one is None or len(found.experiments) == 1 else Members(study, (one,), one)


def of_studies(session: Session, studies: Sequence[StudyRow]) -> list[Members]:
    """Return studies with their experiments."""
    by_study: dict[str, list[ExperimentRow]] = defaultdict(list)
    for row in experiments_of(session, [study.id for study in studies]):
        by_study[row.study_id].append(row)
    return [Members(study, tuple(by_study[study.id])) for study in studies]


def whole(session: Session, id_: str) -> Members:
    """Return the experiments of a study, or of the only one of a study.

    Raises:
        NotFound: there is neither.
        Conflict: it is one of several.
    """
    found = members(session, id_)
    if found.one is not None:
        msg = f"{id_!r} is one experiment of the study {found.study.id!r} ({found.study.name})"
        raise Conflict(f"{msg}, and this request is about all of it: use the id of the study")
    return found


def meant(session: Session, ids: Sequence[str]) -> tuple[ExperimentRow, ...]:
    """Return the experiments that the ids of studies and experiments mean, in their order, each once.

    Raises:
        NotFound: there is nothing with one of the ids.
    """
    row, named = ExperimentRow, [storable(each) for each in ids]
    query = select(row).where(or_(row.id.in_(named), row.study_id.in_(named))).order_by(row.study_id, row.position)
    alone: dict[str, ExperimentRow] = {}
    together: dict[str, list[ExperimentRow]] = defaultdict(list)
    for each in session.scalars(query):
        alone[each.id] = each
        together[each.study_id].append(each)
    if missing := [each for each in named if each not in alone and each not in together]:
        raise NotFound(_missing(session, missing[0]))
    found = (together[each] if each in together else [alone[each]] for each in named)
    return tuple({each.id: each for some in found for each in some}.values())


def experiments_of(session: Session, studies: Sequence[str]) -> tuple[ExperimentRow, ...]:
    """Return the experiments of these studies, by study and position."""
    row = ExperimentRow
    return tuple(session.scalars(select(row).where(row.study_id.in_(studies)).order_by(row.study_id, row.position)))


def study_names(session: Session, rows: Sequence[ExperimentRow]) -> dict[str, str]:
    """Return the names of the studies of experiments, by their ids."""
    named = select(StudyRow.id, StudyRow.name).where(StudyRow.id.in_({row.study_id for row in rows}))
    return dict(session.execute(named).all())


def open_studies(session: Session, studies: Sequence[str]) -> frozenset[str]:
    """Return the ids of the studies in which an experiment has not ended."""
    row = ExperimentRow
    return frozenset(session.scalars(select(row.study_id).where(row.study_id.in_(studies), row.state.in_(OPEN))))


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


def _missing(session: Session, id_: str) -> str:
    if deletion := session.get(DeletionRow, storable(id_)):
        return f"{deletion.name!r} ({id_}) was deleted at {deletion.deleted_at:%Y-%m-%d %H:%M} UTC"
    return f"there is no study or experiment {id_!r}"


@event.listens_for(ExperimentRow, "load")
def _admit(row: ExperimentRow, context: QueryContext) -> None:
    """Refuse a spec of a later version, whose fields may have another meaning; know the robot of any other."""
    if row.spec_version > SPEC_VERSION:
        msg = f"the spec of experiment {row.id!r} is of version {row.spec_version}, and this gaplab reads up to "
        msg += f"{SPEC_VERSION}: use a later gaplab with this database"
        raise StoreUnavailable(msg)
    files.learn(context.session, [row.spec])


_OfRepetition = AnswerRow | AttemptRow | CheckpointRow | RequestRow | StepRow

MEASURED = {MeasurementKind.SAMPLE: StepKind.MEASURED, MeasurementKind.PROBE: StepKind.PROBED}
"""The kind of step that a measurement is."""


def of_experiments(row: type[_OfRepetition], experiments: Sequence[str], *columns: Any) -> Select[Any]:  # noqa: ANN401
    """Return a query for columns of a table, joined with the repetitions of these experiments."""
    joined = select(*columns).join(RepetitionRow, RepetitionRow.id == row.repetition_id)
    return joined.where(RepetitionRow.experiment_id.in_(experiments))


def in_log(row: type[StepRow], kind: StepKind) -> ColumnElement[bool]:
    """Return the condition that a step is in the log, and of a kind.

    Its values are part of the statement, so that databases know that the index of the curve serves it.
    """
    return (row.branch == literal_column(str(LOG))) & (row.kind == literal_column(f"'{kind.value}'"))


def steps_of(experiments: Sequence[str], kind: StepKind, *columns: Any) -> Select[Any]:  # noqa: ANN401
    """Return a query for columns of the steps of a kind in the logs of these experiments."""
    return of_experiments(StepRow, experiments, *columns).where(in_log(StepRow, kind))


def same_log(step: type[StepRow], other: type[StepRow], kind: StepKind) -> ColumnElement[bool]:
    """Return the condition that another step is of the same log, and of a kind."""
    return (other.repetition_id == step.repetition_id) & in_log(other, kind)


def best(tuned: type[StepRow]) -> ColumnElement[Any]:
    """Return the best simulator in the body of a tuned step, read without the others."""
    return tuned.body["simulators", 0]
