"""Blame: the plug-in whose code raised an error."""

from functools import lru_cache
from pathlib import Path
from traceback import walk_tb
from types import ModuleType

from gaplab.services.core import external_plugins
from gaplab.services.plugins.external import REGISTRIES

LONGEST = 2_000
"""Characters of a described error."""


def describe(error: BaseException) -> str:
    """Return one sentence: plug-in and line if a plug-in raised the error, its type, and its message."""
    try:
        message = str(error)
    except Exception:  # noqa: BLE001 - a plug-in's error may do anything
        message = "its message cannot be shown"
    text = f"{raised(error)}: {message}" if message else raised(error)
    return text if len(text) <= LONGEST else f"{text[: LONGEST - 2]} …"


def raised(error: BaseException) -> str:
    """Return the sentence without the message, which may name hidden parameters."""
    kind = type(error).__name__
    plugins = _plugins(external_plugins.package())
    for frame, line in reversed(list(walk_tb(error.__traceback__))):
        places = (type(frame.f_locals.get("self")), frame.f_globals.get("__name__"))
        if named := next((plugins[place] for place in places if place in plugins), None):
            return f"{named} raised {kind} ({Path(frame.f_code.co_filename).name}, line {line})"
    return kind


@lru_cache(maxsize=1)
def _plugins(_package: ModuleType | None) -> dict[type | str | None, str]:
    """Return the kind and name of each plug-in, by its class and by its module; of several in a module, the first.

    Args:
        _package: the package of external plug-ins, another one after each import of them.
    """
    found: dict[type | str | None, str] = {}
    for registry in REGISTRIES.values():
        for name, plugin in registry.items():
            for place in (plugin, plugin.__module__):
                found.setdefault(place, f"{registry.kind} {name!r}")
    return found
