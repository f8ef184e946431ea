"""External plug-ins: the modules of the plug-in folders, imported once as `gaplab_plugins.NAME`.

Their files are read before the first of them is imported, and each import takes what was read then: an edit takes
effect with the next process. A module that cannot be imported and a class that is not a valid plug-in stop nothing:
they are listed as unusable.
"""

import os
import re
import sys
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib import import_module, invalidate_caches
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader
from pathlib import Path
from types import CodeType, ModuleType
from typing import Any, TypeGuard

from gaplab.schemas.plugin import IgnoredFile
from gaplab.services.core.errors import PluginBroken
from gaplab.services.core.registry import EXTERNAL, Plugin, Registry, Unusable, quoted
from gaplab.services.plugins import contents
from gaplab.services.plugins.contents import Contents
from gaplab.services.plugins.faults import fault_of, ignored_files, of_file, remedied
from gaplab.services.specs.registries import REGISTRIES


@dataclass(frozen=True)
class Loaded:
    """The plug-in folders as this process imported them.

    Attributes:
        folders: the folders.
        contents: what was in them.
        ignored: their files that are not plug-ins.
    """

    folders: tuple[Path, ...]
    contents: Contents
    ignored: tuple[IgnoredFile, ...] = ()


class _Package(ModuleType):
    """The package of external plug-ins, with what was imported."""

    def __init__(self, loaded: Loaded) -> None:
        super().__init__(EXTERNAL, "External plug-ins.")
        self.__path__ = [str(folder) for folder in loaded.folders]
        self.loaded = loaded


def here() -> Loaded | None:
    """Return what this process has imported; None if it has not looked for plug-ins."""
    found = sys.modules.get(EXTERNAL)
    return found.loaded if isinstance(found, _Package) else None


def load(folders: Sequence[Path], only: Collection[str] | None = None, found: Contents | None = None) -> Loaded:
    """Import the modules of the folders, and put their plug-ins beside gaplab's own, in place of those before.

    Args:
        folders: the folders.
        only: names of modules, each imported from its first folder; the others are imported only if these import them.
            Left out: all are imported.
        found: what is in the folders; left out: it is read now.
    """
    folders = tuple(dict.fromkeys(folders))
    loaded = Loaded(folders, contents.read(folders) if found is None else found)
    for name in [name for name in sys.modules if name.partition(".")[0] == EXTERNAL]:
        del sys.modules[name]
    if _Finder not in sys.meta_path:
        sys.meta_path.insert(0, _Finder)
    invalidate_caches()
    sys.modules[EXTERNAL] = package = _Package(loaded)
    modules, broken = _imported(loaded, only)
    for registry in sorted(REGISTRIES.values(), key=lambda each: each.kind == "robot"):  # which creates others
        _put(registry, modules, broken)
    if only is None:
        package.loaded = replace(loaded, ignored=ignored_files(loaded.folders, loaded.contents))
    return package.loaded


class _Loader(SourceFileLoader):
    """A loader of what was read when the process started, and not of what Python keeps in its cache."""

    def get_code(self, fullname: str) -> CodeType:
        """Return the compiled text of the file."""
        path = self.get_filename(fullname)
        text = _files_here()[Path(path)]
        return self.source_to_code(self.get_data(path) if text is None else text, path)


def _files_here() -> Mapping[Path, bytes | None]:
    loaded = here()
    return {} if loaded is None else loaded.contents.files


class _Finder:
    """A finder of the modules in the plug-in folders, but for those that were not there at the start."""

    @staticmethod
    def find_spec(name: str, path: Sequence[str] | None = None, target: ModuleType | None = None) -> ModuleSpec | None:
        """Return where to import a module of the package from; None for any other module."""
        found = PathFinder.find_spec(name, path, target) if name.startswith(f"{EXTERNAL}.") else None
        if found is None or type(found.loader) is not SourceFileLoader:
            return found
        if Path(found.loader.path) not in _files_here():
            raise ModuleNotFoundError(f"No module named {name!r} when the process started", name=name)
        found.loader, found.cached = _Loader(name, found.loader.path), None
        return found


def _imported(loaded: Loaded, only: Collection[str] | None) -> tuple[list[ModuleType], list[Unusable]]:
    """Import modules; return those that may have plug-ins, and the plug-ins of those that cannot be imported.

    A module whose name begins with an underscore has none. What chosen modules import may have some.
    """
    names, broken = list[str](), list[Unusable]()
    for name, paths in sorted(_places(loaded).items()):
        if name.startswith("_") or (only is not None and name not in only):
            continue
        try:
            _import(name, paths if only is None else paths[:1], loaded.folders)
            names.append(f"{EXTERNAL}.{name}")
        except PluginBroken as error:
            file = f"{name}/__init__.py" if paths[0].name == "__init__.py" else f"{name}.py"
            broken += of_file(file, loaded.contents.files[paths[0]] or b"", str(error))
    if only is not None:
        names = [name for name in sys.modules if re.fullmatch(rf"{EXTERNAL}\.[^_.][^.]*", name)]
    return [sys.modules[name] for name in names], broken


def _places(loaded: Loaded) -> dict[str, list[Path]]:
    """Return the files of each module by its name, which may be in several folders."""
    places: dict[str, list[Path]] = {}
    for path in loaded.contents.files:
        module = path.parent if path.name == "__init__.py" else path
        name = module.name.removesuffix(".py")
        if path.suffix == ".py" and module.parent in loaded.folders and "." not in name:
            places.setdefault(name, []).append(path)
    return places


def _import(name: str, paths: Sequence[Path], folders: Iterable[Path]) -> None:
    """Import the module of this name.

    Raises:
        PluginBroken: it cannot be imported, or is in several folders.
    """
    if len(paths) > 1:
        raise PluginBroken(f"{' and '.join(_told_apart(paths))} have the same name: rename one of them")
    try:
        import_module(f"{EXTERNAL}.{name}")
    except (Exception, SystemExit) as error:
        raise PluginBroken(f"{name}.py cannot be imported: {quoted(error, _misspelt(error, folders))}") from error


def _misspelt(error: BaseException, folders: Iterable[Path]) -> str | None:
    """Return the file and the line that are not Python; None if that is not the error."""
    if isinstance(error, SyntaxError) and error.filename is not None:
        for folder in folders:
            if Path(error.filename).is_relative_to(folder):
                return f"{Path(error.filename).relative_to(folder).as_posix()}, line {error.lineno}"
    return None


def _told_apart(paths: Iterable[Path]) -> list[str]:
    """Return the paths of modules from the deepest folder that has them all."""
    modules = [path.parent if path.name == "__init__.py" else path for path in paths]
    common = os.path.commonpath(modules)
    return [each.relative_to(common).as_posix() for each in modules]


def _put(registry: Registry[Any], modules: Iterable[ModuleType], broken: Iterable[Unusable]) -> None:
    """Put the plug-ins of one kind beside gaplab's own, but for those of one name."""
    refused = [each for each in broken if each.kind in {None, registry.kind}]
    valid: dict[str, list[type[Plugin]]] = {}
    for each in [each for module in modules for each in vars(module).values() if _is_of(module, each, registry)]:
        fault, file = fault_of(each, registry.kind), _file_of(each)
        if fault is None:
            valid.setdefault(each.name, []).append(each)
        else:
            why = remedied(f"{each.__name__} in {file} {fault}")
            refused.append(Unusable(file, _name_of(each, file), None, why))
    alone = {name: each for name, (each, *others) in valid.items() if not others and name not in registry.own}
    for name in sorted(valid.keys() - alone):
        owner = ["gaplab"] if name in registry.own else []
        refused += _of_one_name(registry.kind, name, [_file_of(each) for each in valid[name]], owner)
    files = {name: _file_of(each) for name, each in alone.items()}
    registry.put(alone, files, _by_name(refused, registry.own.keys() | alone.keys()))


def _is_of(module: ModuleType, found: object, registry: Registry[Any]) -> TypeGuard[type[Plugin]]:
    """Return whether a class is a plug-in of this module or package, and its name has no leading underscore."""
    if not isinstance(found, type) or found.__name__.startswith("_") or not issubclass(found, registry.base):
        return False
    return found.__module__ == module.__name__ or found.__module__.startswith(f"{module.__name__}.")


def _file_of(plugin: type[Plugin]) -> str:
    """Return the file of a plug-in, relative to its folder."""
    is_package = hasattr(sys.modules.get(plugin.__module__), "__path__")
    return plugin.__module__.partition(".")[2].replace(".", "/") + ("/__init__.py" if is_package else ".py")


def _name_of(plugin: type[Plugin], file: str) -> str:
    name = getattr(plugin, "name", None)
    return name if isinstance(name, str) and name else Path(file.removesuffix("/__init__.py")).stem


def _of_one_name(kind: str, name: str, files: list[str], owner: list[str]) -> Iterator[Unusable]:
    """Yield for each file that its plug-in has the name of another; a file with several of them is there as often.

    The owner is "gaplab", if it has the name too.
    """
    for file in dict.fromkeys(files):
        others = [*owner, *(each for each in files if each != file), "another class in it"]
        why = f"{file} has a {kind} called {name!r}, but so has {others[0]}: rename one of them"
        yield Unusable(file, name, kind, remedied(why))


def _by_name(unusable: Iterable[Unusable], usable: Collection[str]) -> Mapping[str, Unusable]:
    """Return unusable plug-ins by their names in the catalogue: with the file where the name alone is another's."""
    named: dict[str, Unusable] = {}
    for each in unusable:
        named[each.name if each.name not in usable and each.name not in named else f"{each.name} ({each.file})"] = each
    return named
