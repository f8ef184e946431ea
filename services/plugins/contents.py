"""Contents of the plug-in folders: a hash of each file, and which files each plug-in is made of.

Two processes compute the same with a plug-in if its module, or its package, has the same content, and so has
everything in the folders that it imports.
"""

import ast
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import Path

from gaplab.services.core.registry import EXTERNAL

_ANY = "*"
"""Stands for all modules of the folders."""

_DYNAMIC = {"import_module", "__import__", "exec"}
"""A module that uses one of these names may import any other module."""

_UNREADABLE = "unreadable"


@dataclass(frozen=True, eq=False)
class Contents:
    """What the plug-in folders contained at one moment.

    Attributes:
        digests: a short hash of each module and of each file in a package.
        imports: the modules and packages of the folders that each module or package imports.
        files: all of these files, with the text of those in Python that could be read.
    """

    digests: Mapping[str, str] = field(default_factory=dict)
    imports: Mapping[str, frozenset[str]] = field(default_factory=dict)
    files: Mapping[Path, bytes | None] = field(default_factory=dict)

    def digest_of(self, file: str) -> str:
        """Return the hash of a module; for a file in a package, that of the whole package.

        Raises:
            KeyError: there is no such file.
        """
        package, slash, _ = file.partition("/")
        if not slash:
            return self.digests[file]
        inside = sorted(item for item in self.digests.items() if item[0].startswith(f"{package}/"))
        if not inside:
            raise KeyError(file)
        return sha256(repr(inside).encode()).hexdigest()[:12]

    def text_of(self, file: str) -> str | None:
        """Return a file with its hash, followed by those of all that it imports; None if it is gone."""
        top = module_of(file)
        reached, new = {top}, {top}
        while new := {name for each in new for name in self.imports.get(each, ())} - reached:
            reached |= new
        try:
            own = f"{file} {self.digest_of(file)}"
        except KeyError:
            return None
        files = sorted(each for each in map(self._file, reached - {top}) if each is not None)
        return ", ".join([own, *(f"{each} {self.digest_of(each)}" for each in files)])

    def _file(self, top: str) -> str | None:
        return next((file for file in (f"{top}.py", f"{top}/__init__.py") if file in self.digests), None)


def read(folders: Iterable[Path]) -> Contents:
    """Return what the plug-in folders contain.

    Files beside modules, such as a database, are not part of a plug-in: its data belongs into a package.
    """
    digests, imports, files = dict[str, str](), dict[str, frozenset[str]](), dict[Path, bytes | None]()
    for file, path in _files(folders):
        try:
            content = path.read_bytes()
        except OSError:
            digests[file], files[path] = _UNREADABLE, None
            continue
        digests[file] = sha256(content).hexdigest()[:12]
        files[path] = content if path.suffix == ".py" else None
        if path.suffix == ".py":
            imports[module_of(file)] = imports.get(module_of(file), frozenset()) | _imports(content, file)
    tops = frozenset(map(module_of, digests))
    found = {top: tops if _ANY in named else named & tops for top, named in imports.items()}
    return Contents(digests, found, files)


def state(folders: Iterable[Path]) -> tuple[tuple[str, int, int, int], ...]:
    """Return number, size and time of every file of the plug-ins: quick to read, and different after an edit."""
    found = []
    for file, path in _files(folders):
        with suppress(OSError):  # an editor replaces the file at this moment
            stat = path.stat()
            found.append((file, stat.st_ino, stat.st_size, stat.st_mtime_ns))
    return tuple(found)


def _files(folders: Iterable[Path]) -> Iterator[tuple[str, Path]]:
    for folder in folders:
        packages = sorted(path.parent for path in folder.glob("*/__init__.py"))
        for path in sorted([*folder.glob("*.py"), *(file for package in packages for file in package.rglob("*"))]):
            parts = path.relative_to(folder).parts
            if path.is_file() and not any(part.startswith(".") or part == "__pycache__" for part in parts):
                yield "/".join(parts), path


def module_of(file: str) -> str:
    """Return the module or package of a file."""
    return file.partition("/")[0].removesuffix(".py")


def _imports(content: bytes, file: str) -> frozenset[str]:
    """Return the modules of the folders that Python code imports; _ANY if that cannot be told."""
    try:
        nodes = list(ast.walk(ast.parse(content)))
    except (SyntaxError, ValueError):  # so nothing can import it
        return frozenset()
    return frozenset(name for node in nodes for name in _modules_in(node, file.count("/")))


def _modules_in(node: ast.AST, depth: int) -> Iterator[str]:
    """Yield the modules of the folders that one statement names; `depth` is the number of folders above its file."""
    match node:
        case ast.Name(id=name) | ast.Attribute(attr=name) if name in _DYNAMIC:
            yield _ANY
        case ast.Import():
            yield from _inside([alias.name.split(".") for alias in node.names])
        case ast.ImportFrom():
            package = node.module.split(".") if node.module else []
            relative = [EXTERNAL] if node.level == depth + 1 else []
            yield from _inside([[*relative, *package, alias.name] for alias in node.names])


def _inside(modules: list[list[str]]) -> Iterator[str]:
    """Yield the names that follow the package of external plug-ins."""
    for top, *names in modules:
        if top == EXTERNAL:
            yield names[0] if names else _ANY
