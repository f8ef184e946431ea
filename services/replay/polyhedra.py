"""Polyhedra: corners and outward faces of boxes, cylinders and convex hulls."""

from dataclasses import dataclass
from functools import lru_cache
from itertools import product

import numpy as np
import scipy

from gaplab.services.core.arrays import FloatArray, frozen
from gaplab.services.core.shapes import Vector

Face = tuple[int, ...]
"""Places of its corners, anticlockwise as seen from outside."""

AROUND = 24
"""Corners of a cylinder's end."""

SIGNS = tuple(product((-0.5, 0.5), repeat=3))
BOX: tuple[Face, ...] = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))


@dataclass(frozen=True, eq=False)
class Polyhedron:
    """A convex polyhedron.

    Attributes:
        corners_m: `(n, 3)`.
        faces: its faces.
        normals: `(faces, 3)`, outwards, of length 1; 0 for a face without area.
    """

    corners_m: FloatArray
    faces: tuple[Face, ...]
    normals: FloatArray


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


@lru_cache(maxsize=1024)
def polyhedron(corners: tuple[Vector, ...], faces: tuple[Face, ...]) -> Polyhedron:
    """Return a polyhedron with the normals of its faces."""
    places = np.array(corners)
    normals = np.array([np.cross(places[b] - places[a], places[c] - places[b]) for a, b, c, *_ in faces])
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    return Polyhedron(frozen(places), faces, frozen(normals / np.maximum(lengths, 1e-30)))


@lru_cache(maxsize=1024)
def box(size_m: Vector) -> Polyhedron:
    """Return a box about the origin."""
    return polyhedron(_vectors(np.array(SIGNS) * np.array(size_m)), BOX)


@lru_cache(maxsize=1024)
def cylinder(radius_m: float, length_m: float) -> Polyhedron:
    """Return a prism along z with `AROUND` sides that stands for a cylinder about the origin."""
    turns = 2 * np.pi * np.arange(AROUND) / AROUND
    ring = np.stack([radius_m * np.cos(turns), radius_m * np.sin(turns), np.full(AROUND, length_m / 2)], axis=1)
    sides = [(i, i + AROUND, (i + 1) % AROUND + AROUND, (i + 1) % AROUND) for i in range(AROUND)]
    ends = [tuple(range(AROUND)), tuple(range(2 * AROUND - 1, AROUND - 1, -1))]
    return polyhedron(_vectors(np.concatenate([ring, ring * (1, 1, -1)])), (*sides, *ends))


def _vectors(rows: FloatArray) -> tuple[Vector, ...]:
    return tuple((float(x), float(y), float(z)) for x, y, z in rows)
