"""External plug-ins: every module of the plug-in folders, imported as `gaplab_plugins.NAME`."""

import sys
from collections.abc import Iterator
from importlib import import_module, invalidate_caches
from pathlib import Path
from pkgutil import iter_modules
from types import ModuleType
from typing import TypeGuard, TypeVar

from gaplab.services.core.errors import PluginBroken

PACKAGE = "gaplab_plugins"
"""Name of a package without a file; plug-in files import each other as `from gaplab_plugins.other import …`."""

P = TypeVar("P")


def set_folders(folders: tuple[Path, ...]) -> None:
    """Set the plug-in folders; registries that were used before keep their plug-ins."""
    for name in [name for name in sys.modules if name.partition(".")[0] == PACKAGE]:
        del sys.modules[name]
    package = ModuleType(PACKAGE, "External plug-ins.")
    package.__path__ = [str(folder) for folder in folders]
    sys.modules[PACKAGE] = package
    invalidate_caches()


def folders() -> tuple[Path, ...]:
    """Return the plug-in folders.

    Raises:
        PluginBroken: one does not exist.
    """
    named = tuple(Path(path) for path in sys.modules[PACKAGE].__path__) if PACKAGE in sys.modules else ()
    for folder in named:
        if not folder.is_dir():
            raise PluginBroken(f"there is no plug-in folder {folder}")
    return named


def classes(base: type[P]) -> Iterator[type[P]]:
    """Return the external plug-ins of one kind.

    Raises:
        PluginBroken: a module cannot be imported, or a class is not a valid plug-in.
    """
    for module in _modules():
        for each in vars(module).values():
            if _is_of(module, each) and issubclass(each, base):
                _check(each)
                yield each


def file_of(plugin: type) -> str | None:
    """Return the file of a plug-in relative to its folder; None for gaplab's own plug-ins."""
    package, _, name = plugin.__module__.partition(".")
    if package != PACKAGE:
        return None
    is_package = hasattr(sys.modules[plugin.__module__], "__path__")
    return name.replace(".", "/") + ("/__init__.py" if is_package else ".py")


def _modules() -> list[ModuleType]:
    """Return the modules of the folders by name, without those that begin with an underscore."""
    found: dict[str, str] = {}
    for folder in folders():
        for name in sorted(info.name for info in iter_modules([str(folder)])):
            if name in found:
                raise PluginBroken(f"{name}.py is in {found[name]} and in {folder}; rename one of them")
            found[name] = str(folder)
    return [_imported(name, folder) for name, folder in found.items() if not name.startswith("_")]


def _imported(name: str, folder: str) -> ModuleType:
    try:
        return import_module(f"{PACKAGE}.{name}")
    except Exception as error:  # a plug-in file may raise anything
        raise PluginBroken(f"{folder}/{name}.py cannot be imported: {type(error).__name__}: {error}") from error


def _is_of(module: ModuleType, found: object) -> TypeGuard[type]:
    """Return whether a class is defined in this module or package, and its name has no leading underscore."""
    if not isinstance(found, type) or found.__name__.startswith("_"):
        return False
    return found.__module__ == module.__name__ or found.__module__.startswith(f"{module.__name__}.")


def _check(plugin: type) -> None:
    where = f"{plugin.__name__} in {file_of(plugin)}"
    if missing := [name for name in dir(plugin) if _is_abstract(plugin, name)]:
        raise PluginBroken(f"{where} does not define {', '.join(missing)}")
    if not isinstance(getattr(plugin, "name", None), str):
        raise PluginBroken(f"{where} has no name for specs to use: add name = '…'")
    try:
        plugin.describe()  # type: ignore[attr-defined]
    except Exception as error:
        raise PluginBroken(f"{where} cannot be described: {type(error).__name__}: {error}") from error


def _is_abstract(plugin: type, name: str) -> bool:
    return bool(getattr(getattr(plugin, name, None), "__isabstractmethod__", False))
