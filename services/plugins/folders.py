"""External plug-ins: the files in the folders that GAPLAB_PLUGINS names.

Only the environment of a process can name a folder; no spec and no request can. Each process imports the plug-ins
itself, once: services and supervisors all of them at their start, processes that compute those of their first task.
"""

import logging
import os
import platform
from collections.abc import Mapping
from pathlib import Path

from gaplab.services.core.errors import GaplabError
from gaplab.services.plugins import contents, loading
from gaplab.services.plugins.contents import Contents, module_of
from gaplab.services.plugins.threads import leave_threads
from gaplab.services.specs.registries import REGISTRIES

VARIABLE = "GAPLAB_PLUGINS"

log = logging.getLogger("gaplab.plugins")


class PluginDiffers(GaplabError):
    """A process has other versions of the external plug-ins that a spec names, or cannot use them.

    Args:
        differences: a sentence for each plug-in, by its kind and name.
        expected: the version of each that the supervisor has.
    """

    def __init__(self, differences: Mapping[str, str], expected: Mapping[str, str]) -> None:
        self.differences, self.expected = dict(differences), dict(expected)
        super().__init__(self.differences, self.expected)  # the arguments, so that it can be pickled

    def __str__(self) -> str:
        """Return the sentences."""
        return "; ".join(self.differences.values())


def named() -> tuple[Path, ...]:
    """Return the folders of GAPLAB_PLUGINS.

    The variable becomes absolute, for processes that this one starts in other folders.
    """
    texts = [folder for folder in os.environ.get(VARIABLE, "").split(os.pathsep) if folder]
    folders = tuple(Path(folder).expanduser().absolute() for folder in texts)
    if folders:
        os.environ[VARIABLE] = os.pathsep.join(map(str, folders))
    return folders


def load(*, warn: bool = False) -> None:
    """Import every plug-in, and perhaps warn of those that cannot be used; later calls in this process do nothing."""
    if loading.here() is None:
        leave_threads()
        loaded = loading.load(named())
        if warn:
            _warn(loaded)


def use(wanted: Mapping[str, str]) -> None:
    """Import the modules of these plug-ins and no others: a module may change gaplab for all that a process does.

    Args:
        wanted: the files of each plug-in with their hashes, the first its own, by kind and name; what follows them does
            not matter here.

    Raises:
        PluginDiffers: the files of this process are others. It has imported none, for nothing undoes an import.
    """
    loaded, folders = loading.here(), named()
    found = loaded.contents if loaded else contents.read(folders) if wanted else Contents()
    files = {plugin: found.text_of(text.partition(" ")[0]) or "none" for plugin, text in wanted.items()}
    if wrong := [plugin for plugin, file in files.items() if not wanted[plugin].startswith(file)]:
        raise PluginDiffers({plugin: differs(files[plugin], wanted[plugin]) for plugin in wrong}, wanted)
    if loaded is None:
        leave_threads()
        loading.load(folders, {module_of(text.partition(" ")[0]) for text in wanted.values()}, found)


def differs(found: str, wanted: str) -> str:
    """Return the sentence on a plug-in that this process has in another version than is wanted."""
    return (
        f"a process on {platform.node()} has {found}, where {wanted} is wanted: put the same file on all nodes, and "
        "start the service again if it was edited"
    )


def _warn(loaded: loading.Loaded) -> None:
    for folder in loaded.folders:
        if not folder.is_dir():
            log.warning("there is no plug-in folder %s, which %s names", folder, VARIABLE)
    unusable = {name: why for registry in REGISTRIES.values() for name, why in registry.unusable.items()}
    for name, why in unusable.items():
        log.warning("the plug-in %r is not available: %s", name, why)
    for ignored in loaded.ignored:
        log.warning("%s in a plug-in folder is not used: %s", ignored.file, ignored.why)
