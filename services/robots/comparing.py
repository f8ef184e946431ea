"""What differs between two worlds of the same robot: one value each, by its place; and how far rollouts are apart.

Changed masses, centres and inertias of a World's body are told as those of the file's bodies that it consists of.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Any

import numpy as np
from numpy.random import default_rng
from scipy.spatial.transform import Rotation

from gaplab.schemas.plugin import PluginRef
from gaplab.services.core.arrays import FloatArray, frozen, known
from gaplab.services.core.errors import InvalidRobot
from gaplab.services.engines import engines
from gaplab.services.engines.base import Engine
from gaplab.services.engines.mujoco.plain import plain_positions
from gaplab.services.robots.bodies import Bodies, rotation_of, tensor
from gaplab.services.robots.reading import body_name
from gaplab.services.world.controllers import controllers
from gaplab.services.world.motions import Motion
from gaplab.services.world.tasks import tasks
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
        one, other = (tensor(each.moments_kg_m2, Rotation.from_quat(each.turn)) for each in (first, second))
        return bool(np.allclose(one, other, rtol=SAME, atol=SAME * max(first.moments_kg_m2)))
    if is_dataclass(first) and type(first) is type(second):
        return all(same(getattr(first, field.name), getattr(second, field.name)) for field in fields(first))
    if isinstance(first, tuple) and isinstance(second, tuple):
        return len(first) == len(second) and all(map(same, first, second))
    if isinstance(first, float | int) and isinstance(second, float | int):
        return bool(np.isclose(first, second, rtol=SAME, atol=SAME * 1e-3))
    return bool(first == second)


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
    """The new inertial of one body of a file; places and axes are in its frame.

    Attributes:
        number: its number in MuJoCo's model.
        scale: factor of its mass, and of its inertia about its centre.
        moved_m: `(3,)`: shift of its centre of mass.
        axes: rotation of the principal axes.
    """

    body: str
    number: int
    scale: float
    moved_m: FloatArray
    center_m: FloatArray
    mass_kg: float
    moments_kg_m2: FloatArray
    axes: Rotation


def inertials(bodies: Bodies, head: int, before: Body, after: Body) -> list[Inertial] | None:
    """Return the inertials of the members of a body; None if several members cannot share its change.

    Masses of members change by the same factor, and their centres by the same shift. An inertia that changes by another
    factor than the mass is possible for a single member alone.
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


ROLLOUTS = 5
COMPARED_S = frozen(np.arange(1, 11) / 10)
"""Times at which rollouts are compared. After a second, contacts have made rounding large in any robot that falls."""

SAME_M = 1e-6
"""Distance that rounding explains in any engine."""

AS_ROUNDING = 3.0
"""Factor of the distance by which a change of the last bits of all masses moves a robot in the same engine: where a
hull meets the ground, an engine may choose other points of contact."""

LAST_BITS = 1 + 2.0**-50


def check_rollouts(first: World, second: World, engine: Engine, controller: PluginRef, task: PluginRef) -> float:
    """Return the largest distance between the observed bodies of two worlds in rollouts of the same genomes, m.

    The genomes are drawn from the space of the controller, always the same ones.

    Raises:
        InvalidSpec: the controller or the task is not installed here.
        InvalidRobot: the distance is larger than rounding explains, or the physics fails in one of the worlds alone, or
            in all rollouts.
    """
    motions = _motions(first, controller, task)
    paths = [engine.rollouts([world], motions).positions_m for world in (first, second)]
    if not np.array_equal(np.isnan(paths[0]), np.isnan(paths[1])):
        raise InvalidRobot(["the physics fails in the tuned world or in that of the new file, but not in both"])
    if np.isnan(paths[0]).all():
        raise InvalidRobot(["the physics fails in every rollout of the tuned world, so nothing can be compared"])
    largest = _distance_m(*paths)
    if largest > SAME_M:
        by_rounding = _distance_m(paths[0], engine.rollouts([_rounded(first)], motions).positions_m)
        permitted = max(SAME_M, AS_ROUNDING * by_rounding)
        if largest > permitted:
            far = f"rollouts in the world of the new file are up to {largest:.3g} m from those in the tuned one"
            raise InvalidRobot([f"{far}; permitted: at most {permitted:.3g} m"])
    return largest


def plain_distance_m(world: World, engine: Engine, controller: PluginRef, task: PluginRef) -> float | None:
    """Return the largest distance of the same rollouts from those in MuJoCo alone, m.

    None if the physics fails in either, if the controller observes while it acts, without MuJoCo, or if
    it refuses the world.
    """
    motions = _motions(world, controller, task)
    if not engines["mujoco"].available() or not isinstance(motions[0], Motion):
        return None
    here = engine.rollouts([world], motions).positions_m[:, 0]
    try:
        plain = [plain_positions(world, motion) for motion in motions]
    except InvalidRobot:
        return None
    return known(np.linalg.norm(plain - here, axis=-1).max())


def _motions(world: World, controller: PluginRef, task: PluginRef) -> Any:  # noqa: ANN401 - all of one kind
    """Return the motions of the same genomes, observed at `COMPARED_S`."""
    driver = controllers.create(controller)
    driver.prepare(world, tasks.create(task).observe_s)
    genomes = driver.space.draw(ROLLOUTS, default_rng(0))
    return [driver.motion(genome).observed_at(COMPARED_S) for genome in genomes]


def _distance_m(first: FloatArray, second: FloatArray) -> float:
    return float(np.nanmax(np.linalg.norm(first - second, axis=-1), initial=0.0))


def _rounded(world: World) -> World:
    return replace(world, bodies=tuple(replace(body, mass_kg=body.mass_kg * LAST_BITS) for body in world.bodies))
