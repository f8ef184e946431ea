"""Versions of external plug-ins, which are files in the folders of GAPLAB_PLUGINS."""

from collections.abc import Mapping
from functools import cache
from typing import Any

from gaplab.services.core.external_plugins import file_of
from gaplab.services.core.optimizers import optimizers
from gaplab.services.core.registry import Registry
from gaplab.services.core.robots import robots
from gaplab.services.core.strategies import strategies
from gaplab.services.core.tunables import tunables
from gaplab.services.engines import engines
from gaplab.services.plugins.folders import digest_of


def registries() -> tuple[Registry[Any], ...]:
    """Return the registries of all kinds."""
    return strategies, robots, engines, tunables, optimizers


@cache
def external_plugins() -> Mapping[str, str]:
    """Return the file and digest of each external plug-in, by its kind and name, as in `"robot hexapod"`."""
    return {
        f"{registry.kind} {name}": f"{file} {digest_of(file)}"
        for registry in registries()
        for name, plugin in registry.items()
        if (file := file_of(plugin)) is not None
    }
