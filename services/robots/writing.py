"""Write tuned values into the file that a robot came from, after the new file was imported again and compared."""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from hashlib import sha256
from pathlib import Path
from typing import Any, NoReturn, TypeAlias, TypeVar, cast

from gaplab.services.core.errors import InvalidRobot
from gaplab.services.engines.mujoco.plain import LOST, mjcf_of
from gaplab.services.robots.bodies import Bodies
from gaplab.services.robots.comparing import Change, Place, changes, inertials
from gaplab.services.robots.documents import MjcfDocument, UrdfDocument
from gaplab.services.robots.importing import import_robot
from gaplab.services.robots.options import ImportOptions, Notes
from gaplab.services.robots.reading import read_source
from gaplab.services.robots.xml import decoded
from gaplab.services.world.robot_files import LONGEST_NAME, RobotFile
from gaplab.services.world.world import World

T = TypeVar("T")

_TUNED = "_tuned"

NOT_HERE = "not in this file: {}"

_OF_BODIES = {"mass_kg", "center_m", "inertia"}
_COMPUTED = {"start_height_m", "swing", "motor.kp", "motor.kd", "motor.max_torque_nm"}
"""Values that an import may compute of others, so that they differ after it although they were not tuned."""

_FRICTION = ("material.static_friction", "material.dynamic_friction")

_SET_BY = {
    "max_torque": ("motor.max_torque_nm",),
    "kp": ("motor.kp",),
    "kd": ("motor.kd",),
    "position_gain": ("motor.position_gain",),
    "motor": ("motor.kp", "motor.kd"),
    "time_step_s": ("time_step_s",),
    "static_friction": _FRICTION,
    "dynamic_friction": _FRICTION,
}
"""Values by the option of an import that sets them, so that a new import does not read them from the file."""


@dataclass(frozen=True)
class WrittenFile:
    """A file with tuned values.

    Attributes:
        changes: values that are in it.
        left_out: values that its format has no place for; they are comments.
        computed: values that another import of it computes differently.
        world: world of the file, with the values that are not of the format as they were tuned.
    """

    changes: tuple[Change, ...]
    left_out: tuple[Change, ...]
    computed: tuple[Change, ...]
    world: World


Accept: TypeAlias = Callable[[World], None]
"""What raises an error if the world of a new file is not the tuned one, before the file is written."""


@dataclass(frozen=True)
class Tuning:
    """What is written into a file: the robot as imported, its world with tuned values, and comments for its start.

    If it is partial, values that the format has no place for are left out, instead of refused.
    """

    robot: RobotFile
    world: World
    comments: tuple[str, ...]
    partial: bool = False


def write_json(tuning: Tuning, output: Path, accept: Accept) -> WrittenFile:
    """Write a robot file whose world is the tuned one; its name ends in _tuned, so the robot keeps its own.

    Raises:
        InvalidRobot: the world is not the same after it is read again.
        InvalidSpec: the tuned world is not possible.
    """
    world = replace(tuning.world, origin=None, edits=frozenset())
    name = tuning.robot.name.removesuffix(_TUNED)[: LONGEST_NAME - len(_TUNED)] + _TUNED
    file = tuning.robot.model_copy(update={"name": name, "world": world, "comments": tuning.comments})
    text = json.dumps(file.content, ensure_ascii=False, indent=1) + "\n"
    again = RobotFile.read(text).world
    if again != world:
        raise InvalidRobot(["the robot file, read again, differs from the tuned world"])
    accept(again)
    output.write_text(text, encoding="utf-8")
    return WrittenFile(tuple(changes(tuning.robot.world, tuning.world)), (), (), again)


def write_plain(tuning: Tuning, output: Path) -> WrittenFile:
    """Write the tuned world as an MJCF for MuJoCo alone.

    Raises:
        InvalidRobot: a tuned value has no place in it, and `partial` is false; or MuJoCo is missing, or refuses it.
    """
    found = changes(tuning.robot.world, tuning.world)
    lost = tuple(each for each in found if each.place[2].startswith(LOST))
    if lost and not tuning.partial:
        _refuse(lost, {}, "MJCF of MuJoCo alone")
    output.write_text(mjcf_of(tuning.world, [*tuning.comments, *map(NOT_HERE.format, lost)]), encoding="utf-8")
    return WrittenFile(tuple(each for each in found if each not in lost), lost, (), tuning.world)


def write_xml(tuning: Tuning, original: Path, output: Path, accept: Accept) -> WrittenFile:
    """Write a copy of the file that a robot was imported from, with tuned values.

    The world that is to be accepted is that of the new file, with the values that are not of the format as tuned.

    Raises:
        InvalidRobot: the original is another file, the format has no place for a value, or the new file gives another
            world.
    """
    robot, tuned = tuning.robot, tuning.world
    options = _options(robot, original, output)
    text, notes = decoded(original.read_bytes()), Notes()
    source = read_source(original, text, options, notes)
    document: UrdfDocument | MjcfDocument = (
        UrdfDocument(text) if source.is_urdf else MjcfDocument(text, original.parent, source.model, options)
    )
    wanted = changes(robot.world, tuned)
    given = _given(options, is_urdf=source.is_urdf)
    open_ = [change for change in wanted if change.place[2] not in given]
    written = _write(document, Bodies(source), open_, (robot.world, tuned))
    left_out = tuple(change for change in wanted if change.place not in written)
    if left_out and not tuning.partial:
        _refuse(left_out, given, "URDF" if source.is_urdf else "MJCF")
    if output.absolute().parent != original.absolute().parent:
        document.move(original.absolute().parent, output.absolute().parent)
    lines = [*tuning.comments, *map(NOT_HERE.format, left_out)]
    beside = output.with_name(f".{output.stem}.unchecked{output.suffix}")
    beside.write_text(document.text(lines), encoding="utf-8", newline="")
    try:
        again = import_robot(beside, options).robot.world
        computed = _computed(again, tuning, left_out)
        world = _completed(tuned, again, [change.place for change in wanted if change.place in written])
        accept(world)
        beside.replace(output)
    finally:
        beside.unlink(missing_ok=True)
    return WrittenFile(tuple(change for change in wanted if change.place in written), left_out, computed, world)


def _options(robot: RobotFile, original: Path, output: Path) -> ImportOptions:
    if robot.source is None:
        raise InvalidRobot([f"{robot.name} was not imported from a file: write robot.json instead"])
    digest = sha256(original.read_bytes()).hexdigest()
    if digest != robot.source.sha256:
        raise InvalidRobot([f"{original} is not the file that {robot.name} was imported from, or has changed since"])
    if output.resolve() == original.resolve():
        raise InvalidRobot([f"{output} is the original, which a later import or write-back needs: choose another name"])
    if original.suffix.lower() != output.suffix.lower():
        raise InvalidRobot([f"{output.name} must end in {original.suffix}, as {original.name} does, or in .json"])
    return ImportOptions.model_validate(robot.source.options)


def _given(options: ImportOptions, *, is_urdf: bool) -> dict[str, str]:
    """Return the options that set values whatever the file says, as they were given, by the names of the values."""
    names = {"max_torque"} if is_urdf else set(_SET_BY)  # a URDF has no place for the values of the others
    found = options.model_dump(include=names, exclude_defaults=True)
    texts = {option: f"{option}={given}".removesuffix(".0") for option, given in found.items()}
    return {value: text for option, text in texts.items() for value in _SET_BY[option]}


def _refuse(left_out: Sequence[Change], given: Mapping[str, str], form: str) -> NoReturn:
    """Refuse values without a place, each with the reason."""
    faults = {value: f"the import sets it with {option}" for value, option in given.items()}
    reasons = [f"{each}: {faults.get(each.place[2], f'the {form} has no place for it')}" for each in left_out]
    raise InvalidRobot([*reasons, "--partial leaves these out; robot.json has a place for all"])


def _write(
    document: UrdfDocument | MjcfDocument, bodies: Bodies, wanted: Sequence[Change], worlds: tuple[World, World]
) -> set[Place]:
    """Write what the document has a place for; return the places of these values."""
    written = {change.place for change in wanted if document.write(change)}
    for head, before, after in zip(bodies.heads, worlds[0].bodies, worlds[1].bodies, strict=True):
        places = {c.place for c in wanted if c.place[:2] == ("bodies", before.name) and c.place[2] in _OF_BODIES}
        found = inertials(bodies, head, before, after) if places and head else None
        if found is not None and document.write_body(found):
            written |= places
    material = worlds[1].material
    frictions = {("world", "", name) for name in _FRICTION} & {change.place for change in wanted}
    is_one = material.static_friction == material.dynamic_friction and not worlds[1].surfaces
    if frictions and is_one and isinstance(document, MjcfDocument):
        document.write_friction(material.static_friction)
        written |= frictions
    return written


def _computed(again: World, tuning: Tuning, left_out: Sequence[Change]) -> tuple[Change, ...]:
    """Return the values that an import computes of tuned ones, though they were not tuned.

    Raises:
        InvalidRobot: another value differs from that of the tuned world.
    """
    missing = {change.place for change in left_out}
    tuned = {change.place for change in changes(tuning.robot.world, tuning.world)}
    differing = [change for change in changes(tuning.world, again) if change.place not in missing]
    if wrong := [each for each in differing if each.place[2] not in _COMPUTED or each.place in tuned]:
        raise InvalidRobot(f"{change}: the new file, imported again, has another value" for change in wrong)
    return tuple(differing)


def _completed(tuned: World, again: World, written: Sequence[Place]) -> World:
    """Return the tuned world with the values that the new file gives."""
    world = replace(tuned, origin=None, edits=frozenset())
    for kind, name, value in written:
        if kind == "world":
            world = _taken(world, again, value)
            continue
        theirs = {member.name: member for member in getattr(again, kind)}
        members = [_taken(each, theirs[name], value) if each.name == name else each for each in getattr(world, kind)]
        changed: dict[str, Any] = {kind: tuple(members)}
        world = replace(world, **changed)
    return world


def _taken(owner: T, other: Any, value: str) -> T:  # noqa: ANN401 - both are a World, a Body or a Joint
    outer, _, inner = value.partition(".")
    found = getattr(other, outer)
    if inner:
        found = replace(getattr(owner, outer), **{inner: getattr(found, inner)})
    changed: Any = replace(owner, **{outer: found})  # type: ignore[type-var]
    return cast(T, changed)
