"""The shapes that draw a World: the parts of its bodies, struts to bodies far from their joints, and the ground."""

from functools import lru_cache
from itertools import product

import numpy as np
import scipy

from gaplab.schemas.replays import Framing, Orientation, Position, RobotShapes, Shape, ShapeRole
from gaplab.services.core.arrays import FloatArray
from gaplab.services.world.kinematics import TOUCHING_M, body_poses, chain, clearances_m, rotated
from gaplab.services.world.world import Box, Capsule, Cylinder, Hull, Part, Vector, World
from gaplab.services.world.world import Shape as Solid

Face = tuple[int, ...]
"""Places of its corners, anticlockwise as seen from outside."""

SIGNS = tuple(product((-0.5, 0.5), repeat=3))
BOX: tuple[Face, ...] = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))

SLENDER = 0.4
"""Radius of a strut, as a factor of the radius of its part."""

MOST_FEET = 8
"""Largest number of feet of which a replay tells the contacts."""

USUAL_SIZE_M = 0.75
"""Diagonal of the box round a robot that the camera sees from its usual distance; the quadruped has 0.6."""

LOOKED_AT_M = 0.12
"""Least height that the camera looks at from there."""


def observed_of(world: World) -> int:
    """Return the index of the body whose motion fitness rates."""
    names = [body.name for body in world.bodies]
    return names.index(world.observed) if world.observed else 0


def feet_of(world: World) -> tuple[int, ...]:
    """Return the indices of the feet: bodies that collide with the ground and carry no other such body.

    The base is not a foot. If only one body of a robot that moves would be left, as in a snake, all bodies that collide
    are feet; of more than `MOST_FEET`, some are taken at equal distances in the list of bodies.
    """
    touching = [place for place, body in enumerate(world.bodies) if place and body.touches]
    carriers = (number for place in touching for number in chain(world, world.bodies[place].name))
    carrying = {world.joints[number].parent for number in carriers}
    outer = [place for place in touching if world.bodies[place].name not in carrying]
    feet = outer if len(outer) > 1 or world.fixed else touching
    chosen = np.linspace(0, len(feet) - 1, min(len(feet), MOST_FEET)).round().astype(int)
    return tuple(feet[place] for place in chosen)


def labels(world: World) -> tuple[str, ...]:
    """Return the names of the feet without their common ending: `front_left_shin` becomes `front left`."""
    parts = [world.bodies[place].name.split("_") for place in feet_of(world)]
    while len(parts) > 1 and min(map(len, parts)) > 1 and len({each[-1] for each in parts}) == 1:
        parts = [each[:-1] for each in parts]
    return tuple(" ".join(each) for each in parts)


def shapes_of(world: World) -> tuple[Shape, ...]:
    """Return all visible shapes of a world."""
    ground = Shape(body=None, kind="plane", size_m=(), role="ground")
    feet, observed = set(feet_of(world)), observed_of(world) if world.bodies else None
    found = [ground]
    for place, body in enumerate(world.bodies):
        if place and (strut := _strut(place, body.parts)):
            found.append(strut)
        own: ShapeRole = "trunk" if place == observed else "limb"
        found += [_shape(place, part, "foot" if place in feet and part.collides else own) for part in body.parts]
    return tuple(found)


def extent_of(
    shapes: tuple[Shape, ...], positions: FloatArray, orientations: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the least and the greatest coordinates `(3,)` of a robot; 0 for one without shapes.

    Positions `(bodies, 3)` and orientations `(bodies, 4)` are those of its bodies.
    """
    clouds = [np.zeros((0, 3))]
    for shape in shapes:
        if shape.body is not None:
            places = rotated(np.array(shape.orientation), _outline(shape)) + shape.position_m
            clouds.append(positions[shape.body] + rotated(orientations[shape.body], places))
    points = np.concatenate(clouds)
    return (points.min(axis=0), points.max(axis=0)) if len(points) else (np.zeros(3), np.zeros(3))


def framing_of(low: FloatArray, high: FloatArray) -> Framing:
    """Return from how far away a robot with this extent is seen: a large one and a small one fill a picture alike.

    The scale is a power of 2, so that the squares of the ground keep round sizes.
    """
    scale = float(2.0 ** np.round(np.log2(_size_m(low, high) / USUAL_SIZE_M)))
    return Framing(scale=scale, height_m=round(max(LOOKED_AT_M * scale, float(low[2] + high[2]) / 2), 4))


def at_start(world: World) -> RobotShapes:
    """Return a robot as it stands at the start, seen as large as any other."""
    pose = np.array([[0.0, 0.0, world.start_height_m, *world.start_turn]])
    positions, orientations = body_poses(world, pose, np.array([[joint.start for joint in world.joints]]))
    shapes = shapes_of(world)
    low, high = extent_of(shapes, positions[0], orientations[0])
    clearances = (
        clearances_m(world.bodies[foot], positions[:, foot], orientations[:, foot]) for foot in feet_of(world)
    )
    return RobotShapes(
        shapes=shapes,
        positions_m=tuple(map(tuple, positions.reshape(1, -1).tolist())),
        orientations=tuple(map(tuple, orientations.reshape(1, -1).tolist())),
        slope_rad=world.slope_rad,
        contacts=tuple(((0.0, 0.0),) if clearance[0] < TOUCHING_M else () for clearance in clearances),
        scale=_size_m(low, high) / USUAL_SIZE_M,
        middle_m=tuple(((low + high) / 2).tolist()),
    )


def _size_m(low: FloatArray, high: FloatArray) -> float:
    return max(float(np.linalg.norm(high - low)), 1e-3)


def _outline(shape: Shape) -> FloatArray:
    """Return points `(n, 3)`, in a shape's frame, that enclose it closely enough to place the camera."""
    if shape.kind == "hull":
        return np.array(shape.vertices_m)
    if shape.kind == "box":
        return np.asarray(np.array(SIGNS) * np.array(shape.size_m))
    radius, length, round_end = shape.size_m[0], (*shape.size_m, 0.0)[1], shape.kind != "cylinder"
    return np.asarray(np.array(SIGNS) * np.array([2 * radius, 2 * radius, length + 2 * radius * round_end]))


def _shape(place: int, part: Part, role: ShapeRole) -> Shape:
    vertices, faces = _rounded_hull(part.shape) if isinstance(part.shape, Hull) else ((), ())
    return Shape(
        body=place,
        kind=part.shape.kind,
        size_m=_size_of(part.shape),
        position_m=part.center_m,
        orientation=part.turn,
        role=role,
        vertices_m=vertices,
        faces=faces,
    )


def _size_of(solid: Solid) -> tuple[float, ...]:
    match solid:
        case Box():
            return solid.size_m
        case Capsule() | Cylinder():
            return solid.radius_m, solid.length_m
        case Hull():
            return ()
        case _:
            return (solid.radius_m,)


def _rounded_hull(hull: Hull) -> tuple[tuple[Vector, ...], tuple[Face, ...]]:
    """Return corners, rounded to 0.01 mm, and faces of a hull."""
    vertices, faces = hull_faces(hull.points_m)
    return tuple((round(x, 5), round(y, 5), round(z, 5)) for x, y, z in vertices), faces


@lru_cache(maxsize=1024)
def hull_faces(points_m: tuple[Vector, ...]) -> tuple[tuple[Vector, ...], tuple[Face, ...]]:
    """Return the corners of the convex hull of points, and its triangles; both in an order that the points determine.

    Points in one plane have no hull; their bounding box, which may be flat, stands for it.
    """
    points = np.array(points_m, dtype=float)
    try:
        hull = scipy.spatial.ConvexHull(points)
    except (scipy.spatial.QhullError, ValueError):
        low, high = points.min(axis=0), points.max(axis=0)
        return _vectors((low + high) / 2 + np.array(SIGNS) * (high - low)), BOX
    corners = np.sort(hull.vertices)
    renumbered = {int(old): new for new, old in enumerate(corners)}
    inside = points[corners].mean(axis=0)
    faces = []
    for triangle in hull.simplices.tolist():
        a, b, c = (points[place] for place in triangle)
        outwards = np.cross(b - a, c - a) @ (a - inside) >= 0
        first, second, third = (renumbered[place] for place in (triangle if outwards else triangle[::-1]))
        faces.append(min((first, second, third), (second, third, first), (third, first, second)))
    return _vectors(points[corners]), tuple(sorted(faces))


def _vectors(rows: FloatArray) -> tuple[Vector, ...]:
    return tuple((float(x), float(y), float(z)) for x, y, z in rows)


def _strut(place: int, parts: tuple[Part, ...]) -> Shape | None:
    """Return a strut from the joint to the nearest part of a body; None if a part is at the joint."""
    away = [np.array(part.center_m) for part in parts]
    gaps = [float(np.linalg.norm(to)) - 1.001 * _reach(part.shape)[0] for to, part in zip(away, parts, strict=True)]
    if not gaps or min(gaps) <= 0:
        return None
    nearest = gaps.index(min(gaps))
    along, radius = away[nearest], SLENDER * _reach(parts[nearest].shape)[1]
    middle: Position = tuple((along / 2).tolist())
    size = (radius, float(np.linalg.norm(along)))
    return Shape(body=place, kind="capsule", size_m=size, position_m=middle, orientation=_from_z(along), role="limb")


def _reach(solid: Solid) -> tuple[float, float]:
    """Return how far a solid reaches from its centre at most, and its radius as that of a strut follows from it."""
    match solid:
        case Box():
            return max(solid.size_m) / 2, max(solid.size_m) / 2
        case Capsule() | Cylinder():
            return solid.length_m / 2 + solid.radius_m, solid.radius_m
        case Hull():
            points = np.array(solid.points_m)
            return float(np.linalg.norm(points, axis=1).max()), float(np.ptp(points, axis=0).min()) / 2
        case _:
            return solid.radius_m, solid.radius_m


def _from_z(away: FloatArray) -> Orientation:
    x, y, z = (away if away[2] >= 0 else -away) / np.linalg.norm(away)
    rotation = np.array([-y, x, 0.0, 1.0 + z])
    rotation = rotation / np.linalg.norm(rotation) + 0.0
    return (float(rotation[0]), float(rotation[1]), float(rotation[2]), float(rotation[3]))
