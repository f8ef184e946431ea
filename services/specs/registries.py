"""The plug-ins that specs name, by kind."""

from collections.abc import Mapping
from typing import Any

from gaplab.services.core.discrepancies import discrepancies
from gaplab.services.core.optimizers import optimizers
from gaplab.services.core.registry import Registry
from gaplab.services.core.strategies import strategies
from gaplab.services.core.tuners import tuners
from gaplab.services.engines import engines
from gaplab.services.world.controllers import controllers
from gaplab.services.world.robots import robots
from gaplab.services.world.tasks import tasks
from gaplab.services.world.tunables import tunables

REGISTRIES: Mapping[str, Registry[Any]] = {
    registry.kind: registry
    for registry in (strategies, robots, controllers, tasks, engines, tunables, optimizers, discrepancies, tuners)
}
"""The plug-ins of each kind."""
