"""What differs between two worlds of the same robot: one value each, by its place.

Changed masses, centres and inertias of a World's body are told as those of the file's bodies that it consists of.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from gaplab.services.core.arrays import FloatArray
from gaplab.services.robots.bodies import Bodies, rotation_of
from gaplab.services.robots.reading import body_name
from gaplab.services.world.world import UNTURNED, Body, Inertia, World

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


@dataclass(frozen=True)
class Inertial:
    """The new inertial of one body of a file.

    Attributes:
        body: its name.
        number: its number in MuJoCo's model.
        scale: factor of its mass, and of its inertia about its centre.
        moved_m: `(3,)`: shift of its centre of mass, in its frame.
        center_m: `(3,)`: its new centre of mass, in its frame.
        mass_kg: its new mass.
        moments_kg_m2: `(3,)`: its new principal moments.
        axes: rotation of the principal axes in its frame.
    """

    body: str
    number: int
    scale: float
    moved_m: FloatArray
    center_m: FloatArray
    mass_kg: float
    moments_kg_m2: FloatArray
    axes: Rotation

    @property
    def tensor(self) -> FloatArray:
        """Return `(3, 3)`: the inertia about the centre of mass, in the body's frame."""
        turn = self.axes.as_matrix()
        return np.asarray(turn @ np.diag(self.moments_kg_m2) @ turn.T)


def inertials(bodies: Bodies, head: int, before: Body, after: Body) -> list[Inertial] | None:
    """Return the inertials of the members of a body; None if several members cannot share its change.

    Masses of members change by the same factor, and their centres by the same shift. An inertia that changes by another
    factor than the mass is possible for a single member alone.

    Args:
        bodies: bodies of the file.
        head: number of the body.
        before: the body as imported.
        after: the changed body.
    """
    scale = after.mass_kg / before.mass_kg
    shared = [number for number in bodies.members(head) if bodies.model.body_mass[number] > 0]
    assert before.inertia is not None
    assert after.inertia is not None
    x, y, z = (scale * moment for moment in before.inertia.moments_kg_m2)
    is_scaled = same(Inertia((x, y, z), before.inertia.turn), after.inertia)
    if not is_scaled and len(shared) > 1:
        return None
    moved = np.array(after.center_m) - np.array(before.center_m)
    found = list(_of_members(bodies, head, shared, scale, moved))
    if is_scaled:
        return found
    ((only,), turn) = found, bodies.turn(shared[0], head)
    axes = turn.inv() * Rotation.from_quat(after.inertia.turn)
    return [replace(only, scale=float("nan"), moments_kg_m2=np.array(after.inertia.moments_kg_m2), axes=axes)]


def _of_members(bodies: Bodies, head: int, members: list[int], scale: float, moved_m: FloatArray) -> Iterator[Inertial]:
    model = bodies.model
    for number in members:
        shift = np.asarray(bodies.turn(number, head).inv().apply(moved_m))
        yield Inertial(
            body=body_name(model, number),
            number=number,
            scale=scale,
            moved_m=shift,
            center_m=model.body_ipos[number] + shift,
            mass_kg=float(model.body_mass[number]) * scale,
            moments_kg_m2=model.body_inertia[number] * scale,
            axes=rotation_of(model.body_iquat[number]),
        )
