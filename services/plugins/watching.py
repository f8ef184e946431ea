"""Edits of external plug-ins: the contents of their folders now, and when this process imported them."""

import logging
from collections.abc import Callable
from threading import Lock
from time import monotonic

from gaplab.services.core import external_plugins
from gaplab.services.plugins import contents
from gaplab.services.plugins.contents import Contents

log = logging.getLogger("gaplab.plugins")

LOOK_S = 1.0
"""Shortest time between two looks for edited files."""

TRIES = 3
"""Most imports of files that are edited meanwhile."""


class FolderWatch:
    """The contents of the plug-in folders, read again after an edit; `clock` returns seconds."""

    def __init__(self, clock: Callable[[], float] = monotonic) -> None:
        self._clock = clock
        self._looked = -LOOK_S
        self._state: tuple[object, contents.State] | None = None
        self._contents = Contents()

    def __reduce__(self) -> tuple[type["FolderWatch"], tuple[()]]:
        """Let another process, to which Ray sends this with a function, look at its own folders."""
        return FolderWatch, ()

    def contents(self) -> Contents:
        """Return the contents, at most `LOOK_S` old; the same object as long as they do not change."""
        package, now = external_plugins.package(), self._clock()
        if self._state is None or self._state[0] is not package or now - self._looked >= LOOK_S:
            self._looked = now
            state = package, contents.state()
            if state != self._state:
                self._state, self._contents = state, contents.read()
        return self._contents


class Imported:
    """The contents of the plug-in folders as this process imported them."""

    def __init__(self) -> None:
        self._package: object = None
        self._contents = Contents()

    def __reduce__(self) -> tuple[type["Imported"], tuple[()]]:
        """Let another process, to which Ray sends this with a function, tell what it imported itself."""
        return Imported, ()

    def contents(self) -> Contents:
        """Return the contents of the imported files; the first call imports them."""
        if self._package is None or self._package is not external_plugins.package():
            self._contents = _import()
            self._package = external_plugins.package()
        return self._contents


def _import() -> Contents:
    """Import the plug-ins, again if a file is edited meanwhile, and return what was imported.

    If they were imported before, their files may have been edited since, so they are imported again.
    """
    if external_plugins.named_folders() and external_plugins.are_loaded():
        external_plugins.import_again()
    for _ in range(TRIES):
        before = contents.read()
        external_plugins.loaded()
        if contents.read().digests == before.digests:
            break
        external_plugins.import_again()
    return before


present = FolderWatch().contents
imported = Imported()
_RELOADING = Lock()


def reload() -> bool:
    """Import the plug-ins of this process again if a file was edited, added or removed; return whether.

    Work that has begun keeps the classes that it was created from.
    """
    if present().digests == imported.contents().digests:
        return False
    with _RELOADING:
        if contents.read().digests == imported.contents().digests:
            return False
        external_plugins.import_again()
        imported.contents()
    log.info("the plug-ins were imported again, since their files were changed")
    return True
