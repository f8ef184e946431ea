"""The contract of a tunable: a number with bounds that edits a World; and tunables of groups.

A tunable of a group is one number of all bodies, or of all joints, whose names match a pattern.
"""

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import replace
from difflib import get_close_matches
from fnmatch import fnmatchcase
from typing import Annotated, Any, ClassVar, Literal, NamedTuple

from pydantic import Field

from gaplab.schemas.base import Frozen
from gaplab.services.core.registry import Plugin
from gaplab.services.world.world import Body, Joint, Material, PDMotor, World

LONGEST_PATTERN = 80

REBUILDS, SHARES, IN_PLACE = 0, 1, 2
"""Places in the order of edits."""

BETWEEN = frozenset({"noise", "time_offset_s", "biases"})
"""Fields of a World that lie between physics and sensors: they change motions and readings, whatever the engine."""


class Tunable(Plugin):
    """One parameter of the simulator.

    Attributes:
        field: World field that it edits, as named in the `honours` of engines; those of `BETWEEN` need no engine.
        unit: unit of its value.
        lower, upper: default bounds.
        least, greatest: limits of meaningful values in any engine.
        also: names of other values of a World that it edits, so that they fit its field.
        relative: true if it changes what it finds, by a factor or a shift; then it always reads as the value that
            changes nothing.
        order: when it edits, among the tunables of a spec: `REBUILDS`, before all others, if it replaces what engines
            build; `SHARES` if what it replaces is the same for all its values; `IN_PLACE` if it replaces only what it
            names to `World.edited`.
        of_loops: true if it is of what a controller in a loop observes, false if it is of commands that are known in
            advance, and means nothing for other controllers; None if it is of all.
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
    of_loops: bool | None = None

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

    def sensors(self, world: World) -> tuple[str, ...]:  # noqa: ARG002 - for those of sensors
        """Return the names of the sensors that it is of, of which a robot must read one; empty if it is of none."""
        return ()

    @classmethod
    def details(cls) -> dict[str, Any]:
        """Return the field of the World that it edits, its unit and bounds, with default options, for the catalogue."""
        tunable = cls()
        names = ("field", "unit", "lower", "upper", "least", "greatest")
        return {name: getattr(tunable, name) for name in names}


class WorldTunable(Tunable):
    """A number of the world: the attribute `field`."""

    order = IN_PLACE

    def read(self, world: World) -> float:
        """Return the number."""
        return float(getattr(world, self.field))

    def edit(self, world: World, value: float) -> World:
        """Return the world with another number."""
        return world.edited(self.field, **{self.field: float(value)})


def matching(pattern: str, names: Sequence[str]) -> tuple[str, ...]:
    """Return the name that is the pattern itself, or else those that match it as one of `fnmatch`, in their order."""
    if pattern in names:
        return (pattern,)
    return tuple(name for name in names if fnmatchcase(name, pattern))


def lacking(kind: str, pattern: str, names: Sequence[str]) -> tuple[str, tuple[str, ...]] | None:
    """Return a sentence if no name matches a pattern, and the permitted names; None if one does."""
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
        """Return the world whose chosen surfaces have a value as the coefficient of this tunable."""
        if not self.options.of:
            return replace(world, material=self.changed(world.material, value))
        chosen = matching(self.options.of, [name for name, _ in world.surfaces])
        surfaces = tuple(
            (name, self.changed(material, value) if name in chosen else material) for name, material in world.surfaces
        )
        return world.edited("surfaces", surfaces=surfaces)

    def changed(self, material: Material, value: float) -> Material:
        """Return a material whose coefficient of this tunable has a value."""
        change = {self._coefficient: float(value)}
        return replace(material, **change)

    def lack(self, world: World) -> tuple[str, tuple[str, ...]] | None:
        """Return, if the robot has no such surface, a sentence and the permitted names."""
        return lacking("surface", self.options.of, [name for name, _ in world.surfaces]) if self.options.of else None


Pattern = Annotated[str, Field(min_length=1, max_length=LONGEST_PATTERN)]
ALL = "names of bodies, joints or motors by a pattern with * ? and [ ], as in shells"
HOW = "`scale`: a factor of each one's own number; `value`: the number itself, the same for all of the group"


class ScaleOptions(Frozen):
    """Options of a group's number that is usually scaled."""

    of: Pattern = Field(default="*", description=ALL)
    how: Literal["scale", "value"] = Field(default="scale", alias="as", description=HOW)


class ValueOptions(Frozen):
    """Options of a tunable of several bodies or joints whose quantity is often 0: by default set, and not scaled."""

    of: Pattern = Field(default="*", description=ALL)
    how: Literal["scale", "value"] = Field(default="value", alias="as", description=HOW)


class Limits(NamedTuple):
    """Default bounds, and limits of meaningful values."""

    lower: float
    upper: float
    least: float
    greatest: float


class Grouped(Tunable):
    """A physical quantity, here *the number*, of each member of a group, such as the mass of bodies.

    Attributes:
        kind: what has the number, for errors.
        value_unit: unit of the number.
        scale: bounds and limits of a factor.
        value: bounds and limits of the number.
        from_the_mean: true if the default bounds of the number are those of the factor, times the mean of the group.
    """

    kind: ClassVar[str]
    order = IN_PLACE
    value_unit: ClassVar[str]
    scale: ClassVar[Limits] = Limits(0.5, 1.5, 0.0, 100.0)
    value: ClassVar[Limits]
    from_the_mean: ClassVar[bool] = False
    options: ScaleOptions | ValueOptions

    def __init__(self, options: Frozen | None = None) -> None:
        super().__init__(options)
        self.relative = self.options.how == "scale"
        self.unit = "1" if self.relative else self.value_unit
        self.lower, self.upper, self.least, self.greatest = self.scale if self.relative else self.value

    def read(self, world: World) -> float:
        """Return 1 for a factor, else the number; of several members their mean."""
        if self.relative:
            return 1.0
        numbers = [self.number(member) for member in self._group(world)]
        return numbers[0] if len(set(numbers)) == 1 else sum(numbers) / len(numbers)  # a mean of equals may differ

    def edit(self, world: World, value: float) -> World:
        """Return the world with the number of each member replaced, or multiplied."""
        chosen = {member.name for member in self._group(world)}

        def edited(member: Any) -> Any:  # noqa: ANN401 - a Body or a Joint
            if member.name not in chosen:
                return member
            return self.with_number(member, self.number(member) * float(value) if self.relative else float(value))

        return self._in_world(world, tuple(map(edited, self.members(world))))

    def bounds(self, world: World) -> tuple[float, float]:
        """Return the default bounds: of numbers whose size depends on the robot, factors of their mean.

        The upper bound of others is at least twice the largest number of the group.
        """
        if self.relative or not (mean := self.read(world)):
            return self.lower, self.upper
        if self.from_the_mean:
            return self.scale.lower * mean, self.scale.upper * mean
        return self.lower, max(self.upper, 2 * max(self.number(member) for member in self._group(world)))

    def lack(self, world: World) -> tuple[str, tuple[str, ...]] | None:
        """Return, if the robot has nothing of this name, a sentence and the permitted names."""
        return lacking(self.kind, self.options.of, [each.name for each in self.members(world) if self.has(each)])

    def has(self, member: Any) -> bool:  # noqa: ANN401, ARG002 - a Body or a Joint
        """Return whether a member has the number."""
        return True

    @abstractmethod
    def members(self, world: World) -> Sequence[Any]:
        """Return the bodies or the joints of a world."""

    @abstractmethod
    def number(self, member: Any) -> float:  # noqa: ANN401 - a Body or a Joint
        """Return the number of a member."""

    @abstractmethod
    def with_number(self, member: Any, number: float) -> Any:  # noqa: ANN401 - a Body or a Joint
        """Return a member with another number."""

    @abstractmethod
    def _in_world(self, world: World, members: tuple[Any, ...]) -> World:
        """Return the world with other members."""

    def _group(self, world: World) -> list[Any]:
        able = [each for each in self.members(world) if self.has(each)]
        chosen = matching(self.options.of, [each.name for each in able])
        return [each for each in able if each.name in chosen]


class BodyTunable(Grouped):
    """A number of bodies, such as their mass."""

    kind = "body"

    def members(self, world: World) -> Sequence[Body]:
        """Return the bodies."""
        return world.bodies

    def _in_world(self, world: World, members: tuple[Body, ...]) -> World:
        return world.edited(self.field, bodies=members)


class JointTunable(Grouped):
    """A number of joints: the attribute whose name ends `field`."""

    kind = "joint"

    def members(self, world: World) -> Sequence[Joint]:
        """Return the joints."""
        return world.joints

    def number(self, member: Joint) -> float:
        """Return the attribute of a joint."""
        return float(getattr(member, self._attribute))

    def with_number(self, member: Joint, number: float) -> Joint:
        """Return a joint with another value of the attribute."""
        changes: dict[str, Any] = {self._attribute: number}
        return replace(member, **changes)

    def _in_world(self, world: World, members: tuple[Joint, ...]) -> World:
        return world.edited(self.field, joints=members)

    @property
    def _attribute(self) -> str:
        return self.field.rpartition(".")[2]


class MotorTunable(JointTunable):
    """A number of motors: the attribute whose name ends `field`, of those whose torque depends on it.

    Attributes:
        follows: kinds of PD motors whose torque depends on it.
    """

    kind = "joint with such a motor"
    follows: ClassVar[tuple[str, ...]] = ("position", "velocity", "torque")

    def has(self, member: Joint) -> bool:
        """Return whether the torque of a joint's motor depends on the number."""
        motor = member.motor
        follows = motor.follows if isinstance(motor, PDMotor) else self.follows[0]
        return hasattr(motor, self._attribute) and follows in self.follows

    def number(self, member: Joint) -> float:
        """Return the attribute of a joint's motor."""
        return float(getattr(member.motor, self._attribute))

    def with_number(self, member: Joint, number: float) -> Joint:
        """Return a joint whose motor has another value of the attribute."""
        assert member.motor is not None
        changes: dict[str, Any] = {self._attribute: number}
        return replace(member, motor=replace(member.motor, **changes))
