"""The shapes that draw a World: its bodies, the struts between joints and distant bodies, and the ground."""

import numpy as np

from gaplab.schemas.replays import Orientation, Position, Shape
from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.shapes import Box
from gaplab.services.core.world import Body, World

SLENDER = 0.4
"""Radius of a strut, as a factor of the radius of its body."""


def feet_of(world: World) -> tuple[int, ...]:
    """Return the indices of the feet: all bodies that collide with the ground, except the base."""
    return tuple(place for place, body in enumerate(world.bodies) if place and body.collides)


def labels(world: World) -> tuple[str, ...]:
    """Return the names of the feet without their common ending: `front_left_shin` becomes `front left`."""
    parts = [world.bodies[place].name.split("_") for place in feet_of(world)]
    while len(parts) > 1 and min(map(len, parts)) > 1 and len({each[-1] for each in parts}) == 1:
        parts = [each[:-1] for each in parts]
    return tuple(" ".join(each) for each in parts)


def shapes_of(world: World) -> tuple[Shape, ...]:
    """Return all visible shapes of a world."""
    ground = Shape(body=None, kind="plane", size_m=(), role="ground")
    return (ground, *(shape for place in range(len(world.bodies)) for shape in _shapes(world, place)))


def _shapes(world: World, place: int) -> tuple[Shape, ...]:
    body = world.bodies[place]
    box = isinstance(body.shape, Box)
    own = Shape(
        body=place,
        kind="box" if box else "sphere",
        size_m=body.shape.size_m if isinstance(body.shape, Box) else (body.shape.radius_m,),
        position_m=body.center_m,
        role="trunk" if place == 0 else "foot" if body.collides else "limb",
    )
    away = np.array(body.center_m)
    if place == 0 or np.linalg.norm(away) <= 1.001 * _reach(body):
        return (own,)
    return (_strut(place, away, SLENDER * _reach(body)), own)


def _reach(body: Body) -> float:
    return max(body.shape.size_m) / 2 if isinstance(body.shape, Box) else body.shape.radius_m


def _strut(place: int, away: FloatArray, radius_m: float) -> Shape:
    middle: Position = tuple((away / 2).tolist())
    size = (radius_m, float(np.linalg.norm(away)))
    return Shape(body=place, kind="capsule", size_m=size, position_m=middle, orientation=_from_z(away), role="limb")


def _from_z(away: FloatArray) -> Orientation:
    """Return the smallest rotation of the z axis onto the line of a vector, as a quaternion x, y, z, w."""
    x, y, z = (away if away[2] >= 0 else -away) / np.linalg.norm(away)
    rotation = np.array([-y, x, 0.0, 1.0 + z])
    rotation = rotation / np.linalg.norm(rotation) + 0.0
    return (float(rotation[0]), float(rotation[1]), float(rotation[2]), float(rotation[3]))
