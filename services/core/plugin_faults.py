"""Faults of external plug-ins: why specs cannot use a class."""

from collections.abc import Iterable, Mapping
from inspect import signature
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError

from gaplab.schemas.base import Frozen
from gaplab.schemas.mistakes import permitted_by, pointer_to, sentence
from gaplab.schemas.plugin import LONGEST_NAME
from gaplab.services.core.errors import Violation, unknown_name
from gaplab.services.core.unusable_plugins import quoted

SETS_OF_OPTIONS = ("published", "lean")
"""Attributes of a plug-in with values for some of its options."""


def fault_of(plugin: type[Any], kind: str, folders: Iterable[Path]) -> str | None:
    """Return why specs cannot use a class, as the rest of a sentence that begins with its name; None if they can.

    A class other than an engine is created with its default options; an engine may belong to hardware.

    Args:
        plugin: the class.
        kind: its kind, one of `unusable_plugins.KINDS`.
        folders: the plug-in folders; the place of an error in them is named.
    """
    if missing := [name for name in dir(plugin) if _is_abstract(plugin, name)]:
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


def _is_abstract(plugin: type, name: str) -> bool:
    return bool(getattr(getattr(plugin, name, None), "__isabstractmethod__", False))


def _fault_of_name(plugin: type[Any], kind: str) -> str | None:
    name = getattr(plugin, "name", None)
    if not isinstance(name, str) or not name:
        return "has no name for specs to use: add name = '…'"
    if len(name) > LONGEST_NAME:
        return f"has a name of {len(name)} characters, but specs permit at most {LONGEST_NAME}: shorten it"
    if kind == "tunable" and (name != name.strip() or set("()") & set(name)):
        return f"has the name {name!r}, but parentheses and outer spaces in a spec are no part of a name: rename it"
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
    """Return the violation of an option that the model refuses.

    Args:
        name: the plug-in's name.
        options: model of its options.
        error: an item of `ValidationError.errors()`.
        pointer: place of the options in the spec.
    """
    place = pointer_to(error["loc"])
    if error["type"] == "extra_forbidden":
        kind = f"option of {name!r}"
        return unknown_name(pointer + place, kind, str(error["loc"][-1]), given_names(options) or ["none"])
    return Violation(pointer + place, error["input"], sentence(error), permitted_by(error))
