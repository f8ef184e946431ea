"""Solids on a checkered ground, painted from back to front with Pillow.

Faces of boxes are lit as on the page. Balls and capsules have three shades. Shadows are the solids' outlines, projected
along the light. A picture is painted at twice its size and reduced, so that edges are smooth.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product as combinations

import numpy as np
from PIL import Image, ImageChops, ImageDraw
from scipy.spatial import ConvexHull, QhullError

from gaplab.services.core.arrays import FloatArray

Colour = tuple[int, int, int]
Points = list[tuple[float, float]]

LIGHT = np.array([0.45, 0.35, 1.0]) / np.linalg.norm([0.45, 0.35, 1.0])
AMBIENT, DIFFUSE = 0.62, 0.38
SHADOW = 0.74
VIEW_RAD = 0.65
"""Vertical angle of view."""

SQUARE_M = 0.25
FLOOR, OTHER, SKY = np.array([238.0, 241, 244]), np.array([219.0, 225, 231]), np.array([255.0, 255, 255])
FADES_M = (1.5, 4.0)
"""Distances from the robot between which the ground fades into the sky."""

FINER = 2
NEAR_M = 0.05
CORNERS = np.array(list(combinations((-0.5, 0.5), repeat=3)))
ROUND = np.array([(np.cos(turn), np.sin(turn), 0.0) for turn in np.linspace(0, 2 * np.pi, 16, endpoint=False)])
SHADES = ((1.0, 0.0, -0.25), (0.78, 0.2, 0.15), (0.4, 0.42, 0.6))
"""Layers of a round solid: share of its radius, shift towards the light, and the cosine to the light that lights it."""


@dataclass(frozen=True, eq=False)
class Solid:
    """A shape in the world.

    Attributes:
        kind: `box`, `sphere` or `capsule`, with sizes as in a replay.
        size_m: sizes.
        position: centre, `(3,)`.
        axes: its x, y and z axis in rows, `(3, 3)`.
        colour: red, green and blue, up to 255.
    """

    kind: str
    size_m: tuple[float, ...]
    position: FloatArray
    axes: FloatArray
    colour: Colour

    @property
    def ends(self) -> FloatArray:
        """Centres of the balls that a round solid spans."""
        half = self.size_m[1] / 2 if self.kind == "capsule" else 0.0
        return np.stack([self.position - half * self.axes[2], self.position + half * self.axes[2]])

    @property
    def corners(self) -> FloatArray:
        """The eight corners of a box, `(8, 3)`."""
        return np.asarray(self.position + (CORNERS * np.array(self.size_m)) @ self.axes)


class Camera:
    """A camera that looks at a target, with z upwards.

    Args:
        eye: where it is.
        target: point in the middle of the picture.
        size: width and height of the picture in pixels.
    """

    def __init__(self, eye: FloatArray, target: FloatArray, size: tuple[int, int]) -> None:
        self.eye, self.target = eye, target
        self.width, self.height = size[0] * FINER, size[1] * FINER
        back = (eye - target) / np.linalg.norm(eye - target)
        right = np.array([-back[1], back[0], 0.0]) / np.hypot(back[0], back[1])
        self.frame = np.stack([right, np.cross(back, right), back])
        self.focal_px = self.height / 2 / np.tan(VIEW_RAD / 2)

    def seen(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the places of points `(n, 3)` in the picture, `(n, 2)`, and their depths `(n,)` in m."""
        found = (points - self.eye) @ self.frame.T
        depths = np.maximum(-found[:, 2], NEAR_M)
        scale = self.focal_px / depths[:, None]
        middle = np.array([self.width / 2, self.height / 2])
        return middle + found[:, :2] * (1, -1) * scale, depths


def paint(solids: Sequence[Solid], camera: Camera) -> Image.Image:
    """Return a picture of solids on the ground."""
    picture = Image.new("RGB", (camera.width, camera.height), _colour(SKY))
    pen = ImageDraw.Draw(picture)
    _ground(pen, camera)
    picture = _shaded(picture, solids, camera)
    pen = ImageDraw.Draw(picture)
    for solid in sorted(solids, key=lambda one: -float(np.linalg.norm(one.position - camera.eye))):
        if solid.kind == "box":
            _box(pen, solid, camera)
        else:
            _round(pen, solid, camera)
    return picture.reduce(FINER)


def _ground(pen: ImageDraw.ImageDraw, camera: Camera) -> None:
    """Paint the squares around the target, fading with the distance from it."""
    reach = int(FADES_M[1] / SQUARE_M)
    first = np.floor(camera.target[:2] / SQUARE_M).astype(int) - reach
    steps = np.arange(2 * reach + 2)
    grid = np.stack(np.meshgrid(first[0] + steps, first[1] + steps, indexing="ij"), axis=-1)
    flat = np.concatenate([grid.reshape(-1, 2) * SQUARE_M, np.zeros((grid[..., 0].size, 1))], axis=1)
    places = camera.seen(flat)[0].reshape(*grid.shape)
    ahead = ((flat - camera.eye) @ camera.frame[2] < -NEAR_M).reshape(grid.shape[:2])
    far = np.linalg.norm((grid[:-1, :-1] + 0.5) * SQUARE_M - camera.target[:2], axis=-1)
    share = np.clip((far - FADES_M[0]) / (FADES_M[1] - FADES_M[0]), 0, 1)
    share = share * share * (3 - 2 * share)
    for i, j in zip(*np.nonzero(share < 1), strict=True):
        if ahead[i : i + 2, j : j + 2].all():
            base = OTHER if grid[i, j].sum() % 2 else FLOOR
            corners = (places[i, j], places[i + 1, j], places[i + 1, j + 1], places[i, j + 1])
            pen.polygon(_points(corners), fill=_colour(base * (1 - share[i, j]) + SKY * share[i, j]))


def _shaded(picture: Image.Image, solids: Sequence[Solid], camera: Camera) -> Image.Image:
    """Return the picture with each spot of the ground darkened once, however many solids are above it."""
    mask = Image.new("L", picture.size, 0)
    pen = ImageDraw.Draw(mask)
    for solid in solids:
        outline = solid.corners if solid.kind == "box" else _rings(solid)
        below = outline - LIGHT * (outline[:, 2:] / LIGHT[2])
        pen.polygon(_hull(camera.seen(below)[0]), fill=255)
    dark = ImageChops.multiply(picture, Image.new("RGB", picture.size, (round(255 * SHADOW),) * 3))
    return Image.composite(dark, picture, mask)


def _rings(solid: Solid) -> FloatArray:
    """Return circles around the ends of a round solid, across the light."""
    side = np.cross(LIGHT, [0.0, 1.0, 0.0])
    side /= np.linalg.norm(side)
    across = np.stack([side, np.cross(LIGHT, side), LIGHT])
    return np.concatenate([end + solid.size_m[0] * ROUND @ across for end in solid.ends])


def _box(pen: ImageDraw.ImageDraw, solid: Solid, camera: Camera) -> None:
    corners = solid.corners
    places, _ = camera.seen(corners)
    for axis, side in combinations(range(3), (-1, 1)):
        normal = side * solid.axes[axis]
        face = np.flatnonzero(CORNERS[:, axis] == side / 2)
        if normal @ (camera.eye - corners[face].mean(axis=0)) > 0:
            lit = AMBIENT + DIFFUSE * float(normal @ LIGHT)
            pen.polygon(_points(places[face[[0, 1, 3, 2]]]), fill=_lit(solid.colour, lit))


def _round(pen: ImageDraw.ImageDraw, solid: Solid, camera: Camera) -> None:
    places, depths = camera.seen(solid.ends)
    radii = camera.focal_px * solid.size_m[0] / depths
    towards = (camera.frame @ LIGHT)[:2] * (1, -1)
    for share, shift, cosine in SHADES:
        fill = _lit(solid.colour, AMBIENT + DIFFUSE * cosine)
        shifted = places + shift * radii[:, None] * towards
        if solid.kind == "capsule":
            pen.line(_points(shifted), fill=fill, width=max(1, round(2 * share * float(radii.mean()))))
        for (x, y), radius in zip(shifted, share * radii, strict=True):
            pen.ellipse((x - radius, y - radius, x + radius, y + radius), fill=fill)


def _hull(places: FloatArray) -> Points:
    try:
        return _points(places[ConvexHull(places).vertices])
    except QhullError:  # all on one line: a shadow without area
        return _points(places[:2])


def _points(places: Sequence[FloatArray] | FloatArray) -> Points:
    return [(float(x), float(y)) for x, y in places]


def _lit(colour: Colour, lit: float) -> Colour:
    return _colour(np.array(colour) * lit)


def _colour(values: FloatArray) -> Colour:
    red, green, blue = np.clip(values, 0, 255).astype(int).tolist()
    return red, green, blue
