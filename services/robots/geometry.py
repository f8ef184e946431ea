"""Shapes of a compiled model as those of a World."""

from functools import cache
from itertools import product
from typing import Any

import numpy as np
from scipy.spatial import ConvexHull, QhullError
from scipy.spatial.transform import Rotation

from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.shapes import Box, Capsule, Cylinder, Hull, Part, Quaternion, Shape, Sphere, Vector
from gaplab.services.robots.notes import Notes
from gaplab.services.robots.options import ImportOptions

EXACT = 1e-5
"""Share of a hull's size within which it is exact: more vertices would not be seen."""

DIRECTIONS = np.array([each for each in product((-1, 0, 1), repeat=3) if sum(map(abs, each)) in {1, 3}], dtype=float)
"""`(14, 3)`: towards the faces and the corners of a cube; the farthest points in them are the first vertices."""


def simplify(points_m: FloatArray, most: int) -> tuple[FloatArray, float]:
    """Return `(k, 3)`, k ≤ `most`: some of the points, and the share of the hull's volume that their hull lacks.

    The points that are farthest outside are added one by one, so that the result lies inside, and does not depend on
    chance.

    Args:
        points_m: `(n, 3)`.
        most: largest number of vertices.

    Raises:
        QhullError: the points lie in a plane.
    """
    whole = ConvexHull(points_m)
    corners = points_m[np.sort(whole.vertices)]
    if len(corners) <= most:
        return corners, 0.0
    size = float(np.ptp(corners, axis=0).max())
    chosen = list(dict.fromkeys(int(np.argmax(corners @ direction)) for direction in DIRECTIONS))[:most]
    hull = ConvexHull(corners[chosen])
    while len(chosen) < most:
        outside = (corners @ hull.equations[:, :3].T + hull.equations[:, 3]).max(axis=1)
        farthest = int(np.argmax(outside))
        if outside[farthest] < EXACT * size:
            break
        chosen.append(farthest)
        hull = ConvexHull(corners[chosen])
    return corners[sorted(chosen)], float(1 - hull.volume / whole.volume)


DIGITS = 7
"""Decimals of a hull's vertices, m: finer than their single precision."""


def vector(values: FloatArray) -> Vector:
    """Return three numbers; adding 0 makes -0 to 0."""
    x, y, z = (float(value) + 0.0 for value in values)
    return x, y, z


def quaternion(turn: Rotation) -> Quaternion:
    """Return a rotation as x, y, z, w with w ≥ 0."""
    x, y, z, w = (float(value) + 0.0 for value in turn.as_quat(canonical=True))
    return x, y, z, w


def rotation_of(wxyz: FloatArray) -> Rotation:
    """Return the rotation of MuJoCo's quaternion w, x, y, z."""
    return Rotation.from_quat(np.roll(wxyz, -1))


class Shapes:
    """Shapes of the geoms of a model; the hull of a mesh is computed once.

    Attributes:
        planes: numbers of the geoms that are the file's ground.
    """

    def __init__(self, model: Any, options: ImportOptions, notes: Notes) -> None:  # noqa: ANN401
        self._model, self._options, self._notes = model, options, notes
        self._hull = cache(self._simplified)
        self.planes = [at for at in range(model.ngeom) if model.geom_bodyid[at] == 0 and self._kind(at) == "plane"]
        self._grounds = [(int(model.geom_contype[at]), int(model.geom_conaffinity[at])) for at in self.planes]

    def collides(self, geom: int) -> bool:
        """Return whether a geom collides with the file's ground, or with anything, if the file has no ground."""
        kind, with_kinds = int(self._model.geom_contype[geom]), int(self._model.geom_conaffinity[geom])
        if not self._grounds:
            return bool(kind or with_kinds)
        return any(kind & ground[1] or with_kinds & ground[0] for ground in self._grounds)

    def on_the_ground(self, geom: int) -> float:
        """Return the coefficient of MuJoCo's contact of a geom with the file's ground, its own if there is none."""
        model = self._model
        able = [geom, *self.planes]
        highest = max(int(model.geom_priority[at]) for at in able)
        leading = [at for at in able if int(model.geom_priority[at]) == highest]
        if max(int(model.geom_condim[at]) for at in leading) == 1:
            return 0.0
        return max(float(model.geom_friction[at, 0]) for at in leading)

    def part(self, geom: int, center: FloatArray, turn: Rotation) -> Part | None:
        """Return the part of a geom; None of one that a World cannot have.

        Args:
            geom: number of the geom.
            center: `(3,)`: its place in the frame of the World's body.
            turn: its rotation there.
        """
        shape = self._shape(geom)
        if shape is None:
            return None
        return Part(shape, vector(center), quaternion(turn), collides=self.collides(geom))

    def _shape(self, geom: int) -> Shape | None:
        x, y, z = (float(value) for value in self._model.geom_size[geom])
        kind = self._kind(geom)
        if kind == "box":
            return Box((2 * x, 2 * y, 2 * z))
        if kind == "sphere":
            return Sphere(x)
        if kind in {"capsule", "cylinder"}:
            return (Capsule if kind == "capsule" else Cylinder)(x, 2 * y)
        if kind == "mesh":
            return self._hull(int(self._model.geom_dataid[geom]))
        if kind == "ellipsoid":
            self._notes.lose(
                f"{self._name(geom)} is an ellipsoid: it becomes a hull of {self._options.vertices} points"
            )
            return _ellipsoid(np.array([x, y, z]), self._options.vertices)
        self._notes.lose(f"{self._name(geom)} is a {kind}, which a robot cannot have: it is left out")
        return None

    def _simplified(self, mesh: int) -> Hull | None:
        model = self._model
        first, count = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
        name = str(model.mesh(mesh).name) or f"mesh{mesh}"
        try:
            points, lacking = simplify(model.mesh_vert[first : first + count].astype(float), self._options.vertices)
        except QhullError:
            self._notes.lose(f"mesh {name} is flat: it is left out")
            return None
        change = f", {100 * lacking:.2g} % smaller than its convex hull" if lacking else ""
        self._notes.lose(f"mesh {name} of {count} vertices becomes a hull of {len(points)}{change}")
        return Hull(tuple(vector(np.round(point, DIGITS)) for point in points))

    def _kind(self, geom: int) -> str:
        kinds = ("plane", "hfield", "sphere", "capsule", "ellipsoid", "cylinder", "box", "mesh", "sdf")
        return kinds[int(self._model.geom_type[geom])]

    def _name(self, geom: int) -> str:
        return str(self._model.geom(geom).name) or f"geom{geom}"


def _ellipsoid(radii: FloatArray, count: int) -> Hull:
    """Return the hull of points that are spread evenly over an ellipsoid, along a spiral."""
    at = np.arange(count) + 0.5
    height, around = 1 - 2 * at / count, np.pi * (1 + np.sqrt(5)) * at
    across = np.sqrt(1 - height * height)
    points = np.stack([across * np.cos(around), across * np.sin(around), height], axis=1) * radii
    return Hull(tuple(vector(np.round(point, DIGITS)) for point in points))
