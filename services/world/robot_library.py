"""The texts of the robot files that this process knows, by their hash.

A hash says all about a robot, so it does not matter where its file comes from. Whoever reads a spec adds the file that
it names first: a store those of the experiments that it loads; workers, which have no store, are sent them.
"""

from collections import OrderedDict
from collections.abc import Iterable
from functools import lru_cache
from hashlib import sha256

from gaplab.schemas.plugin import PluginRef
from gaplab.services.world.robot_files import RobotFile, stored_robot_file

IMPORTED = "robot_file"
"""Name of the plug-in of all robots from files."""

MOST_KNOWN = 1_000
"""Most robot files that a process remembers: more than the experiments of a page have."""

MOST_READ = 64
"""Most robot files whose worlds a process keeps."""

_known: OrderedDict[str, str] = OrderedDict()


def learn(texts: Iterable[str]) -> None:
    """Remember the canonical texts of robot files, which were checked."""
    for text in texts:
        _known[sha256(text.encode()).hexdigest()] = text
        while len(_known) > MOST_KNOWN:
            _known.popitem(last=False)


def unknown(robots: Iterable[PluginRef]) -> set[str]:
    """Return the hashes of those robots from files that this process does not know; the others it remembers longer."""
    hashes = {str(robot.options.get("sha256")) for robot in robots if robot.name == IMPORTED}
    for known in hashes & _known.keys():
        _known.move_to_end(known)
    return hashes - _known.keys()


def robot_file(sha256: str) -> RobotFile | None:
    """Return the robot file with this hash; None if this process does not know it."""
    return _read(_known[sha256]) if sha256 in _known else None


def needed_by(robot: PluginRef) -> tuple[str, ...]:
    """Return the texts of robot files that another process needs to create a robot; one that is unknown is left out."""
    text = _known.get(str(robot.options.get("sha256"))) if robot.name == IMPORTED else None
    return () if text is None else (text,)


def label_of(robot: PluginRef) -> str:
    """Return the name that people know a robot by."""
    return str(robot.options.get("name") or robot.name) if robot.name == IMPORTED else robot.name


@lru_cache(maxsize=MOST_READ)
def _read(text: str) -> RobotFile:
    return stored_robot_file(text)
