"""Blame: the plug-in whose code raised an error."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from traceback import walk_tb
from types import FrameType

from gaplab.services.core.errors import GaplabError, InvalidSpec, Violation
from gaplab.services.core.registry import EXTERNAL
from gaplab.services.specs.registries import REGISTRIES

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
    plugins = _plugins()
    for frame, line in reversed(list(walk_tb(error.__traceback__))):
        if named := next((plugins[place] for place in _places(frame) if place in plugins), None):
            return f"{named} raised {kind} ({Path(frame.f_code.co_filename).name}, line {line})"
    return kind


@contextmanager
def refusing_specs() -> Iterator[None]:
    """Refuse the spec at hand if an external plug-in raises; a mistake in gaplab itself stays an error of the service.

    Raises:
        InvalidSpec: an external plug-in raised; the violation, of the whole spec, names it.
    """
    try:
        yield
    except GaplabError:
        raise
    except (Exception, SystemExit) as error:
        if not is_external(error):
            raise
        raise InvalidSpec([Violation("", None, describe(error))]) from error


def is_external(error: BaseException) -> bool:
    """Return whether code of an external plug-in, or of a file that it imports, led to the error."""
    modules = (
        place.__module__ if isinstance(place, type) else str(place)
        for frame, _ in walk_tb(error.__traceback__)
        for place in _places(frame)
    )
    return any(module.partition(".")[0] == EXTERNAL for module in modules)


def _places(frame: FrameType) -> tuple[type, str | None]:
    """Return the class of the object whose method a frame runs, and the name of its module."""
    return type(frame.f_locals.get("self")), frame.f_globals.get("__name__")


def _plugins() -> dict[type | str | None, str]:
    """Return the kind and name of each plug-in, by its class and by its module; of several in a module, the first."""
    found: dict[type | str | None, str] = {}
    for registry in REGISTRIES.values():
        for name, plugin in registry.items():
            for place in (plugin, plugin.__module__):
                found.setdefault(place, f"{registry.kind} {name!r}")
    return found
