"""Robot files and pools in the store: added once each, listed, and found by the names that specs give them."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any, Generic, TypeVar

from gaplab.schemas.plugin import PluginRead, PluginRef
from gaplab.schemas.robots import FileKind, FileRead, PoolRead, RobotRead
from gaplab.schemas.samples import SamplesRead
from gaplab.schemas.spec import PoolRef, SharedSettings
from gaplab.services.core.errors import InvalidSpec, NotFound, Violation, unknown_name
from gaplab.services.specs.defaults import default_engine
from gaplab.services.specs.robots import Driven, ref_of_file, robot_of, robot_of_file
from gaplab.services.specs.sample_tables import read_samples
from gaplab.services.store.models import FileRow
from gaplab.services.store.queries import files
from gaplab.services.store.session import Session, Store, snapshot
from gaplab.services.store.texts import storable
from gaplab.services.world.pools import Pool
from gaplab.services.world.robot_files import NamedFile, RobotFile
from gaplab.services.world.robot_library import IMPORTED
from gaplab.services.world.robots import robots

R = TypeVar("R")
S = TypeVar("S", bound=SharedSettings)
F = TypeVar("F", bound=NamedFile)
V = TypeVar("V", bound=FileRead)


class InvalidRobotFile(InvalidSpec):
    """A robot file that cannot be stored, with all its violations."""

    kind, title = "invalid-robot-file", "The robot file is invalid"


class InvalidPool(InvalidSpec):
    """A pool that cannot be stored, with all its violations."""

    kind, title = "invalid-pool", "The pool is invalid"


@dataclass(frozen=True)
class StoredFiles(Generic[F, V]):
    """The stored files of one kind.

    Attributes:
        file: the kind.
        view: what lists say of each.
        invalid: what is raised instead if one cannot be stored.
        check: what else than the file itself must be right; it raises InvalidSpec.
    """

    file: type[F]
    view: type[V]
    invalid: type[InvalidSpec]
    check: Callable[[F], object] = lambda _: None

    def add(self, store: Store, text: str | bytes) -> V:
        """Store a file, unless it is stored already, and return what it is; its name now means this file.

        Raises:
            InvalidRobotFile, InvalidPool: it is not a file of this kind, or cannot be used; with every violation.
        """
        try:
            file = self.file.read(text)
            self.check(file)
        except InvalidSpec as error:
            raise self.invalid(error.violations) from error
        return store.write(lambda session: self._view(files.put(session, file), file))

    def all(self, store: Store) -> tuple[V, ...]:
        """Return all files, by name, the newest of a name first."""
        with store.reading() as session:
            found = files.all_(session, self.file.kind)
            return tuple(self._view(row, self.file.stored(row.text)) for row in found)

    def _view(self, row: FileRow, file: F) -> V:
        return self.view.filled_from(row, lost=file.lost, **file.facts())


def _check_robot(file: RobotFile) -> None:
    """Refuse a robot whose name a plug-in has, or that its usual controller or task cannot drive and rate."""
    if file.name in robots:
        message = f"gaplab has a robot {file.name!r} already; choose another name"
        raise InvalidSpec([Violation("/name", file.name, message, "another name")])
    robot_of_file(file)


ROBOTS = StoredFiles(RobotFile, RobotRead, InvalidRobotFile, _check_robot)
POOLS = StoredFiles(Pool, PoolRead, InvalidPool)


@snapshot
def robot_text(session: Session, named: str) -> str:
    """Return the text of a robot file, named by its hash or its name.

    Raises:
        NotFound: there is no such robot.
    """
    row = files.named(session, FileKind.ROBOT, storable(named))
    if row is None:
        raise NotFound(
            f"there is no robot {named[:64]!r}; permitted: {', '.join(robots)}, and what `gaplab robot list` lists"
        )
    return row.text


def resolved_here(store: Store, spec: S, resolve: Callable[[S], R]) -> R:
    """Return what a spec resolves to, where the names of its robot and its pool may be those of stored files.

    Raises:
        InvalidSpec: with every violation; that of an unknown robot has the names of the stored ones too.
    """
    found: dict[str, Any] = {"robot": stored_ref(store, spec.robot)}
    if spec.reality.pool is not None:
        found["reality"] = spec.reality.model_copy(update={"pool": _stored_pool(store, spec.reality.pool)})
    with _naming_stored(store):
        return resolve(spec.model_copy(update=found))


@snapshot
def _stored_pool(session: Session, pool: PoolRef) -> PoolRef:
    """Return the hash of the stored pool that a name means.

    Raises:
        InvalidSpec: no such pool is stored.
    """
    row = files.named(session, FileKind.POOL, storable(pool.sha256 or pool.name))
    if row is None:
        raise InvalidSpec([unknown_name("/reality/pool", "pool", pool.name, files.names(session, FileKind.POOL))])
    return PoolRef(name=row.name, sha256=row.sha256)


@snapshot
def stored_ref(session: Session, robot: PluginRef) -> PluginRef:
    """Return the hash of the stored robot that a name means; unchanged if a plug-in has the name.

    Raises:
        InvalidSpec: the robot has options, which one from a file does not have, or no robot with its hash is stored;
            the process may know that, but forgets it when it ends.
    """
    name, sha256 = robot.name, str(robot.options.get("sha256", ""))
    if name == IMPORTED and session.get(FileRow, storable(sha256)) is None:
        message = f"no robot with the hash {sha256!r} is stored here; add its file: gaplab robot add"
        raise InvalidSpec([Violation("/robot/options/sha256", sha256, message, "the hash of a stored robot")])
    if name in robots or name in robots.unusable:
        return robot
    if (row := files.newest(session, FileKind.ROBOT, storable(name))) is None:
        return robot
    if robot.options:
        message = f"the robot {name} comes from a file, which has no options"
        raise InvalidSpec([Violation("/robot/options", robot.options, message, "left out")])
    return ref_of_file(row.sha256, row.name)


def check_samples(store: Store, text: str, driven: Driven) -> SamplesRead:
    """Return the samples of a CSV table, or everything that is wrong with it.

    Raises:
        InvalidSpec: the robot, its controller or its task does not exist, or refuses its options.
    """
    with _naming_stored(store):
        robot = robot_of(replace(driven, robot=stored_ref(store, driven.robot)))
    return read_samples(text, robot)


@contextmanager
def _naming_stored(store: Store) -> Iterator[None]:
    """Add the names of stored robots to the violation of a robot that is unknown."""
    try:
        yield
    except InvalidSpec as error:
        raise InvalidSpec(_with_stored_names(store, each) for each in error.violations) from error


def _with_stored_names(store: Store, violation: Violation) -> Violation:
    plugins = violation.permitted
    if violation.pointer != "/robot" or isinstance(plugins, str) or IMPORTED not in (plugins or ()):
        return violation
    names = {*robots, *snapshot(files.names)(store, FileKind.ROBOT)} - {IMPORTED}
    return unknown_name("/robot", "robot", str(violation.value), sorted(names))


def catalogued(found: Sequence[RobotRead]) -> tuple[PluginRead, ...]:
    """Return the catalogue's entries of stored robots: the newest of each name that no plug-in has."""
    newest = {each.name: each for each in reversed(found) if each.name not in robots}
    return tuple(_entry(each) for _, each in sorted(newest.items()))


def _entry(found: RobotRead) -> PluginRead:
    source = f"robot file {found.sha256[:12]}" + (f", imported from {found.file}" if found.file else "")
    summary = f"{found.bodies} bodies, {found.actuators} actuators, {found.mass_kg:.3g} kg."
    entry = PluginRead(name=found.name, summary=summary, source=source, options={}, details={"sha256": found.sha256})
    try:
        robot = robots.create(ref_of_file(found.sha256, found.name))
    except InvalidSpec as error:  # its usual controller or task is not installed here
        return entry.model_copy(update={"available": False, "note": str(error)})
    details = {**robots[IMPORTED].told(robot), "engine": default_engine(robot), **entry.details}
    return entry.model_copy(update={"details": details})
