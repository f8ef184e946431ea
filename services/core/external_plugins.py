"""External plug-ins: every module of the plug-in folders, imported as `gaplab_plugins.NAME`.

A module that cannot be imported and a class that is not a valid plug-in stop nothing: they are listed as unusable.
"""

import sys
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from importlib import import_module, invalidate_caches
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader
from pathlib import Path
from pkgutil import iter_modules
from types import CodeType, ModuleType
from typing import TypeGuard, TypeVar

from gaplab.services.core.errors import PluginBroken
from gaplab.services.core.plugin_faults import Unusable, fault_of, from_file, quoted, remedied

PACKAGE = "gaplab_plugins"
"""Name of a package without a file; plug-in files import each other as `from gaplab_plugins.other import …`."""

P = TypeVar("P")


class _Uncached(SourceFileLoader):
    """A loader that compiles the file at each import.

    Python's cache tells files apart by size and second of the last change, so it may hold what was before an edit.
    """

    def get_code(self, fullname: str) -> CodeType:
        """Return the compiled text of the file."""
        path = self.get_filename(fullname)
        return self.source_to_code(self.get_data(path), path)


class _Finder:
    """A finder of the modules of the plug-in folders, which are imported without the cache."""

    @staticmethod
    def find_spec(name: str, path: Sequence[str] | None = None, target: ModuleType | None = None) -> ModuleSpec | None:
        """Return where to import a module of the package from; None for any other module."""
        found = PathFinder.find_spec(name, path, target) if name.startswith(f"{PACKAGE}.") else None
        if found is not None and type(found.loader) is SourceFileLoader:
            found.loader, found.cached = _Uncached(name, found.loader.path), None
        return found


@dataclass(frozen=True)
class Loaded:
    """The modules of the plug-in folders.

    Attributes:
        modules: those that were imported, by name.
        unusable: the plug-ins of the others.
    """

    modules: tuple[ModuleType, ...] = ()
    unusable: tuple[Unusable, ...] = ()


class _Package(ModuleType):
    """The package of external plug-ins.

    Attributes:
        only: names of the modules that are imported, each from its first folder; None: all are imported, from all.
    """

    def __init__(self, folders: tuple[Path, ...], only: frozenset[str] | None) -> None:
        super().__init__(PACKAGE, "External plug-ins.")
        self.__path__ = [str(folder) for folder in folders]
        self.only = only


def set_folders(folders: tuple[Path, ...], only: Collection[str] | None = None) -> None:
    """Set the plug-in folders; their modules are imported again when they are next needed.

    Args:
        folders: the folders.
        only: names of modules; the others are imported only if these import them. Left out: all are.
    """
    for name in [name for name in sys.modules if name.partition(".")[0] == PACKAGE]:
        del sys.modules[name]
    sys.modules[PACKAGE] = _Package(folders, None if only is None else frozenset(only))
    if _Finder not in sys.meta_path:
        sys.meta_path.insert(0, _Finder)
    _load.cache_clear()
    invalidate_caches()


def import_again() -> None:
    """Let the same modules be imported again when they are next needed."""
    set_folders(named_folders(), chosen())


def chosen() -> frozenset[str] | None:
    """Return the names of the only modules that are imported, but for what they import; None if all are."""
    found = package()
    return found.only if isinstance(found, _Package) else None


def package() -> ModuleType | None:
    """Return the package of external plug-ins, another object after each `set_folders`; None before the first."""
    return sys.modules.get(PACKAGE)


def folders() -> tuple[Path, ...]:
    """Return the plug-in folders that exist."""
    return tuple(folder for folder in dict.fromkeys(named_folders()) if folder.is_dir())


def named_folders() -> tuple[Path, ...]:
    """Return the plug-in folders as they were set, whether they exist or not."""
    found = package()
    return () if found is None else tuple(Path(path) for path in found.__path__)


def classes(base: type[P], kind: str) -> tuple[list[type[P]], list[Unusable]]:
    """Return the valid external plug-ins of one kind, and the invalid ones."""
    valid, invalid = list[type[P]](), list[Unusable]()
    for module in loaded().modules:
        members = list(vars(module).values())
        for each in (each for each in members if _is_of(module, each) and issubclass(each, base)):
            fault, file = fault_of(each, kind, folders()), file_of(each) or ""
            if fault is None:
                valid.append(each)
            else:
                invalid.append(Unusable(file, _name_of(each), None, remedied(f"{each.__name__} in {file} {fault}")))
    return valid, invalid


def loaded() -> Loaded:
    """Return the modules of the folders; the first call after `set_folders` imports them."""
    return _load(package())


def are_loaded() -> bool:
    """Return whether the modules were imported since the last `set_folders`."""
    return _load.cache_info().currsize > 0


def file_of(plugin: type) -> str | None:
    """Return the file of a plug-in relative to its folder; None for gaplab's own plug-ins."""
    top, _, name = plugin.__module__.partition(".")
    if top != PACKAGE:
        return None
    is_package = hasattr(sys.modules.get(plugin.__module__), "__path__")
    return name.replace(".", "/") + ("/__init__.py" if is_package else ".py")


@lru_cache(maxsize=1)
def _load(package: ModuleType | None) -> Loaded:
    only = package.only if isinstance(package, _Package) else None
    modules, unusable = list[ModuleType](), list[Unusable]()
    for name, paths in sorted(_places().items()):
        try:
            if only is None or name in only:
                modules += _imported(name, paths if only is None else paths[:1])
        except PluginBroken as error:
            file = f"{name}/__init__.py" if paths[0].name == "__init__.py" else f"{name}.py"
            unusable += from_file(paths[0], file, str(error))
    if only is not None:
        modules = [module for name, module in list(sys.modules.items()) if name.rpartition(".")[0] == PACKAGE]
    return Loaded(tuple(modules), tuple(unusable))


def _places() -> dict[str, list[Path]]:
    """Return the files of each module by its name, which may be in several folders."""
    places: dict[str, list[Path]] = {}
    for folder in folders():
        for info in iter_modules([str(folder)]):
            file = folder / info.name / "__init__.py" if info.ispkg else folder / f"{info.name}.py"
            places.setdefault(info.name, []).append(file)
    return places


def _imported(name: str, paths: list[Path]) -> Iterator[ModuleType]:
    """Yield the module of this name, unless an underscore says that it has no plug-ins.

    Raises:
        PluginBroken: it cannot be imported, or is in several folders.
    """
    if len(paths) > 1:
        raise PluginBroken(f"{' and '.join(_told_apart(paths))} have the same name: rename one of them")
    if name.startswith("_"):
        return
    try:
        yield import_module(f"{PACKAGE}.{name}")
    except (Exception, SystemExit) as error:
        raise PluginBroken(f"{name}.py cannot be imported: {quoted(error, folders())}") from error


def _told_apart(paths: list[Path]) -> list[str]:
    """Return the ends of the paths of modules: from the folder, or from as far above it as makes them differ."""
    parts = [(path.parent if path.name == "__init__.py" else path).parts for path in paths]
    for length in range(2, max(map(len, parts))):
        ends = ["/".join(each[-length:]) for each in parts]
        if len(set(ends)) == len(ends):
            return ends
    return list(map(str, paths))


def _is_of(module: ModuleType, found: object) -> TypeGuard[type]:
    """Return whether a class is defined in this module or package, and its name has no leading underscore."""
    if not isinstance(found, type) or found.__name__.startswith("_"):
        return False
    return found.__module__ == module.__name__ or found.__module__.startswith(f"{module.__name__}.")


def _name_of(plugin: type) -> str:
    name = getattr(plugin, "name", None)
    return name if isinstance(name, str) and name else Path((file_of(plugin) or "").removesuffix("/__init__.py")).stem
