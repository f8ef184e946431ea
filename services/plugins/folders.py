"""External plug-ins: the files in the folders that GAPLAB_PLUGINS names.

Only the environment of a process can name a folder; no spec and no request can. Each process finds the plug-ins
itself: services and supervisors at their start, Ray's processes before their first task.
"""

import os
from functools import cache
from hashlib import sha256
from pathlib import Path

from gaplab.services.core import external_plugins

VARIABLE = "GAPLAB_PLUGINS"


@cache
def find() -> None:
    """Register the folders of GAPLAB_PLUGINS; later calls in this process do nothing.

    The variable becomes absolute, for processes that this one starts in other folders.
    """
    named = [folder for folder in os.environ.get(VARIABLE, "").split(os.pathsep) if folder]
    folders = tuple(Path(folder).expanduser().absolute() for folder in named)
    if folders:
        os.environ[VARIABLE] = os.pathsep.join(map(str, folders))
    external_plugins.set_folders(folders)


def load() -> None:
    """Find and import every plug-in, so that a process with a broken one does not start.

    Raises:
        PluginBroken: a file cannot be imported, or a class in it is not a valid plug-in.
    """
    from gaplab.services.plugins.catalogue import catalogue

    find()
    catalogue()


def digests() -> dict[str, str]:
    """Return a short hash of the content of each module in the folders and of each file in their packages.

    Other files, such as a database, are not part of a plug-in: its data belongs into a package.
    """
    hashes: dict[str, str] = {}
    for folder in external_plugins.folders():
        packages = sorted(path.parent for path in folder.glob("*/__init__.py"))
        for path in sorted([*folder.glob("*.py"), *(file for package in packages for file in package.rglob("*"))]):
            parts = path.relative_to(folder).parts
            if path.is_file() and not any(part.startswith(".") or part == "__pycache__" for part in parts):
                hashes["/".join(parts)] = sha256(path.read_bytes()).hexdigest()[:12]
    return hashes


def digest_of(file: str) -> str:
    """Return the digest of a plug-in's module; for a file in a package, that of the whole package."""
    hashes = digests()
    package, slash, _ = file.partition("/")
    if not slash:
        return hashes[file]
    inside = sorted(item for item in hashes.items() if item[0].startswith(f"{package}/"))
    return sha256(repr(inside).encode()).hexdigest()[:12]


def digest() -> str:
    """Return one digest for all external plug-ins, or "none" if there are none."""
    hashes = digests()
    return sha256(repr(sorted(hashes.items())).encode()).hexdigest()[:12] if hashes else "none"
