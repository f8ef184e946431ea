"""What an import says: what it lost or changed, and why it refuses a file."""

from collections.abc import Iterable, Sequence
from fnmatch import fnmatchcase

from gaplab.services.core.errors import InvalidRobot
from gaplab.services.core.robot_files import LONGEST_LINE

MOST_NAMES = 40
"""Most names in a line of what is lost."""


class Notes:
    """Lines about one import, in the order of its steps.

    Attributes:
        refused: what has no place in a World; the file cannot be imported.
    """

    def __init__(self) -> None:
        self._lost: dict[str, list[str]] = {}
        self.refused: list[str] = []

    @property
    def lost(self) -> list[str]:
        """Return what is lost or changed, a line each, with as many names as a robot file permits."""
        return [_fitting(line, names) for line, names in self._lost.items()]

    def lose(self, line: str, *names: str) -> None:
        """Note what is lost or changed, once.

        Args:
            line: sentence; `{}` in it becomes the names of all notes with the same line.
            names: names of the bodies, joints or others that it is about.
        """
        known = self._lost.setdefault(line, [])
        known += [name for name in names if name not in known]

    def refuse(self, line: str) -> None:
        """Note a reason to refuse the file."""
        self.refused.append(line)

    def refuse_unknown(self, patterns: Iterable[str], joints: Sequence[str]) -> None:
        """Note each pattern of locked joints that matches none."""
        for pattern in patterns:
            if not any(fnmatchcase(name, pattern) for name in joints):
                self.refuse(f"no joint is called like {pattern!r}, as --lock says; joints: {listed(joints, 30)}")

    def check(self) -> None:
        """Raise all reasons to refuse the file so far.

        Raises:
            InvalidRobot: there is one.
        """
        if self.refused:
            raise InvalidRobot(self.refused)


def _fitting(line: str, names: Sequence[str]) -> str:
    texts = [line.replace("{}", listed(names, most)) for most in range(MOST_NAMES, 0, -1)]
    shortest = texts[-1]
    return next((text for text in texts if len(text) <= LONGEST_LINE), f"{shortest[: LONGEST_LINE - 1]}…")


def listed(names: Iterable[str], most: int = 6) -> str:
    """Return names in a sentence: the first few, and the number of all others."""
    all_names = list(names)
    others = len(all_names) - most
    return ", ".join(all_names[:most]) + (f" and {others} more" if others > 0 else "")
