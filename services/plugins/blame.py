"""Blame: the plug-in whose code raised an error."""

from functools import cache
from pathlib import Path
from traceback import walk_tb

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
    for frame, line in reversed(list(walk_tb(error.__traceback__))):
        module = str(frame.f_globals.get("__name__"))
        if module in _plugins():
            return f"{_plugins()[module]} raised {kind} ({Path(frame.f_code.co_filename).name}, line {line})"
    return kind


@cache
def _plugins() -> dict[str, str]:
    """Return the kind and name of the plug-in of each module; of several in one module, the first."""
    found: dict[str, str] = {}
    for registry in REGISTRIES.values():
        for name, plugin in registry.items():
            found.setdefault(plugin.__module__, f"{registry.kind} {name!r}")
    return found
