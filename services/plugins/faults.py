"""External plug-ins that specs cannot use, and files beside them that are not plug-ins: all named with the reason."""

import ast
import sys
from collections.abc import Iterable, Iterator
from inspect import signature
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from gaplab.schemas.base import Frozen
from gaplab.schemas.plugin import LONGEST_NAME, IgnoredFile
from gaplab.services.core.registry import EXTERNAL, Plugin, Unusable, option_violation, quoted
from gaplab.services.plugins.contents import Contents, module_of
from gaplab.services.specs.registries import REGISTRIES


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
    """Return why the defaults, completed as a spec stores them, are refused, alone or with a preset."""
    options = plugin.Options
    if not isinstance(options, type) or not issubclass(options, Frozen):
        return "has Options that accept misspelt names: derive them from gaplab.plugins.Frozen"
    defaults = options().model_dump(mode="json", by_alias=True, warnings=False)
    sets = {f"preset {name!r}": changes for name, changes in plugin.presets.items()}
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


IMPORTED = {".urdf", ".mjcf"}
"""Endings of descriptions of robots that `gaplab robot import` reads."""

OTHERS = {".xacro", ".sdf", ".usd"}
"""Endings of descriptions of robots in other formats."""

NOT_PYTHON = "it is not a Python module; put data that a plug-in reads into its package"
TO_IMPORT = "it is not a Python module: gaplab robot import FILE, then gaplab robot add (docs/how-to/robot-file.md)"
NOT_A_ROBOT = (
    "it is not a Python module, and not in a format that is imported: make a URDF or an MJCF of it, and import that "
    "(docs/how-to/robot-file.md), or describe the robot as a class (docs/how-to/robot.md)"
)
NO_PACKAGE = "the folder has no __init__.py, so it is not a package"
FOR_OTHERS = "its name begins with _, so it is only for other files to import; rename it"
DOTTED = "a module cannot be imported by a name with a dot; rename it, for example with _ in place of the dot"
NO_CLASS = "it has no class of a plug-in; if others import it, begin its name with _"


def ignored_files(folders: Iterable[Path], contents: Contents) -> tuple[IgnoredFile, ...]:
    """Return what is directly in the plug-in folders and not a plug-in, each with the reason; all were imported."""
    useful = _useful(contents)
    return tuple(file for folder in folders if folder.is_dir() for file in _ignored(folder, useful))


def _ignored(folder: Path, useful: set[str]) -> Iterator[IgnoredFile]:
    for path in sorted(folder.iterdir()):
        if path.name.startswith((".", "_")):
            continue
        is_module = path.suffix == ".py" and not path.is_dir()
        if not (path.stem in useful if is_module else (path / "__init__.py").exists()):
            yield IgnoredFile(file=f"{path.name}/" if path.is_dir() else path.name, why=why_no_plugin(path))


def why_no_plugin(path: Path) -> str:
    """Return why a file or folder without a plug-in has none, after an attempt to import it."""
    if path.is_dir() and not (path / "__init__.py").exists():
        return NO_PACKAGE
    if not path.is_dir() and path.suffix != ".py":
        return _why_no_module(path.suffix.lower())
    name = path.name.removesuffix(".py")
    if name.startswith("_"):
        return FOR_OTHERS
    if "." in name:
        return DOTTED
    if hidden := _hidden_classes(name):
        return f"its class {hidden[0]} begins with _, so it is only for others to derive from; rename it"
    return NO_CLASS


def _hidden_classes(name: str) -> list[str]:
    """Return the classes of plug-ins in a module whose names begin with an underscore."""
    module = f"{EXTERNAL}.{name}"
    found = vars(sys.modules[module]).values() if module in sys.modules else ()
    plugins = [each for each in found if isinstance(each, type) and issubclass(each, Plugin)]
    return [each.__name__ for each in plugins if each.__module__ == module and each.__name__[0] == "_"]


def _why_no_module(suffix: str) -> str:
    if suffix in IMPORTED:
        return TO_IMPORT
    return NOT_A_ROBOT if suffix in OTHERS else NOT_PYTHON


def _useful(contents: Contents) -> set[str]:
    """Return the modules with a plug-in, usable or not, and those that other modules import."""
    found = {name for names in contents.imports.values() for name in names}
    for registry in REGISTRIES.values():
        files = [*registry.files.values(), *(refused.file for refused in registry.refused.values())]
        found |= set(map(module_of, files))
    return found
