"""The modules that a script of the page imports, so that a browser asks for all at once."""

import re
from pathlib import Path

_IMPORTED = re.compile(r'^(?:import|export)\s(?:[^"\';]*?\sfrom\s+)?"(\.{1,2}/[^"]+)"', re.MULTILINE)


def modules_of(folder: Path, script: str) -> tuple[str, ...]:
    """Return the paths of a script and of what it imports statically, directly or not.

    A browser learns what a module imports only when it has the module, so each level of imports would wait for the
    level above.

    Args:
        folder: folder of the scripts.
        script: path in the folder, with slashes, as are those returned.
    """
    found: dict[str, None] = {}
    waiting = [script]
    while waiting:
        path = waiting.pop(0)
        if path not in found:
            found[path] = None
            file = folder / path
            imported = _IMPORTED.findall(file.read_text(encoding="utf-8"))
            waiting += [(file.parent / each).resolve().relative_to(folder.resolve()).as_posix() for each in imported]
    return tuple(found)
