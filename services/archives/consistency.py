"""Checks that the rows of an archive belong together, and that this installation can show its experiments."""

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from typing import TypeAlias

from pydantic import ValidationError

from gaplab.schemas.editing import Edit
from gaplab.schemas.provenance import Provenance
from gaplab.schemas.resolved import SPEC_VERSION, ResolvedSpec
from gaplab.schemas.spec import Schedule
from gaplab.services.archives.columns import REPETITION, Row
from gaplab.services.archives.resting import owner_of
from gaplab.services.core.errors import InvalidArchive, InvalidSpec, Violation
from gaplab.services.core.strategies import strategies
from gaplab.services.specs.measured import genome_violations, readings_violations
from gaplab.services.specs.resolution import takes_samples
from gaplab.services.specs.robots import robot_of
from gaplab.services.specs.stored_specs import spec_of
from gaplab.services.store.queries import attachments, attempts, logs
from gaplab.services.store.queries.experiments import members, repetitions_of
from gaplab.services.store.session import Session
from gaplab.services.store.texts import pack_tags, unpack_tags
from gaplab.services.world import robot_library
from gaplab.services.world.robot_files import read_robot_file
from gaplab.services.world.robot_library import IMPORTED, label_of
from gaplab.services.world.robots import robots
from gaplab.services.world.robots.base import Robot
from gaplab.services.world.tunables import tunables
from gaplab.services.world.tunables.labels import plain_name

MOST_EXPERIMENTS = 1_000

Rows: TypeAlias = Callable[[str], Iterator[Row]]
"""Yields the checked rows of a table."""


def checked_experiments(rows: Rows, study: str) -> dict[str, Row]:
    """Return the rows of the experiments by their ids, with checked specs, and the robot of a bench.

    Raises:
        InvalidArchive: a spec is invalid, or an experiment belongs to another study.
    """
    experiments = dict[str, Row]()
    robots_within = _learn_robots(rows)
    for row in rows("experiment"):
        if row["study_id"] != study:
            raise InvalidArchive(f"the experiment {row['id']!r} belongs to another study than {study!r}")
        spec = _checked_spec(row, robots_within)
        experiments[row["id"]] = row | {"spec": spec, "robot": _on_a_bench(row["id"], spec)}
    if study in experiments and len(experiments) > 1:
        raise InvalidArchive(f"one of several experiments has the id {study!r}, which is that of the study")
    return experiments


def _learn_robots(rows: Rows) -> set[str]:
    """Make the robot files of an archive known to this process, and return their hashes."""
    found = set[str]()
    for row in rows("robot"):
        try:
            file = read_robot_file(row["text"])
        except InvalidSpec as error:
            raise InvalidArchive(f"the robot {row['name']!r} is invalid: {error}"[:300]) from error
        if (file.sha256, file.name, file.text) != (row["sha256"], row["name"], row["text"]):
            raise InvalidArchive(f"the robot {row['name']!r} has another hash or name than its file")
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
    if table in {"study", "robot", "attachment"}:
        return
    if table == "provenance":
        _check_provenance(row)
        return
    owner = experiments.get(owner_of(table, row))
    number = row.get(REPETITION, row["number"] if table == "repetition" else 0)
    if (
        owner is None
        or number >= owner["spec"]["repetitions"]
        or row.get("iteration", 0) >= owner["iterations"]
        or any(len(each["parameters"]) != len(owner["spec"]["tunables"]) for each in _simulators(table, row))
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
    genome = row["body"].get("genome") if table == "step" else row.get("genome")
    if genome is not None:
        yield from genome_violations(genome, robot.label, robot.space)
    if table == "answer":
        if row["readings"] is not None:
            yield from readings_violations(row["readings"], row["values"] and len(row["values"]), robot.sensors)
        if {each["attachment"] for each in row["traces"] or ()} - {*(row["attachments"] or ())}:
            yield Violation("/traces", None, "each trace must be among the attachments of its answer")


def _simulators(table: str, row: Row) -> Sequence[Row]:
    return row["body"].get("simulators") or () if table == "step" else ()


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


def _check_provenance(row: Row) -> None:
    if attempts.provenance_id(Provenance.model_validate(row["facts"])) != row["id"]:
        raise InvalidArchive(f"the facts of provenance {row['id']!r} belong to another id")


def _checked_spec(row: Row, robots_within: Collection[str]) -> Row:
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
    if spec.robot.name == IMPORTED and spec.robot.options.get("sha256") not in robots_within:
        raise InvalidArchive(f"{place} names the robot {label_of(spec.robot)!r}, whose file is not in the archive")
    if wrong or len(set(names)) < len(names) or spec.strategy.name != row["strategy"]:
        msg = f"{place} is not resolved, or names plug-ins that are not installed here: {', '.join(wrong)[:200]}"
        raise InvalidArchive(msg)
    if row["iterations"] not in _iterations(spec):
        msg = f"{place} does not fit its experiment, whose repetitions have {row['iterations']:,} iterations"
        raise InvalidArchive(msg)
    stored = spec.model_dump(mode="json", exclude=set(Schedule.model_fields))
    return stored | {"reality": stored["reality"] | {"parameters": truth | stored["reality"]["parameters"]}}


def _iterations(spec: ResolvedSpec) -> set[int]:
    """Return the permitted iterations of a repetition: both numbers for a strategy that is not installed here."""
    several = spec.iterations + 1
    if spec.strategy.name in strategies:
        return {several if takes_samples(spec) else 1}
    return {1, several}


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
