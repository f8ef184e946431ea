"""External plug-ins that cannot be used: their names in the catalogue, and why."""

import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from traceback import extract_tb

KINDS = ("strategy", "robot", "controller", "task", "engine", "tunable", "optimizer", "discrepancy", "tuner")

LONGEST = 300
"""Longest message of a plug-in's own error that is quoted, in characters."""

REMEDY = "repair the file, which is then imported again"

_CLASS = re.compile(r"^class[ \t]+([A-Za-z]\w*)[ \t]*\(?([^)\n]*)", re.MULTILINE)
_NAME = re.compile(r"^[ \t]+name[ \t]*(?::[^=\n]*)?=[ \t]*[\"']([^\"'\n]{1,100})[\"']", re.MULTILINE)


@dataclass(frozen=True)
class Unusable:
    """A plug-in that specs cannot use.

    Attributes:
        file: the file relative to its folder.
        name: the name that specs would call it.
        kind: one of `KINDS`; None if the file does not tell.
        why: one sentence with the remedy.
    """

    file: str
    name: str
    kind: str | None
    why: str


def from_file(path: Path, file: str, why: str) -> list[Unusable]:
    """Return the plug-ins of a file that was not imported, as far as its text names them.

    A text without a readable class is listed under the name of the file, as a plug-in of every kind.

    Args:
        path: the file.
        file: the same, relative to its folder.
        why: one sentence without the remedy.
    """
    try:
        text = path.read_text(errors="replace")
    except OSError:
        text = ""
    named = list(_named(text)) or [(None, None)]
    return [
        Unusable(file, name or Path(file.removesuffix("/__init__.py")).stem, kind, remedied(why))
        for name, kind in named
    ]


def remedied(why: str) -> str:
    """Return the sentence with what to do."""
    return f"{why}; {REMEDY}"


def quoted(error: BaseException, folders: Iterable[Path]) -> str:
    """Return type and message of a plug-in's error in one line of limited length, with its place in the folders."""
    message = error.msg if isinstance(error, SyntaxError) else _message(error)
    line = " ".join(f"{type(error).__name__}: {message}".split())
    line = line if len(line) <= LONGEST else f"{line[: LONGEST - 1]}…"
    place = _place(error, folders)
    return f"{line} ({place})" if place else line


def _message(error: BaseException) -> str:
    try:
        return str(error)
    except Exception:  # noqa: BLE001 - an error of a plug-in may itself be broken
        return "its message cannot be read"


def _place(error: BaseException, folders: Iterable[Path]) -> str | None:
    """Return file and line of the last frame that is in a plug-in folder."""
    frames = [(frame.filename, frame.lineno) for frame in extract_tb(error.__traceback__)]
    if isinstance(error, SyntaxError) and error.filename is not None:
        frames.append((error.filename, error.lineno))
    for filename, line in reversed(frames):
        for folder in folders:
            if Path(filename).is_relative_to(folder):
                return f"{Path(filename).relative_to(folder).as_posix()}, line {line}"
    return None


def _named(text: str) -> Iterable[tuple[str | None, str | None]]:
    """Yield name and kind of each class that seems to be a plug-in; None for what the text does not tell."""
    classes = list(_CLASS.finditer(text))
    for place, match in enumerate(classes):
        end = classes[place + 1].start() if place + 1 < len(classes) else len(text)
        name = _NAME.search(text, match.end(), end)
        kind = next((kind for kind in KINDS if kind in match[2].lower()), None)
        if name or kind:
            yield name and name[1], kind
