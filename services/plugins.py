"""Plug-ins of one's own: files in folders that GAPLAB_PLUGINS names.

Every process that runs gaplab's code finds them when it imports it, those that Ray starts too, which have no main of
ours to be told anything by. Only who starts a process can name a folder; no spec and no request can.
"""

import os
from hashlib import sha256
from pathlib import Path

from services.core import outside

VARIABLE = "GAPLAB_PLUGINS"


def look_where_the_environment_says() -> None:
    """Let registries find what is in the folders of GAPLAB_PLUGINS, and in no others.

    The variable is made absolute, for processes that this one starts elsewhere.
    """
    named = [each for each in os.environ.get(VARIABLE, "").split(os.pathsep) if each]
    folders = tuple(Path(each).expanduser().absolute() for each in named)
    if folders:
        os.environ[VARIABLE] = os.pathsep.join(map(str, folders))
    outside.look_in(folders)


def load() -> None:
    """Import every plug-in now, so that one that is broken is known when a process starts.

    Raises:
        PluginBroken: a file cannot be imported, or what it has is no plug-in.
    """
    from services.catalogue import catalogue

    catalogue()


def digests() -> dict[str, str]:
    """The files of the folders, each with twelve letters that change with its content; none without folders."""
    found = {}
    for folder in outside.folders():
        for path in sorted(folder.rglob("*")):
            parts = path.relative_to(folder).parts
            if path.is_file() and not any(each.startswith(".") or each == "__pycache__" for each in parts):
                found["/".join(parts)] = sha256(path.read_bytes()).hexdigest()[:12]
    return found


def digest() -> str:
    """One for all of them; "none" if there are none."""
    found = digests()
    return sha256(repr(sorted(found.items())).encode()).hexdigest()[:12] if found else "none"
