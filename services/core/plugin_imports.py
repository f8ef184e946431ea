"""Import of external plug-ins without Python's cache of compiled files.

The cache tells files apart by size and second of the last change, so it may hold what a file was before an edit.
"""

import sys
from collections.abc import Sequence
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader
from types import CodeType, ModuleType


class _Uncached(SourceFileLoader):
    """A loader that compiles the file at each import."""

    def get_code(self, fullname: str) -> CodeType:
        """Return the compiled text of the file."""
        path = self.get_filename(fullname)
        return self.source_to_code(self.get_data(path), path)


class Uncached:
    """A finder of the modules of one package, which are imported without the cache.

    Args:
        package: name of the package.
    """

    def __init__(self, package: str) -> None:
        self._prefix = f"{package}."

    def find_spec(
        self, name: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Return where to import a module of the package from; None for any other module."""
        found = PathFinder.find_spec(name, path, target) if name.startswith(self._prefix) else None
        if found is not None and type(found.loader) is SourceFileLoader:
            found.loader, found.cached = _Uncached(name, found.loader.path), None
        return found


def import_uncached(package: str) -> None:
    """Import the modules of a package without the cache from now on; again, it does nothing."""
    if not any(isinstance(finder, Uncached) for finder in sys.meta_path):
        sys.meta_path.insert(0, Uncached(package))
