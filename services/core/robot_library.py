"""The robot files that this process knows, by their hash: those that it was sent, and those of its stores.

A hash says all about a robot, so it does not matter where its file comes from. Workers have no store; they are sent the
files of what they simulate.
"""

from collections import OrderedDict
from collections.abc import Iterable
from typing import Protocol
from weakref import WeakSet

from gaplab.schemas.plugin import PluginRef
from gaplab.services.core.robot_files import RobotFile, stored_robot_file

IMPORTED = "robot_file"
"""Name of the plug-in of all robots from files."""

MOST_KNOWN = 64
"""Most robot files that a process remembers."""


class Source(Protocol):
    """A place with robot files, like a store."""

    def robot_text(self, sha256: str) -> str | None:
        """Return the canonical text of a robot file; None if it is not there."""
        ...


_sources: WeakSet[Source] = WeakSet()
_known: OrderedDict[str, RobotFile] = OrderedDict()


def add_source(source: Source) -> None:
    """Look for robot files in this place too, as long as it exists."""
    _sources.add(source)


def learn(texts: Iterable[str]) -> None:
    """Remember robot files that a store or another process of gaplab had, and so checked.

    Raises:
        InvalidSpec: one is not a robot file.
    """
    for file in map(stored_robot_file, texts):
        _known[file.sha256] = file
        _known.move_to_end(file.sha256)
        while len(_known) > MOST_KNOWN:
            _known.popitem(last=False)


def robot_file(sha256: str) -> RobotFile | None:
    """Return the robot file with this hash; None if this process does not know it."""
    if sha256 not in _known:
        found = (source.robot_text(sha256) for source in list(_sources))
        learn([text for text in found if text is not None][:1])
    return _known.get(sha256)


def needed_by(robot: PluginRef) -> tuple[str, ...]:
    """Return the texts of robot files that another process needs to create a robot; one that is unknown is left out."""
    file = robot_file(str(robot.options.get("sha256"))) if robot.name == IMPORTED else None
    return () if file is None else (file.text,)


def label_of(robot: PluginRef) -> str:
    """Return the name that people know a robot by."""
    return str(robot.options.get("name") or robot.name) if robot.name == IMPORTED else robot.name
