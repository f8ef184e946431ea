"""The contract of a tunable: a number with bounds that edits a World."""

from abc import abstractmethod
from dataclasses import replace
from typing import Any, ClassVar

from gaplab.services.core.registry import Plugin
from gaplab.services.core.world import World


class Tunable(Plugin):
    """One parameter of the simulator.

    Attributes:
        field: World field that it edits, as named in the `honours` of engines.
        unit: unit of its value.
        lower, upper: default bounds.
        least, greatest: limits of meaningful values in any engine.
    """

    field: ClassVar[str]
    unit: ClassVar[str]
    lower: ClassVar[float]
    upper: ClassVar[float]
    least: ClassVar[float]
    greatest: ClassVar[float]

    @abstractmethod
    def read(self, world: World) -> float:
        """Return the parameter's value in the world."""

    @abstractmethod
    def edit(self, world: World, value: float) -> World:
        """Return the world with the parameter set to the value."""

    @classmethod
    def details(cls) -> dict[str, Any]:
        """Return field, unit and bounds, for the catalogue."""
        names = ("field", "unit", "lower", "upper", "least", "greatest")
        return {name: getattr(cls, name) for name in names}


class MaterialTunable(Tunable):
    """A coefficient of the material that robot and ground share; `name` says which."""

    unit = "1"

    def read(self, world: World) -> float:
        """Return the coefficient of the world's material."""
        return float(getattr(world.material, self._coefficient))

    def edit(self, world: World, value: float) -> World:
        """Return the world with the coefficient of its material replaced."""
        return replace(world, material=replace(world.material, **{self._coefficient: float(value)}))

    @property
    def _coefficient(self) -> str:
        return self.field.removeprefix("material.")
