"""The text by which an experiment tells which of its plug-ins a supervisor cannot use."""

import re
from collections.abc import Mapping

from gaplab.services.plugins.external import REGISTRIES, unavailable

_FIRST = re.compile(rf"((?:{'|'.join(REGISTRIES)}) .{{1,100}}?) \(unavailable: ", re.DOTALL)


def text_of(reasons: Mapping[str, str]) -> str:
    """Return the text of plug-ins that cannot be used, each with the reason."""
    return ", ".join(f"{plugin} (unavailable: {why})" for plugin, why in reasons.items())


def tells_unavailable(text: str) -> bool:
    """Return whether a text is one of plug-ins that cannot be used."""
    return _FIRST.match(text) is not None


def still_holds(text: str, refused: Mapping[str, str]) -> bool:
    """Return whether the first plug-in of such a text cannot be used by this process either.

    Args:
        text: of any supervisor.
        refused: plug-ins that processes of this supervisor refuse, by kind and name.
    """
    first = _FIRST.match(text)
    return first is not None and (first[1] in refused or unavailable(first[1]) is not None)
