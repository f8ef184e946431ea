"""The contract of a tunable: a number with bounds that edits a World."""

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import replace
from difflib import get_close_matches
from fnmatch import fnmatchcase
from typing import Annotated, Any, ClassVar

from pydantic import Field

from gaplab.schemas.base import Frozen
from gaplab.services.core.registry import Plugin
from gaplab.services.core.world import Material, World

LONGEST_PATTERN = 80

REBUILDS, SHARES, IN_PLACE = 0, 1, 2
"""Places in the order of edits."""


class Tunable(Plugin):
    """One parameter of the simulator.

    Attributes:
        field: World field that it edits, as named in the `honours` of engines; `noise` needs no engine.
        unit: unit of its value.
        lower, upper: default bounds.
        least, greatest: limits of meaningful values in any engine.
        also: names of other values of a World that it edits, so that they fit its field.
        relative: true if it changes what it finds, by a factor or a shift; then it always reads as the value that
            changes nothing.
        order: when it edits, among the tunables of a spec: `REBUILDS`, before all others, if it replaces what engines
            build; `SHARES` if what it replaces is the same for all its values; `IN_PLACE` if it replaces only what it
            names to `World.edited`.
    """

    field: str
    unit: str
    lower: float
    upper: float
    least: float
    greatest: float
    also: ClassVar[frozenset[str]] = frozenset()
    relative: bool = False
    order: ClassVar[int] = REBUILDS

    @abstractmethod
    def read(self, world: World) -> float:
        """Return the parameter's value in the world, at which `edit` leaves the world as it is."""

    @abstractmethod
    def edit(self, world: World, value: float) -> World:
        """Return the world with the parameter set to the value."""

    def bounds(self, world: World) -> tuple[float, float]:  # noqa: ARG002 - for those that depend on it
        """Return the default bounds for a robot."""
        return self.lower, self.upper

    def lack(self, world: World) -> tuple[str, tuple[str, ...]] | None:  # noqa: ARG002 - for those of parts
        """Return what the robot lacks for the tunable, as a sentence, and the permitted names; None if nothing."""
        return None

    @classmethod
    def details(cls) -> dict[str, Any]:
        """Return field, unit and bounds without options, for the catalogue."""
        tunable = cls()
        names = ("field", "unit", "lower", "upper", "least", "greatest")
        return {name: getattr(tunable, name) for name in names}


def matching(pattern: str, names: Sequence[str]) -> tuple[str, ...]:
    """Return the name that is the pattern itself, or else those that match it as one of `fnmatch`, in their order."""
    if pattern in names:
        return (pattern,)
    return tuple(name for name in names if fnmatchcase(name, pattern))


def lacking(kind: str, pattern: str, names: Sequence[str]) -> tuple[str, tuple[str, ...]] | None:
    """Return that no name matches a pattern, as a sentence, and the names; None if one does."""
    if matching(pattern, names):
        return None
    nearest = get_close_matches(pattern, names, n=1, cutoff=0.5)
    hint = f" (did you mean {nearest[0]!r}?)" if nearest else ""
    permitted = f"permitted: {', '.join(names)}, or a pattern with *" if names else "the robot has none"
    return f"{pattern!r} matches no {kind}{hint}; {permitted}", tuple(names)


class SurfaceOptions(Frozen):
    """Options of a coefficient of friction or restitution."""

    of: Annotated[str, Field(max_length=LONGEST_PATTERN)] = Field(
        default="", description="pattern of the names of surfaces; empty: the material of robot and ground"
    )


class MaterialTunable(Tunable):
    """A coefficient of the material that robot and ground share, or of surfaces of the robot."""

    unit = "1"
    order = IN_PLACE
    Options = SurfaceOptions
    options: SurfaceOptions

    def __init__(self, options: Frozen | None = None) -> None:
        super().__init__(options)
        self._coefficient = self.field.removeprefix("material.")
        if self.options.of:
            self.field = "surfaces"

    def read(self, world: World) -> float:
        """Return the coefficient; of several surfaces their mean."""
        if not self.options.of:
            return float(getattr(world.material, self._coefficient))
        chosen = matching(self.options.of, [name for name, _ in world.surfaces])
        values = [getattr(material, self._coefficient) for name, material in world.surfaces if name in chosen]
        return float(sum(values) / len(values))

    def edit(self, world: World, value: float) -> World:
        """Return the world with the coefficient replaced."""
        if not self.options.of:
            return replace(world, material=self.changed(world.material, value))
        chosen = matching(self.options.of, [name for name, _ in world.surfaces])
        surfaces = tuple(
            (name, self.changed(material, value) if name in chosen else material) for name, material in world.surfaces
        )
        return world.edited("surfaces", surfaces=surfaces)

    def changed(self, material: Material, value: float) -> Material:
        """Return a material with the coefficient replaced."""
        change = {self._coefficient: float(value)}
        return replace(material, **change)

    def lack(self, world: World) -> tuple[str, tuple[str, ...]] | None:
        """Return that the robot has no such surface."""
        return lacking("surface", self.options.of, [name for name, _ in world.surfaces]) if self.options.of else None
