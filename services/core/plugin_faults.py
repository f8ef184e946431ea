"""External plug-ins that cannot be used: their names in the catalogue, and why; and what is wrong with options."""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from inspect import signature
from pathlib import Path
from traceback import extract_tb
from typing import Any

from pydantic import BaseModel, ValidationError

from gaplab.schemas.base import Frozen
from gaplab.schemas.mistakes import permitted_by, pointer_to, sentence
from gaplab.schemas.plugin import LONGEST_NAME
from gaplab.services.core.errors import Violation, unknown_name

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
    named = list(_classes_in(text)) or [(None, None)]
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


def _classes_in(text: str) -> Iterable[tuple[str | None, str | None]]:
    """Yield name and kind of each class that seems to be a plug-in; None for what the text does not tell."""
    classes = list(_CLASS.finditer(text))
    for place, match in enumerate(classes):
        end = classes[place + 1].start() if place + 1 < len(classes) else len(text)
        name = _NAME.search(text, match.end(), end)
        kind = next((kind for kind in KINDS if kind in match[2].lower()), None)
        if name or kind:
            yield name and name[1], kind


SETS_OF_OPTIONS = ("published", "lean")
"""Attributes of a plug-in with values for some of its options."""


def fault_of(plugin: type[Any], kind: str, folders: Iterable[Path]) -> str | None:
    """Return why specs cannot use a class, as the rest of a sentence that begins with its name; None if they can.

    A class other than an engine is created with its default options; an engine may belong to hardware.

    Args:
        plugin: the class.
        kind: its kind, one of `KINDS`.
        folders: the plug-in folders; the place of an error in them is named.
    """
    members = ((name, getattr(plugin, name, None)) for name in dir(plugin))
    if missing := [name for name, member in members if getattr(member, "__isabstractmethod__", False)]:
        return f"does not define {', '.join(missing)}"
    doing = "described"
    try:
        if fault := _fault_of_name(plugin, kind) or _fault_of_options(plugin) or _fault_of_creation(plugin):
            return fault
        doing = "created with its default options"
        _create(plugin, kind)
        doing = "described"
        plugin.describe().model_dump_json()
    except (Exception, SystemExit) as error:  # noqa: BLE001 - a plug-in may raise anything
        return f"cannot be {doing}: {quoted(error, folders)}"
    return None


def _fault_of_name(plugin: type[Any], kind: str) -> str | None:
    name = getattr(plugin, "name", None)
    if not isinstance(name, str) or not name:
        return "has no name for specs to use: add name = '…'"
    if len(name) > LONGEST_NAME:
        return f"has a name of {len(name)} characters, but specs permit at most {LONGEST_NAME}: shorten it"
    if kind == "tunable" and (name != name.strip() or set("()") & set(name)):
        return f"has the name {name!r}, but parentheses and outer spaces in a spec are not part of a name: rename it"
    return None


def _fault_of_options(plugin: type[Any]) -> str | None:
    """Return that the defaults, completed as a spec stores them, are refused, alone or with a set of options."""
    options = plugin.Options
    if not isinstance(options, type) or not issubclass(options, Frozen):
        return "has Options that accept misspelt names: derive them from gaplab.plugins.Frozen"
    defaults = options().model_dump(mode="json", by_alias=True, warnings=False)
    sets = {f"options of `{name}`": getattr(plugin, name, {}) for name in SETS_OF_OPTIONS}
    for what, changes in {"defaults": {}, **sets}.items():
        try:
            options.model_validate({**defaults, **changes})
        except ValidationError as error:
            why = option_violation(plugin.name, options, dict(error.errors()[0])).message
            return f"refuses its own {what}: {why}"
    return None


def _fault_of_creation(plugin: type[Any]) -> str | None:
    try:
        signature(plugin).bind(plugin.Options())
    except TypeError:
        return "takes no options: write `def __init__(self, options=None)`, and pass them to super().__init__"
    return None


def _create(plugin: type[Any], kind: str) -> None:
    """Create the plug-in as its contract permits: a robot may need options, and has an example."""
    if kind == "robot":
        plugin.example()
    elif kind != "engine":
        plugin(plugin.Options())


def given_names(options: type[BaseModel]) -> list[str]:
    """Return the names of the options, as specs have them."""
    return [field.alias or name for name, field in options.model_fields.items()]


def option_violation(name: str, options: type[BaseModel], error: Mapping[str, Any], pointer: str = "") -> Violation:
    """Return the violation of an option that the model of a plug-in's options refuses.

    The error is an item of `ValidationError.errors()`; the pointer is the place of the options in the spec.
    """
    place = pointer_to(error["loc"])
    if error["type"] == "extra_forbidden":
        kind = f"option of {name!r}"
        return unknown_name(pointer + place, kind, str(error["loc"][-1]), given_names(options) or ["none"])
    return Violation(pointer + place, error["input"], sentence(error), permitted_by(error))
