"""Versions that all processes of a supervisor must share, so that a repetition has the same numbers in each of them.

gaplab and its libraries concern all work: a node that has others ends the supervisor. An external plug-in concerns
only the experiments that name it: a process that has another version refuses them, and does the others.
"""

import platform
import sys
from collections.abc import Mapping
from hashlib import sha256
from typing import Any, TextIO

from gaplab.schemas.provenance import Provenance
from gaplab.services.plugins import folders
from gaplab.services.plugins.external import unavailable
from gaplab.services.plugins.folders import PluginDiffers
from gaplab.services.running.versions import Versions as Versions
from gaplab.services.running.versions import named_versions, plugin_versions
from gaplab.services.running.versions import versions as versions
from gaplab.services.world import robot_library
from gaplab.workers.errors import ClusterUnusable

PLUGIN = "plug-in "
"""Begins the names of external plug-ins among versions."""

ROBOT = "robot "
"""Begins the names of robot files, whose texts are among versions."""


def with_plugins(shared: Versions, under: Provenance, spec: Mapping[str, Any]) -> Versions:
    """Return what a process must have for work on a spec that was claimed under a provenance.

    These are the shared versions of gaplab and its libraries, those of its plug-ins, and robot files.
    """
    files = robot_library.needed_by(spec)
    plugins = {f"{PLUGIN}{plugin}": text for plugin, text in named_versions(under, spec).items()}
    return shared | plugins | {f"{ROBOT}{place}": text for place, text in enumerate(files)}


def plugins_of(expected: Versions) -> str:
    """Return a hash of the expected plug-ins, which a process imports once; empty if there are none."""
    plugins = sorted(text for name, text in expected.items() if name.startswith(PLUGIN))
    return sha256(repr(plugins).encode()).hexdigest() if plugins else ""


def check_here(expected: Versions) -> None:
    """Check that this process has the expected versions, and learn the robot files that came with them.

    It imports the expected plug-ins and no others; their files only if they are the expected ones.

    Raises:
        ClusterUnusable: it lacks versions of gaplab or its libraries; the message says which.
        PluginDiffers: it lacks versions of plug-ins.
    """
    limit_prints()
    shared = {name: text for name, text in expected.items() if not name.startswith((PLUGIN, ROBOT))}
    wanted = {name.removeprefix(PLUGIN): text for name, text in expected.items() if name.startswith(PLUGIN)}
    compare(platform.node(), versions(), shared)
    folders.use(wanted)
    found = plugin_versions()
    if wrong := [plugin for plugin in wanted if found.get(plugin) != wanted[plugin]]:
        texts = {each: unavailable(each) or folders.differs(found.get(each, "none"), wanted[each]) for each in wrong}
        raise PluginDiffers(texts, wanted)
    robot_library.learn(text for name, text in expected.items() if name.startswith(ROBOT))


def compare(node: str, found: Versions, expected: Versions) -> None:
    """Check that a node has the expected versions; it may have others besides.

    Raises:
        ClusterUnusable: it has others; the message says which.
    """
    wrong = [name for name in expected if found.get(name) != expected[name]]
    if wrong:
        theirs, ours = (", ".join(f"{name} {has.get(name, 'none')}" for name in wrong) for has in (found, expected))
        msg = (
            f"the node {node} has {theirs} where the supervisor has {ours}: install the same on all nodes, "
            "or start the supervisor again if files were changed since it started"
        )
        raise ClusterUnusable(msg)


LONGEST = 1_000_000
"""Characters of what is printed at once: Ray never cuts a line."""


def limit_prints() -> None:
    """Cut the long texts that this process prints from now on."""
    for stream in (sys.stdout, sys.stderr):
        if not hasattr(stream, "is_limited"):
            _limit(stream)


def _limit(stream: TextIO) -> None:
    write = stream.write

    def write_short(text: str) -> int:
        if len(text) <= LONGEST:
            return write(text)
        write(f"{text[:LONGEST]}… ({len(text) - LONGEST:,} more characters)\n")
        return len(text)

    stream.write = write_short  # type: ignore[method-assign]
    stream.is_limited = True  # type: ignore[attr-defined]
