"""Files in the plug-in folders that are not plug-ins: they are named, so that nobody waits for them."""

import sys
from collections.abc import Iterable, Iterator
from pathlib import Path

from gaplab.schemas.plugin import IgnoredFile
from gaplab.services.core.registry import EXTERNAL, Plugin
from gaplab.services.plugins.contents import Contents, module_of
from gaplab.services.specs.registries import REGISTRIES

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
