"""The rows of an archive, checked value by value before they are stored, and whether they belong together.

What this installation could not show is refused too.
"""

import json
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager
from datetime import UTC, datetime
from functools import cache
from typing import Annotated, Any, Literal, NoReturn, TypeAlias

from pydantic import AwareDatetime, BaseModel, ConfigDict, Field, ValidationError, create_model

from gaplab.schemas.base import Count, Priority
from gaplab.schemas.editing import Edit
from gaplab.schemas.measurements import MOST_VALUES, Safety, Table
from gaplab.schemas.mistakes import sentence
from gaplab.schemas.provenance import Provenance
from gaplab.schemas.resolved import SPEC_VERSION
from gaplab.schemas.spec import AnySpec, Schedule
from gaplab.schemas.traces import Hash, TraceRead
from gaplab.services.archives.columns import EXPERIMENT, REPETITION, Row, columns_of, owner_of
from gaplab.services.core.errors import InvalidArchive, InvalidSpec, Violation
from gaplab.services.core.strategies import strategies
from gaplab.services.nesting import refuse_too_deep
from gaplab.services.specs.measured import genome_violations, readings_violations
from gaplab.services.specs.resolution import takes_samples
from gaplab.services.specs.robots import robot_of
from gaplab.services.specs.stored_specs import spec_of
from gaplab.services.store.queries import attachments, attempts, logs
from gaplab.services.store.queries.archives import Unreadable
from gaplab.services.store.queries.experiments import members, repetitions_of
from gaplab.services.store.session import Session
from gaplab.services.store.tables import Column
from gaplab.services.store.texts import pack_tags, unpack_tags
from gaplab.services.world import robot_library
from gaplab.services.world.robot_library import label_of
from gaplab.services.world.robots import robots
from gaplab.services.world.robots.base import Robot
from gaplab.services.world.tunables import tunables
from gaplab.services.world.tunables.labels import plain_name

GREATEST, GREATEST_LARGE = 2**30, 2**48
"""Limits of whole numbers of 32 and 64 bits: far from overflow, since some continue to count or are added up."""

_ID = r"^[A-Za-z0-9]{1,64}$"
_IDS = {"id", "study_id", "experiment_id", EXPERIMENT}

_CHECKED = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)


class _Checked(BaseModel):
    model_config = _CHECKED


class _Simulator(_Checked):
    parameters: list[float]
    squared_error: float | None
    lower: list[float] = []
    upper: list[float] = []
    weight: float = 0.0
    held_out_error: float = 0.0
    fit: list[float | None] = []
    noise: list[float] = []


class _Body(_Checked):
    genome: list[float] = []
    told: bool = False
    members: list[list[float]] = []
    readings: list[float | None] = []
    repeats: list[float] = []
    simulators: list[_Simulator] = []


_AS_READ: dict[tuple[str, str], Any] = {
    ("study", "submitted"): AnySpec,
    ("experiment", "precedence"): Priority,
    ("experiment", "max_parallel"): Annotated[Count, Field(le=10_000)],
    ("provenance", "facts"): Provenance,
    ("request", "safety"): Safety,
    ("answer", "values"): Annotated[list[float], Field(min_length=1, max_length=MOST_VALUES)],
    ("answer", "readings"): tuple[Table, ...],
    ("answer", "attachments"): tuple[Hash, ...],
    ("answer", "traces"): tuple[TraceRead, ...],
    ("answer", "doubts"): tuple[str, ...],
    ("step", "body"): _Body,
}
"""What later reads a column, if the database permits more. `consistency` checks specs, which may lack parameters."""

_Moment = Annotated[AwareDatetime, Field(ge=datetime(1970, 1, 1, tzinfo=UTC), lt=datetime(9000, 1, 1, tzinfo=UTC))]


def checked(table: str, rows: Iterable[Row]) -> Iterator[Row]:
    """Yield the rows of a table, each as it was read.

    Raises:
        InvalidArchive: a row is invalid; the message names the first invalid row and column.
    """
    model, number, incoming = _model(table), 0, iter(rows)
    while True:
        number += 1
        place = f"{table}, row {number}"
        with readable(place):
            row = next(incoming, None)
        if row is None:
            return
        try:
            model.model_validate_json(_json(row, place))
        except ValidationError as error:
            first = error.errors(include_url=False, include_input=False)[0]
            _refuse(f"{place},", f"{'/'.join(map(str, first['loc']))[:100]}: {sentence(first)}")
        yield row


@contextmanager
def readable(place: str) -> Iterator[None]:
    """Name the place of a value that SQLAlchemy cannot read as its column's type.

    Raises:
        InvalidArchive: it has one.
    """
    try:
        yield
    except Unreadable as error:
        said = str(error).partition("\n")[0]
        raise InvalidArchive(f"{place} has a value that its column does not permit: {said}"[:300]) from error


def _json(row: Row, place: str) -> str:
    try:
        text = json.dumps(row, default=_plain, ensure_ascii=False, allow_nan=False)  # fails for nan and infinity
        text.encode()  # fails for half of a surrogate pair
        refuse_too_deep(row)
    except InvalidSpec as error:
        _refuse(f"{place},", str(error)[:300])
    except (ValueError, TypeError, RecursionError):
        _refuse(place, "has a number, a text or bytes that JSON has not")
    if "\\u0000" in text:
        _refuse(place, "has a NUL character")
    return text


def _plain(value: object) -> str:
    if isinstance(value, datetime):
        return value.astimezone(UTC).isoformat()
    raise TypeError(f"an archive cannot hold a {type(value).__name__}")


@cache
def _model(table: str) -> type[BaseModel]:
    """Return the pydantic model of a row: every column is required, others are not permitted."""
    fields: dict[str, Any] = {
        column.name: (type_ | None if column.nullable else type_, ...)
        for column in columns_of(table)
        if column.type is not bytes
        for type_ in [_AS_READ.get((table, column.name)) or _type(column)]
    }
    return create_model(table, __config__=_CHECKED, **fields)


def _type(column: Column) -> Any:  # noqa: ANN401 - a type, as pydantic takes it
    if column.choices:
        return Literal[column.choices]
    if column.type is int:
        return Annotated[int, Field(ge=0, le=GREATEST_LARGE if column.large else GREATEST)]
    if column.type is str:
        return Annotated[str, Field(max_length=column.longest, pattern=_ID if column.name in _IDS else None)]
    return _Moment if column.type is datetime else column.type


def _refuse(place: str, what: str) -> NoReturn:
    raise InvalidArchive(f"{place} {what}")


MOST_EXPERIMENTS = 1_000

Rows: TypeAlias = Callable[[str], Iterator[Row]]
"""Yields the checked rows of a table."""


def checked_experiments(rows: Rows, study: str) -> dict[str, Row]:
    """Return the rows of the experiments by their ids, with checked specs, and the robot of a bench.

    Raises:
        InvalidArchive: a spec is invalid, or an experiment belongs to another study.
    """
    experiments = dict[str, Row]()
    files_within = _learn_files(rows)
    for row in rows("experiment"):
        if row["study_id"] != study:
            raise InvalidArchive(f"the experiment {row['id']!r} belongs to another study than {study!r}")
        spec = _checked_spec(row, files_within)
        experiments[row["id"]] = row | {"spec": spec, "robot": _on_a_bench(row["id"], spec)}
    if study in experiments and len(experiments) > 1:
        raise InvalidArchive(f"one of several experiments has the id {study!r}, which is that of the study")
    return experiments


def _learn_files(rows: Rows) -> set[str]:
    """Make the robot files and pools of an archive known to this process, and return their hashes."""
    found = set[str]()
    for row in rows("file"):
        try:
            file = robot_library.FILES[row["kind"]].read(row["text"])
        except InvalidSpec as error:
            raise InvalidArchive(f"the {row['kind']} {row['name']!r} is invalid: {error}"[:300]) from error
        if (file.sha256, file.name, file.text) != (row["sha256"], row["name"], row["text"]):
            raise InvalidArchive(f"the {row['kind']} {row['name']!r} has another hash or name than its file")
        robot_library.learn([file.text])
        found.add(file.sha256)
    return found


def check_row(table: str, row: Row, experiments: Mapping[str, Row]) -> None:
    """Refuse a row that belongs to no experiment, or exceeds the size of its experiment.

    Raises:
        InvalidArchive: the message quotes the row.
    """
    if table == "study":
        _check_tags(row)
    if table in {"study", "file", "attachment"}:
        return
    if table == "provenance":
        if attempts.provenance_id(Provenance.model_validate(row["facts"])) != row["id"]:
            raise InvalidArchive(f"the facts of provenance {row['id']!r} belong to another id")
        return
    owner, simulators = experiments.get(owner_of(table, row)), row.get("body", {}).get("simulators", ())
    number = row.get(REPETITION, row["number"] if table == "repetition" else 0)
    if (
        owner is None
        or number >= owner["spec"]["repetitions"]
        or row.get("iteration", 0) >= owner["iterations"]
        or any(
            len(each["parameters"]) != len(owner["spec"]["tunables"])
            or len(each.get("noise", each["parameters"])) != len(each["parameters"])
            for each in simulators
        )
    ):
        raise InvalidArchive(f"a row of {table} does not fit its experiment: {str(row)[:200]}")
    if owner["robot"] is not None and (wrong := [*_moves_it_wrongly(table, row, owner["robot"])]):
        raise InvalidArchive(f"a row of {table} does not fit its robot: {str(row)[:200]}: {InvalidSpec(wrong)}"[:600])


def _on_a_bench(id_: str, spec: Row) -> Robot | None:
    """Return the robot of an experiment on a bench; None if its reality is simulated."""
    try:
        return robot_of(spec_of(spec)) if spec["reality"]["kind"] == "physical" else None
    except InvalidSpec as error:
        raise InvalidArchive(f"the robot of experiment {id_!r} cannot be used here: {error}"[:600]) from error


def _moves_it_wrongly(table: str, row: Row, robot: Robot) -> Iterator[Violation]:
    """Yield violations: a genome or readings that do not fit the robot, and traces that the answer does not have."""
    body = row["body"] if table == "step" else row
    for genome in filter(None, [body.get("genome"), *body.get("members", ())]):
        yield from genome_violations(genome, robot.label, robot.space)
    if table == "answer":
        if row["readings"] is not None:
            yield from readings_violations(row["readings"], row["values"] and len(row["values"]), robot.sensors)
        if {each["attachment"] for each in row["traces"] or ()} - {*(row["attachments"] or ())}:
            yield Violation("/traces", None, "each trace must be among the attachments of its answer")


def check_attachments(session: Session) -> None:
    """Refuse files that no answer names, and answers that name others; the session is of the archive.

    Raises:
        InvalidArchive: the message names the first of them.
    """
    if unpaired := sorted(attachments.all_ids(session) ^ attachments.named(session)):
        raise InvalidArchive(f"the attachment {unpaired[0]!r} is missing from the archive, or no answer names it")


def _check_tags(row: Row) -> None:
    try:
        tags = Edit(tags=unpack_tags(row["tags"])).tags or ()
    except ValidationError as error:
        raise InvalidArchive(f"the tags of study {row['id']!r} are invalid") from error
    if pack_tags(tags) != row["tags"]:
        raise InvalidArchive(f"the tags of study {row['id']!r} are not as this service stores them")


def _checked_spec(row: Row, files_within: Collection[str]) -> Row:
    """Return the spec to store; unknown parameters of reality are null."""
    place, given = f"the spec of experiment {row['id']!r}", row["spec"]
    if row["spec_version"] > SPEC_VERSION:
        raise InvalidArchive(f"{place} has version {row['spec_version']}; this gaplab reads up to {SPEC_VERSION}")
    try:
        spec = spec_of(given)
        truth = dict.fromkeys(given["reality"]["parameters"])
    except ValidationError as error:
        fields = sorted({"/".join(map(str, found["loc"])) for found in error.errors()})
        raise InvalidArchive(f"{place} is not resolved; missing or invalid: {', '.join(fields)[:200]}") from error
    except (KeyError, TypeError, AttributeError) as error:
        raise InvalidArchive(f"{place} is not a spec") from error
    names = [each.name for each in spec.tunables]
    wrong = [name for name in (*truth, *names) if plain_name(name) not in tunables]
    wrong += [] if spec.robot.name in robots else [spec.robot.name]
    if set(robot_library.named_in(given)) - {*files_within}:
        raise InvalidArchive(f"{place} names a robot {label_of(spec.robot)!r} or a pool that is not in the archive")
    if wrong or len(set(names)) < len(names) or spec.strategy.name != row["strategy"]:
        msg = f"{place} is not resolved, or names plug-ins that are not installed here: {', '.join(wrong)[:200]}"
        raise InvalidArchive(msg)
    permitted = {spec.iterations + 1 if takes_samples(spec) else 1}
    if row["iterations"] not in (permitted if spec.strategy.name in strategies else {*permitted, 1}):
        msg = f"{place} does not fit its experiment, whose repetitions have {row['iterations']:,} iterations"
        raise InvalidArchive(msg)
    stored = spec.model_dump(mode="json", exclude=set(Schedule.model_fields))
    return stored | {"reality": stored["reality"] | {"parameters": truth | stored["reality"]["parameters"]}}


def check_logs(session: Session, study: str, at_once: int) -> None:
    """Refuse experiments with missing repetitions, and repetitions whose rows contradict their counts.

    Raises:
        InvalidArchive: the message names the first of them.
    """
    if unknown := logs.unknown_branch(session):
        raise InvalidArchive(f"a step belongs to branch {unknown} of its repetition, which has no such branch")
    for experiment in members(session, study).experiments:
        rows, expected = repetitions_of(session, experiment.id), experiment.spec["repetitions"]
        if [row.number for row in rows] != list(range(expected)):
            raise InvalidArchive(f"experiment {experiment.id!r} has {len(rows)} of its {expected} repetitions")
        latest = attempts.latest(session, experiment.id)
        for row in rows:
            if not logs.is_whole(session, row.id, row.steps, at_once):
                msg = f"the rows of repetition {row.number} of {experiment.id!r} are not a log of {row.steps} steps"
                raise InvalidArchive(msg)
            if latest.get(row.id, 0) > row.epoch:
                raise InvalidArchive(f"repetition {row.number} of {experiment.id!r} has more attempts than leases")
