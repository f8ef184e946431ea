"""Files in the plug-in folders that are no plug-ins: they are named, so that nobody waits for them."""

from collections.abc import Iterator
from pathlib import Path

from gaplab.schemas.plugin import IgnoredFile
from gaplab.services.core import external_plugins
from gaplab.services.plugins.contents import read
from gaplab.services.plugins.external import REGISTRIES

IMPORTED = {".urdf", ".mjcf"}
"""Endings of descriptions of robots that `gaplab robot import` reads."""

OTHERS = {".xacro", ".sdf", ".usd"}
"""Endings of descriptions of robots in other formats."""

NOT_PYTHON = "it is no Python module; put data that a plug-in reads into its package"
TO_IMPORT = "it is no Python module: gaplab robot import FILE, then gaplab robot add (docs/how-to/robot-file.md)"
NOT_A_ROBOT = (
    "it is no Python module, and no format that is imported: make a URDF or an MJCF of it, and import that "
    "(docs/how-to/robot-file.md), or describe the robot as a class (docs/how-to/robot.md)"
)
NO_PACKAGE = "the folder has no __init__.py, so it is no package"
NO_CLASS = "it has no class of a plug-in; if others import it, begin its name with _"


def ignored_files() -> tuple[IgnoredFile, ...]:
    """Return the files and folders directly in the plug-in folders that are no plug-ins, each with the reason."""
    return tuple(file for folder in external_plugins.folders() for file in _ignored(folder))


def _ignored(folder: Path) -> Iterator[IgnoredFile]:
    useful = _useful()
    for path in sorted(folder.iterdir()):
        if path.name.startswith((".", "_")):
            continue
        if path.is_dir():
            if not (path / "__init__.py").exists():
                yield IgnoredFile(file=f"{path.name}/", why=NO_PACKAGE)
        elif path.suffix != ".py":
            yield IgnoredFile(file=path.name, why=_why_not(path.suffix.lower()))
        elif path.stem not in useful:
            yield IgnoredFile(file=path.name, why=NO_CLASS)


def _why_not(suffix: str) -> str:
    """Return why a file with this ending is no plug-in."""
    if suffix in IMPORTED:
        return TO_IMPORT
    return NOT_A_ROBOT if suffix in OTHERS else NOT_PYTHON


def _useful() -> set[str]:
    """Return the modules with a plug-in, usable or not, and those that other modules import."""
    found = {name for names in read().imports.values() for name in names}
    for registry in REGISTRIES.values():
        files = [*(external_plugins.file_of(plugin) for plugin in registry.values())]
        files += [refused.file for refused in registry.refused]
        found |= {file.partition("/")[0].removesuffix(".py") for file in files if file}
    return found
