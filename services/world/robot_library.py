"""The texts of the robot files and pools that this process knows, by their hash.

A hash says all about a file, so it does not matter where it comes from. Whoever reads a spec adds the files that it
names first: a store those of the experiments that it loads; workers, which have no store, are sent them.
"""

from collections import OrderedDict
from collections.abc import Callable, Iterable, Mapping
from functools import lru_cache
from hashlib import sha256
from types import MappingProxyType
from typing import Any

from gaplab.schemas.plugin import PluginRef
from gaplab.schemas.robots import FileKind
from gaplab.services.core.errors import InvalidSpec, Violation
from gaplab.services.world.pools import EXAMPLE, Pool
from gaplab.services.world.robot_files import NamedFile, RobotFile

IMPORTED = "robot_file"
"""Name of the plug-in of all robots from files."""

RECORDED = "recorded"
"""Name of the controller and the task of all pools."""

MOST_KNOWN = 1_000
"""Most files that a process remembers: more than the experiments of a page have."""

FILES: Mapping[FileKind, type[NamedFile]] = MappingProxyType({each.kind: each for each in (RobotFile, Pool)})
"""What reads each kind of file."""

_known: OrderedDict[str, str] = OrderedDict()
_read: Mapping[type, Callable[[str], Any]] = {
    each: lru_cache(maxsize=each.kept)(each.stored) for each in FILES.values()
}


def learn(texts: Iterable[str]) -> None:
    """Remember the canonical texts of robot files and pools, which were checked."""
    for text in texts:
        _known[sha256(text.encode()).hexdigest()] = text
        while len(_known) > MOST_KNOWN:
            _known.popitem(last=False)


def named_in(spec: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the hashes of the files that a stored spec, or a part of it, names: its robot's and its pool's.

    A spec from an archive may be anything.
    """
    refs = ((spec.get("robot"), IMPORTED), (spec.get("controller"), RECORDED)) if isinstance(spec, Mapping) else ()
    named = (ref.get("options") for ref, name in refs if isinstance(ref, Mapping) and ref.get("name") == name)
    return tuple(str(options.get("sha256")) for options in named if isinstance(options, Mapping))


def unknown(specs: Iterable[Mapping[str, Any]]) -> set[str]:
    """Return the hashes of files of specs that this process does not know; the others it remembers longer."""
    hashes = {each for spec in specs for each in named_in(spec)}
    for known in hashes & _known.keys():
        _known.move_to_end(known)
    return hashes - _known.keys()


def robot_file(sha256: str) -> RobotFile | None:
    """Return the robot file with this hash; None if this process does not know it."""
    return _read[RobotFile](_known[sha256]) if sha256 in _known else None


def pool(sha256: str, name: str) -> Pool:
    """Return the pool with this hash; without a hash, an example.

    Raises:
        InvalidSpec: this process does not know it; the name is for people.
    """
    if not sha256:
        return EXAMPLE
    if sha256 not in _known:
        message = f"the pool {name!r} with the hash {sha256!r} is not stored here; add its file: gaplab pool add"
        raise InvalidSpec([Violation("/reality/pool", sha256, message, "a pool that is stored")])
    found: Pool = _read[Pool](_known[sha256])
    return found


def needed_by(spec: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the texts of files that another process needs for a spec; one that is unknown is left out."""
    return tuple(_known[each] for each in named_in(spec) if each in _known)


def label_of(robot: PluginRef) -> str:
    """Return the name that people know a robot by."""
    return str(robot.options.get("name") or robot.name) if robot.name == IMPORTED else robot.name
