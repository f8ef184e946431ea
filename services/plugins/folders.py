"""Plug-ins of one's own: files in folders that GAPLAB_PLUGINS names.

Every process that runs gaplab's code finds them when it imports it, those that Ray starts too, which have no main of
ours to be told anything by. Only who starts a process can name a folder; no spec and no request can.
"""

import os
from hashlib import sha256
from pathlib import Path

from gaplab.services.core import external_plugins

VARIABLE = "GAPLAB_PLUGINS"


def look_where_the_environment_says() -> None:
    """Let registries find what is in the folders of GAPLAB_PLUGINS, and in no others.

    The variable is made absolute, for processes that this one starts elsewhere.
    """
    named = [each for each in os.environ.get(VARIABLE, "").split(os.pathsep) if each]
    folders = tuple(Path(each).expanduser().absolute() for each in named)
    if folders:
        os.environ[VARIABLE] = os.pathsep.join(map(str, folders))
    external_plugins.look_in(folders)


def load() -> None:
    """Import every plug-in now, so that one that is broken is known when a process starts.

    Raises:
        PluginBroken: a file cannot be imported, or what it has is no plug-in.
    """
    from gaplab.services.plugins.catalogue import catalogue

    catalogue()


def digests() -> dict[str, str]:
    """The modules of the folders and all that is in packages, each with twelve letters that change with its content.

    What else lies there, a database perhaps, is no part of a plug-in: data belongs into a package.
    """
    found: dict[str, str] = {}
    for folder in external_plugins.folders():
        packages = sorted(path.parent for path in folder.glob("*/__init__.py"))
        for path in sorted([*folder.glob("*.py"), *(each for package in packages for each in package.rglob("*"))]):
            parts = path.relative_to(folder).parts
            if path.is_file() and not any(each.startswith(".") or each == "__pycache__" for each in parts):
                found["/".join(parts)] = sha256(path.read_bytes()).hexdigest()[:12]
    return found


def digest_of(file: str) -> str:
    """That of a plug-in's file; of a package, which has more than one, of all that is in its folder."""
    found = digests()
    package, slash, _ = file.partition("/")
    if not slash:
        return found[file]
    inside = sorted(each for each in found.items() if each[0].startswith(f"{package}/"))
    return sha256(repr(inside).encode()).hexdigest()[:12]


def digest() -> str:
    """One for all of them; "none" if there are none."""
    found = digests()
    return sha256(repr(sorted(found.items())).encode()).hexdigest()[:12] if found else "none"
