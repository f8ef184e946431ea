"""What differs between two worlds of the same robot: one value each, by its place."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields, is_dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.shapes import UNTURNED
from gaplab.services.core.world import Inertia, World

Place = tuple[str, str, str]
"""`bodies`, `joints` or `world`; name of the body or the joint; name of the value, like `motor.kp`."""

SAME = 1e-9
"""Largest difference, as a share or in SI units, that rounding explains."""

_NESTED = ("motor", "material", "noise")
_WHOLE = ("bodies", "joints", "origin", "edits")


@dataclass(frozen=True)
class Change:
    """A value that differs."""

    place: Place
    before: Any
    after: Any

    def __str__(self) -> str:
        """Return the change in words."""
        _, name, value = self.place
        return f"{name + ': ' if name else ''}{value} {_short(self.before)} → {_short(self.after)}"


def changes(before: World, after: World) -> list[Change]:
    """Return every value that differs by more than rounding, in the order of the world."""
    first, second = dict(_values(before)), dict(_values(after))
    places = [*first, *(place for place in second if place not in first)]
    pairs = [(place, first.get(place), second.get(place)) for place in places]
    return [Change(place, old, new) for place, old, new in pairs if not same(old, new)]


def same(first: Any, second: Any) -> bool:  # noqa: ANN401 - any value of a world
    """Return whether two values of a world are equal but for rounding."""
    if isinstance(first, Inertia) and isinstance(second, Inertia):
        return bool(np.allclose(_tensor(first), _tensor(second), rtol=SAME, atol=SAME * max(first.moments_kg_m2)))
    if is_dataclass(first) and type(first) is type(second):
        return all(same(getattr(first, field.name), getattr(second, field.name)) for field in fields(first))
    if isinstance(first, tuple) and isinstance(second, tuple):
        return len(first) == len(second) and all(map(same, first, second))
    if isinstance(first, float | int) and isinstance(second, float | int):
        return bool(np.isclose(first, second, rtol=SAME, atol=SAME * 1e-3))
    return bool(first == second)


def _tensor(inertia: Inertia) -> FloatArray:
    """Return `(3, 3)`: the inertia in the frame of the body; equal moments have no axes of their own."""
    turn = Rotation.from_quat(inertia.turn).as_matrix()
    return np.asarray(turn @ np.diag(inertia.moments_kg_m2) @ turn.T)


def _values(world: World) -> Iterator[tuple[Place, Any]]:
    for kind, members in (("bodies", world.bodies), ("joints", world.joints)):
        for member in members:
            for name, value in _flat(member, ()):
                yield (kind, member.name, name), value
    for name, value in _flat(world, _WHOLE):
        yield ("world", "", name), value


def _flat(owner: Any, without: Sequence[str]) -> Iterator[tuple[str, Any]]:  # noqa: ANN401 - a dataclass
    for field in fields(owner):
        value = getattr(owner, field.name)
        if field.name in _NESTED and is_dataclass(value):
            yield f"{field.name}.kind", type(value).__name__
            for inner in fields(value):
                yield f"{field.name}.{inner.name}", getattr(value, inner.name)
        elif field.name not in without:
            yield field.name, value


def _short(value: Any) -> str:  # noqa: ANN401 - any value of a world
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, tuple) and all(isinstance(each, float) for each in value):
        return "(" + ", ".join(f"{each:.6g}" for each in value) + ")"
    if isinstance(value, Inertia):
        turned = "" if value.turn == UNTURNED else f" turned by {_short(value.turn)}"
        return f"{_short(value.moments_kg_m2)}{turned}"
    return str(value)
