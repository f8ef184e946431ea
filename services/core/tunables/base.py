"""What a tunable is: a number with bounds, and how it edits a World."""

from abc import abstractmethod
from dataclasses import replace
from typing import Any, ClassVar

from gaplab.services.core.registry import Plugin
from gaplab.services.core.world import World


class Tunable(Plugin):
    """One parameter of the simulator.

    Attributes:
        field: the World field that it edits, as engines declare it in `honours`.
        unit: of its value.
        lower, upper: its bounds when a spec names none.
        least, greatest: beyond these it means nothing, in any engine.
    """

    field: ClassVar[str]
    unit: ClassVar[str]
    lower: ClassVar[float]
    upper: ClassVar[float]
    least: ClassVar[float]
    greatest: ClassVar[float]

    @abstractmethod
    def read(self, world: World) -> float:
        """The parameter's value in the world."""

    @abstractmethod
    def edit(self, world: World, value: float) -> World:
        """The world with the parameter set to the value."""

    @classmethod
    def details(cls) -> dict[str, Any]:
        """The field, the unit and the bounds."""
        names = ("field", "unit", "lower", "upper", "least", "greatest")
        return {name: getattr(cls, name) for name in names}


class MaterialTunable(Tunable):
    """A coefficient of the one material that robot and ground share; its file names which."""

    unit = "1"

    def read(self, world: World) -> float:
        """The coefficient of the world's material."""
        return float(getattr(world.material, self._coefficient))

    def edit(self, world: World, value: float) -> World:
        """The world with that coefficient of its material replaced."""
        return replace(world, material=replace(world.material, **{self._coefficient: float(value)}))

    @property
    def _coefficient(self) -> str:
        return self.field.removeprefix("material.")
