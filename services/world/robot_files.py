"""Robot files: a robot as JSON, without code: its world, where it comes from, and what drives and rates it by default.

The canonical text leaves out what has its default value, so that a field that the World gets later changes no hash.
"""

import json
from abc import abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import MISSING, fields, is_dataclass
from functools import cached_property
from hashlib import sha256
from typing import Annotated, Any, ClassVar, Self, TypeAlias

from pydantic import ConfigDict, Field, StringConstraints, ValidationError

from gaplab.schemas.base import Frozen
from gaplab.schemas.mistakes import permitted_by, pointer_to, sentence
from gaplab.schemas.plugin import PluginRef
from gaplab.schemas.robots import MOST_LOSSES, FileKind, RobotSource
from gaplab.services.core.errors import InvalidSpec, Violation
from gaplab.services.world.world import World
from gaplab.services.world.world_checks import MOST_BODIES, world_violations

LONGEST_NAME = 60
"""Most characters of a robot's name."""

MOST_BYTES = 2_000_000
"""Largest size of a robot file."""

LONGEST_LINE = 1_000
"""Most characters of a line of what an import lost, and of a comment."""

Lines: TypeAlias = Annotated[
    tuple[Annotated[str, Field(max_length=LONGEST_LINE)], ...], Field(max_length=MOST_LOSSES, fail_fast=True)
]

_SHAPES = "a shape: its kind is box, sphere, capsule, cylinder or hull"
_MESSAGES = {
    "extra_forbidden": ("{} is not a field here", "no such field"),
    "unexpected_keyword_argument": ("{} is not a field here", "no such field"),
    "union_tag_invalid": (f"{{}} must be {_SHAPES}", _SHAPES),
    "union_tag_not_found": (f"{{}} must be {_SHAPES}", _SHAPES),
}
"""Message and what is permitted, by pydantic's type of error, where its own words would not help."""

_UNWRITTEN = {"origin", "edits"}
"""Fields of a world that say how it was edited; a file has only what it is."""


class NamedFile(Frozen):
    """A file that specs name: JSON, which is stored once under the hash of its canonical text.

    Attributes:
        format_version: version of the format.
        name: a spec means the newest file of this name.
        lost: what its import lost or changed, line by line.
        kind: what it is.
        what: the same, for sentences.
        most_bytes: its largest size.
        kept: most files of its kind that a process keeps as they were read.
    """

    model_config = ConfigDict(strict=True)
    kind: ClassVar[FileKind]
    what: ClassVar[str]
    most_bytes: ClassVar[int] = MOST_BYTES
    kept: ClassVar[int] = 64

    format_version: Annotated[int, Field(ge=1, le=1)] = 1
    name: Annotated[str, StringConstraints(pattern=rf"^[a-z][a-z0-9_]{{0,{LONGEST_NAME - 1}}}$")]
    lost: Lines = ()

    def model_copy(self, *, update: Mapping[str, Any] | None = None, deep: bool = False) -> Self:
        """Return the file with other fields; what was computed of the old ones is computed again."""
        found = super().model_copy(update=update, deep=deep)
        for name in ("content", "text", "sha256"):
            found.__dict__.pop(name, None)
        return found

    @classmethod
    def read(cls, text: str | bytes) -> Self:
        """Return the file of a text, checked.

        Raises:
            InvalidSpec: with every violation; pointers are places in the file.
        """
        file = cls.stored(text)
        if violations := list(file.violations()):
            raise InvalidSpec(violations)
        return file

    @classmethod
    def stored(cls, text: str | bytes) -> Self:
        """Return the file of a text that was checked when it was stored, and stays readable if checks become stricter.

        Raises:
            InvalidSpec: it is not a file of this kind; with every violation, whose pointers are places in it.
        """
        if len(text) > cls.most_bytes:
            message = f"the {cls.what} has {len(text):,} bytes, but at most {cls.most_bytes:,} are permitted"
            raise InvalidSpec([Violation("", None, message, f"at most {cls.most_bytes:,} bytes")])
        try:
            content = json.loads(text)
        except (ValueError, RecursionError) as error:
            raise InvalidSpec([Violation("", None, f"the {cls.what} is not JSON: {error}", "JSON in UTF-8")]) from error
        if violations := list(cls.quick_violations(content)):
            raise InvalidSpec(violations)
        try:
            return cls.model_validate_json(text)
        except ValidationError as error:
            raise InvalidSpec(_violations(error, content)) from error

    @classmethod
    def quick_violations(cls, content: Any) -> Iterator[Violation]:  # noqa: ANN401, ARG003 - any JSON
        """Yield violations that are found before every value is checked; by default none."""
        yield from ()

    def violations(self) -> Iterator[Violation]:
        """Yield what is inconsistent in it; by default nothing."""
        yield from ()

    @abstractmethod
    def facts(self) -> dict[str, Any]:
        """Return what lists say of it."""

    @cached_property
    def content(self) -> dict[str, Any]:
        """The file as JSON values, without what has its default value."""
        return {"format_version": self.format_version} | self.model_dump(mode="json", exclude_defaults=True)

    @cached_property
    def text(self) -> str:
        """The canonical text: sorted keys, no spaces, shortest numbers."""
        return json.dumps(self.content, sort_keys=True, separators=(",", ":"), ensure_ascii=False, allow_nan=False)

    @cached_property
    def sha256(self) -> str:
        """The identity of the file: the hash of the canonical text, whatever the spaces and the order in it."""
        return sha256(self.text.encode()).hexdigest()


class RobotFile(NamedFile):
    """A robot as its file has it.

    Attributes:
        source: file that it was imported from; None if it was written by hand.
        usual_controller: controller of a spec that names none.
        usual_task: task of a spec that names none.
        comments: notes for people, like the intervals of tuned values.
        world: the robot in reality.
    """

    kind, what = FileKind.ROBOT, "robot file"

    source: RobotSource | None = None
    usual_controller: PluginRef
    usual_task: PluginRef
    comments: Lines = ()
    world: World

    @classmethod
    def quick_violations(cls, content: Any) -> Iterator[Violation]:  # noqa: ANN401 - any JSON
        """Yield fields that a world has and a file has not, and parts that are too many."""
        world = content.get("world") if isinstance(content, dict) else None
        if not isinstance(world, dict):
            return
        for name in world.keys() & _UNWRITTEN:
            message = f"{name} is not a field of a robot file: it would say how the world was edited"
            yield Violation(f"/world/{name}", None, message, "no such field")
        for name in ("bodies", "joints"):
            if isinstance(given := world.get(name), list) and len(given) > MOST_BODIES:
                message = f"{name} must be at most {MOST_BODIES}, not {len(given):,}"
                yield Violation(f"/world/{name}", len(given), message, f"at most {MOST_BODIES}")

    def violations(self) -> Iterator[Violation]:
        """Yield what is inconsistent in its world."""
        yield from (each.moved("", "/world") for each in world_violations(self.world))

    def facts(self) -> dict[str, Any]:
        """Return what lists say of it."""
        return {
            "file": self.source.file if self.source else None,
            "bodies": len(self.world.bodies),
            "actuators": len(self.world.actuators),
            "mass_kg": sum(body.mass_kg for body in self.world.bodies),
        }

    @cached_property
    def content(self) -> dict[str, Any]:
        """The file as JSON values, without what has its default value."""
        left_out = {"world"} | {name for name in ("source", "comments") if not getattr(self, name)}
        return {**self.model_dump(mode="json", exclude=left_out), "world": _plain(self.world)}


def _plain(value: Any) -> Any:  # noqa: ANN401 - any value of a world
    """Return a value of a world as JSON, without fields that have their default values; a shape keeps its kind."""
    if isinstance(value, tuple):
        return [_plain(item) for item in value]
    if not is_dataclass(value):
        return value
    found = {}
    for field in fields(value):
        given = getattr(value, field.name)
        default = field.default if field.default_factory is MISSING else field.default_factory()
        if field.name not in _UNWRITTEN and (field.name == "kind" or given != default):
            found[field.name] = _plain(given)
    return found


def _violations(error: ValidationError, content: Any) -> Iterator[Violation]:  # noqa: ANN401 - any JSON
    """Return the errors of pydantic with JSON pointers, of each union only those of the member that was meant."""
    for each in error.errors():
        place, meant = _place(each["loc"], content, is_missing=each["type"] == "missing")
        if meant:
            pointer = pointer_to(place)
            message, permitted = _MESSAGES.get(each["type"], (sentence(dict(each), place), permitted_by(dict(each))))
            if each["type"] in _MESSAGES:
                message = message.format(place[-1])
            yield Violation(pointer, each["input"], message, permitted)


def _place(
    loc: Sequence[str | int],
    content: Any,  # noqa: ANN401 - any JSON
    *,
    is_missing: bool,
) -> tuple[list[str | int], bool]:
    """Return the place of an error without the names of members of unions, and whether such a member was meant."""
    place: list[str | int] = []
    for at, part in enumerate(loc):
        if isinstance(content, dict) and (part in content or (is_missing and at == len(loc) - 1)):
            place.append(part)
            content = content.get(part)
        elif isinstance(content, list) and isinstance(part, int):
            place.append(part)
            content = content[part] if part < len(content) else None
        elif not _is_meant(str(part), content):
            return place, False
    return place, True


def _is_meant(member: str, given: Any) -> bool:  # noqa: ANN401 - any JSON
    """Return whether a value, as it is, can only have been meant as this member of a union."""
    if member.startswith("tuple"):
        return isinstance(given, list)
    if member.startswith("tagged-union"):
        return not isinstance(given, list)
    pd = isinstance(given, dict) and ("follows" in given or "kp" in given)
    return {"Motor": not pd, "PDMotor": pd}.get(member, True)
