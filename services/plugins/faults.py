"""External plug-ins that specs cannot use: what is wrong with their classes, and what a broken file would have had."""

import ast
from inspect import signature
from typing import Any

from pydantic import ValidationError

from gaplab.schemas.base import Frozen
from gaplab.schemas.plugin import LONGEST_NAME
from gaplab.services.core.registry import Unusable, option_violation, quoted
from gaplab.services.specs.registries import REGISTRIES

SETS_OF_OPTIONS = ("published", "lean")
"""Attributes of a plug-in with values for some of its options."""


def remedied(why: str) -> str:
    """Return the sentence with what to do."""
    return f"{why}; repair the file, and start the service again"


def of_file(file: str, text: bytes, why: str) -> list[Unusable]:
    """Return the plug-ins of a file that was not imported, as far as its classes name them.

    A text that is not Python, or has no such class, is listed under the name of the file, as a plug-in of every kind.

    Args:
        file: the file, relative to its folder.
        text: what is in it.
        why: one sentence without the remedy.
    """
    try:
        statements = ast.parse(text).body
    except (SyntaxError, ValueError):
        statements = []
    named = [pair for each in statements if isinstance(each, ast.ClassDef) if any(pair := _told_by(each))]
    usual = file.removesuffix("/__init__.py").removesuffix(".py")
    return [Unusable(file, name or usual, kind, remedied(why)) for name, kind in named or [(None, None)]]


def _told_by(found: ast.ClassDef) -> tuple[str | None, str | None]:
    """Return name and kind of the plug-in that a class seems to be; None for what it does not tell."""
    bases = " ".join(map(ast.unparse, found.bases)).lower()
    names = [name for each in found.body if (name := _name_by(each))]
    return next(iter(names), None), next((kind for kind in REGISTRIES if kind in bases), None)


def _name_by(statement: ast.stmt) -> str | None:
    """Return the text that a statement of a class gives to `name`; None if it gives none."""
    match statement:
        case ast.Assign(targets=[ast.Name(id="name")], value=ast.Constant(value=str(name))):
            return name
        case ast.AnnAssign(target=ast.Name(id="name"), value=ast.Constant(value=str(name))):
            return name
    return None


def fault_of(plugin: type[Any], kind: str) -> str | None:
    """Return why specs cannot use a class, as the rest of a sentence that begins with its name; None if they can.

    A class other than an engine is created with its default options; an engine may belong to hardware.
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
        return f"cannot be {doing}: {quoted(error)}"
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
            why = option_violation(plugin, dict(error.errors()[0])).message
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
