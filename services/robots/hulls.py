"""Convex hulls of meshes with few vertices."""

from itertools import product

import numpy as np
from scipy.spatial import ConvexHull

from gaplab.services.core.arrays import FloatArray

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
