"""Everything that this service can be asked to run."""

from dataclasses import asdict

from schemas.plugin import BudgetRead, Catalogue
from services.budgets import PRESETS
from services.core.optimizers import optimizers
from services.core.robots import robots
from services.core.strategies import strategies
from services.core.tunables import tunables
from services.engines import engines


def catalogue() -> Catalogue:
    """Every plug-in of every kind, by name."""
    return Catalogue(
        strategies=strategies.describe(),
        robots=robots.describe(),
        engines=engines.describe(),
        tunables=tunables.describe(),
        optimizers=optimizers.describe(),
        budgets=tuple(BudgetRead(name=name, **asdict(preset)) for name, preset in PRESETS.items()),
    )
