"""External plug-ins: the files in the folders that GAPLAB_PLUGINS names.

Only the environment of a process can name a folder; no spec and no request can. Each process finds the plug-ins
itself: services and supervisors at their start, Ray's processes before their first task.
"""

import logging
import os
from collections.abc import Iterable
from functools import cache
from pathlib import Path

from gaplab.services.core import external_plugins
from gaplab.services.plugins.contents import module_of
from gaplab.services.plugins.external import REGISTRIES
from gaplab.services.plugins.ignored import ignored_files
from gaplab.services.plugins.threads import leave_threads
from gaplab.services.plugins.watching import imported

VARIABLE = "GAPLAB_PLUGINS"

log = logging.getLogger("gaplab.plugins")


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


def use(files: Iterable[str]) -> None:
    """Import the modules of these files and no others: a module may change gaplab for all that a process does.

    The files are as `imported_files` has them: those of each plug-in, the first its own, with their hashes.
    """
    find()
    if external_plugins.chosen() != (modules := frozenset(module_of(text.split()[0]) for text in files)):
        external_plugins.set_folders(external_plugins.named_folders(), modules)
    leave_threads()
    imported.contents()


@cache
def load() -> None:
    """Find and import every plug-in, and warn of those that cannot be used; later calls do nothing."""
    find()
    leave_threads()
    imported.contents()
    for folder in external_plugins.named_folders():
        if not folder.is_dir():
            log.warning("there is no plug-in folder %s, which %s names", folder, VARIABLE)
    unusable = {name: why for registry in REGISTRIES.values() for name, why in registry.unusable.items()}
    for name, why in unusable.items():
        log.warning("the plug-in %r is not available: %s", name, why)
    for ignored in ignored_files():
        log.warning("%s in a plug-in folder is not used: %s", ignored.file, ignored.why)
