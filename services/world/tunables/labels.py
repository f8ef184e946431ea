"""Labels: a tunable and its options as one name, like `mass(trunk)` or `kp(*_knee, as=value)`.

A label is the name of a tunable in specs, parameters of reality, columns and figures. Options that have their defaults
are not in it, so equal tunables have equal labels, and a tunable without options has its plain name.
"""

import re
from typing import Any

from gaplab.schemas.plugin import LONGEST_NAME, PluginRef, tunable_label
from gaplab.services.core.errors import InvalidSpec, Violation, unknown_name
from gaplab.services.world.tunables import tunables
from gaplab.services.world.tunables.base import Tunable

LABEL = re.compile(r"(?P<name>[^()]+?)\s*\((?P<options>[^()]*)\)")
NUMBER = re.compile(r"-?\d+(\.\d*)?([eE][-+]?\d+)?")


def plain_name(label: str) -> str:
    """Return the name in a label, like `mass` in `mass(trunk)`."""
    return label.partition("(")[0].strip()


def tunable_of(label: str, pointer: str = "") -> Tunable:
    """Return the tunable of a label, which is its name, and in parentheses its options.

    Raises:
        InvalidSpec: no tunable has this name, or it refuses the options; the pointer is its place in the spec.
    """
    name, options = plain_name(label), _options(label, pointer)
    if not 1 <= len(name) <= LONGEST_NAME:
        raise InvalidSpec([unknown_name(pointer, "tunable", name[:LONGEST_NAME], list(tunables))])
    return tunables.create(PluginRef(name=name, options=options), pointer)


def label_of(tunable: Tunable) -> str:
    """Return the label of a tunable."""
    given, usual = (each.model_dump(mode="json", by_alias=True) for each in (tunable.options, tunable.Options()))
    return tunable_label(tunable.name, {name: value for name, value in given.items() if value != usual[name]})


def proper(label: str) -> str:
    """Return the label in its only proper spelling; as it is if there is no such tunable."""
    try:
        return label_of(tunable_of(label))
    except InvalidSpec:
        return label


def unit_of(label: str) -> str:
    """Return the unit of a tunable; "" if it is not installed here."""
    try:
        return tunable_of(label).unit
    except InvalidSpec:
        return ""


def _options(label: str, pointer: str) -> dict[str, Any]:
    """Return the options in the parentheses of a label; the one without a name is `of`."""
    if "(" not in label and ")" not in label:
        return {}
    if (parts := LABEL.fullmatch(label.strip())) is None:
        message = f"{label!r} is not a label of a tunable; write name(part) or name(part, option=value)"
        raise InvalidSpec([Violation(pointer, label, message, "name(part, option=value)")])
    options: dict[str, Any] = {}
    for number, text in enumerate(part.strip() for part in parts["options"].split(",") if part.strip()):
        name, equals, value = (each.strip() for each in text.partition("="))
        if equals:
            options[name] = float(value) if NUMBER.fullmatch(value) else value
        elif number == 0:
            options["of"] = text
        else:
            message = f"{text!r} in {label!r} has no name; write option=value"
            raise InvalidSpec([Violation(pointer, label, message, "name(part, option=value)")])
    return options
