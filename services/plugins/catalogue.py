"""The catalogue: everything that specs can name."""

from collections.abc import Sequence
from dataclasses import asdict

from gaplab.schemas.plugin import BudgetRead, Catalogue, PluginRead
from gaplab.schemas.spec import StudySpec
from gaplab.services.core.discrepancies import discrepancies
from gaplab.services.core.optimizers import optimizers
from gaplab.services.core.strategies import strategies
from gaplab.services.core.tuners import tuners
from gaplab.services.engines import engines
from gaplab.services.plugins.loading import here
from gaplab.services.specs.defaults import PRESETS, default_engine
from gaplab.services.world.controllers import controllers
from gaplab.services.world.robot_library import IMPORTED
from gaplab.services.world.robots import robots
from gaplab.services.world.tasks import tasks
from gaplab.services.world.tunables import tunables


def catalogue(stored: Sequence[PluginRead] = ()) -> Catalogue:
    """Return every plug-in of every kind, by name, with the stored robots, and the named budgets."""
    own = [robot for robot in robots.describe() if robot.name != IMPORTED]
    return Catalogue(
        strategies=strategies.describe(),
        robots=(*map(_with_engine_of_here, own), *stored),
        engines=engines.describe(),
        tunables=tunables.describe(),
        optimizers=optimizers.describe(),
        discrepancies=discrepancies.describe(),
        controllers=controllers.describe(),
        tasks=tasks.describe(),
        tuners=tuners.describe(),
        budgets=tuple(BudgetRead(name=name, **asdict(preset)) for name, preset in PRESETS.items()),
        ignored=loaded.ignored if (loaded := here()) else (),
        defaults=StudySpec().model_dump(mode="json", exclude_none=True),
    )


def _with_engine_of_here(robot: PluginRead) -> PluginRead:
    """Return a robot's entry with the engine that a spec without one gets on this machine."""
    if not robot.available or "engine" not in robot.details:
        return robot
    return robot.model_copy(update={"details": robot.details | {"engine": default_engine(robots[robot.name])}})
