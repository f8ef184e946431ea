"""Solids on a checkered ground, painted from back to front with Pillow.

Faces are lit as on the page. Balls and capsules have three shades. Shadows are the solids' outlines, projected
along the light. A picture is painted at twice its size and reduced, so that edges are smooth.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy
from PIL import Image, ImageChops, ImageDraw

from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.shapes import Vector
from gaplab.services.replay.polyhedra import Polyhedron

Colour = tuple[int, int, int]
Points = list[tuple[float, float]]

LIGHT = np.array([0.45, 0.35, 1.0]) / np.linalg.norm([0.45, 0.35, 1.0])
AMBIENT, DIFFUSE = 0.62, 0.38
VIEW_RAD = 0.65
"""Vertical angle of view."""

SQUARE_M = 0.25
FADES_M = (1.5, 4.0)
"""Distances from the robot between which the ground fades into the sky."""

FINER = 2
NEAR_M = 0.05
ROUND = np.array([(np.cos(turn), np.sin(turn), 0.0) for turn in np.linspace(0, 2 * np.pi, 16, endpoint=False)])
SHADES = ((1.0, 0.0, -0.25), (0.78, 0.2, 0.15), (0.4, 0.42, 0.6))
"""Layers of a round solid: share of its radius, shift towards the light, and the cosine to the light that lights it."""


@dataclass(frozen=True)
class Scenery:
    """The colours behind the solids: two of the squares of the ground, the sky, and the share of light in a shadow."""

    floor: Vector = (238.0, 241.0, 244.0)
    other: Vector = (219.0, 225.0, 231.0)
    sky: Vector = (255.0, 255.0, 255.0)
    shadow: float = 0.74


@dataclass(frozen=True, eq=False)
class Solid:
    """A shape in the world: a polyhedron, or a ball, or a capsule.

    Attributes:
        body: a polyhedron, or radius and length of a capsule along z; a ball has the length 0.
        position: centre, `(3,)`.
        axes: its x, y and z axis in rows, `(3, 3)`.
        colour: red, green and blue, up to 255.
    """

    body: Polyhedron | tuple[float, float]
    position: FloatArray
    axes: FloatArray
    colour: Colour

    def placed(self, points: FloatArray) -> FloatArray:
        """Return points `(n, 3)` of its frame in the world."""
        return np.asarray(self.position + points @ self.axes)

    def outline(self) -> FloatArray:
        """Return points `(n, 3)` whose projection along the light contains the shadow."""
        if isinstance(self.body, Polyhedron):
            return self.placed(self.body.corners_m)
        radius, length = self.body
        side = np.cross(LIGHT, [0.0, 1.0, 0.0])
        side /= np.linalg.norm(side)
        across = np.stack([side, np.cross(LIGHT, side), LIGHT])
        return np.concatenate([end + radius * ROUND @ across for end in self.placed(_ends(length))])


class Camera:
    """A camera that looks at a target.

    Args:
        eye: where it is.
        target: point in the middle of the picture.
        size: width and height of the picture in pixels.
        scale: lengths of what is seen, relative to those of a robot as large as the quadruped.
        slope_rad: angle by which the ground, the plane z = 0, rises along x in the picture.
    """

    def __init__(
        self, eye: FloatArray, target: FloatArray, size: tuple[int, int], *, scale: float = 1.0, slope_rad: float = 0.0
    ) -> None:
        self.eye, self.target, self.scale = eye, target, scale
        self.width, self.height = size[0] * FINER, size[1] * FINER
        back = (eye - target) / np.linalg.norm(eye - target)
        right = np.cross([np.sin(slope_rad), 0.0, np.cos(slope_rad)], back)
        right /= np.linalg.norm(right)
        self.frame = np.stack([right, np.cross(back, right), back])
        self.focal_px = self.height / 2 / np.tan(VIEW_RAD / 2)

    def seen(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the places of points `(n, 3)` in the picture, `(n, 2)`, and their depths `(n,)` in m."""
        found = (points - self.eye) @ self.frame.T
        depths = np.maximum(-found[:, 2], NEAR_M * self.scale)
        scale = self.focal_px / depths[:, None]
        middle = np.array([self.width / 2, self.height / 2])
        return middle + found[:, :2] * (1, -1) * scale, depths


def paint(solids: Sequence[Solid], camera: Camera, scenery: Scenery = Scenery()) -> Image.Image:
    """Return a picture of solids on the ground."""
    picture = Image.new("RGB", (camera.width, camera.height), _colour(np.array(scenery.sky)))
    _ground(ImageDraw.Draw(picture), camera, scenery)
    picture = _shaded(picture, solids, camera, scenery.shadow)
    pen = ImageDraw.Draw(picture)
    for solid in sorted(solids, key=lambda one: -float(np.linalg.norm(one.position - camera.eye))):
        if isinstance(solid.body, Polyhedron):
            _faces(pen, solid, solid.body, camera)
        else:
            _round(pen, solid, *solid.body, camera)
    return picture.reduce(FINER)


def _ground(pen: ImageDraw.ImageDraw, camera: Camera, scenery: Scenery) -> None:
    """Paint the squares around the target, fading with the distance from it."""
    floor, other, sky = (np.array(colour) for colour in (scenery.floor, scenery.other, scenery.sky))
    square, (near, gone) = SQUARE_M * camera.scale, np.array(FADES_M) * camera.scale
    reach = int(gone / square)
    first = np.floor(camera.target[:2] / square).astype(int) - reach
    steps = np.arange(2 * reach + 2)
    grid = np.stack(np.meshgrid(first[0] + steps, first[1] + steps, indexing="ij"), axis=-1)
    flat = np.concatenate([grid.reshape(-1, 2) * square, np.zeros((grid[..., 0].size, 1))], axis=1)
    places = camera.seen(flat)[0].reshape(*grid.shape)
    ahead = ((flat - camera.eye) @ camera.frame[2] < -NEAR_M * camera.scale).reshape(grid.shape[:2])
    far = np.linalg.norm((grid[:-1, :-1] + 0.5) * square - camera.target[:2], axis=-1)
    share = np.clip((far - near) / (gone - near), 0, 1)
    share = share * share * (3 - 2 * share)
    for i, j in zip(*np.nonzero(share < 1), strict=True):
        if ahead[i : i + 2, j : j + 2].all():
            base = other if grid[i, j].sum() % 2 else floor
            corners = (places[i, j], places[i + 1, j], places[i + 1, j + 1], places[i, j + 1])
            pen.polygon(_points(corners), fill=_colour(base * (1 - share[i, j]) + sky * share[i, j]))


def _shaded(picture: Image.Image, solids: Sequence[Solid], camera: Camera, shadow: float) -> Image.Image:
    """Return the picture with each spot of the ground darkened once, however many solids are above it."""
    mask = Image.new("L", picture.size, 0)
    pen = ImageDraw.Draw(mask)
    for solid in solids:
        outline = solid.outline()
        below = outline - LIGHT * (outline[:, 2:] / LIGHT[2])
        pen.polygon(_hull(camera.seen(below)[0]), fill=255)
    dark = ImageChops.multiply(picture, Image.new("RGB", picture.size, (round(255 * shadow),) * 3))
    return Image.composite(dark, picture, mask)


def _faces(pen: ImageDraw.ImageDraw, solid: Solid, body: Polyhedron, camera: Camera) -> None:
    corners, normals = solid.placed(body.corners_m), body.normals @ solid.axes
    places, _ = camera.seen(corners)
    first = corners[[face[0] for face in body.faces]]
    facing = np.sum(normals * (camera.eye - first), axis=1) > 0
    lit = AMBIENT + DIFFUSE * normals @ LIGHT
    for place in np.flatnonzero(facing):
        pen.polygon(_points(places[list(body.faces[place])]), fill=_lit(solid.colour, float(lit[place])))


def _ends(length_m: float) -> FloatArray:
    return np.array([[0.0, 0.0, -length_m / 2], [0.0, 0.0, length_m / 2]])


def _round(pen: ImageDraw.ImageDraw, solid: Solid, radius_m: float, length_m: float, camera: Camera) -> None:
    places, depths = camera.seen(solid.placed(_ends(length_m)))
    radii = camera.focal_px * radius_m / depths
    towards = (camera.frame @ LIGHT)[:2] * (1, -1)
    for share, shift, cosine in SHADES:
        fill = _lit(solid.colour, AMBIENT + DIFFUSE * cosine)
        shifted = places + shift * radii[:, None] * towards
        if length_m:
            pen.line(_points(shifted), fill=fill, width=max(1, round(2 * share * float(radii.mean()))))
        for (x, y), radius in zip(shifted, share * radii, strict=True):
            pen.ellipse((x - radius, y - radius, x + radius, y + radius), fill=fill)


def _hull(places: FloatArray) -> Points:
    try:
        return _points(places[scipy.spatial.ConvexHull(places).vertices])
    except scipy.spatial.QhullError:  # all on one line: a shadow without area
        return _points(places[:2])


def _points(places: Sequence[FloatArray] | FloatArray) -> Points:
    return [(float(x), float(y)) for x, y in places]


def _lit(colour: Colour, lit: float) -> Colour:
    return _colour(np.array(colour) * lit)


def _colour(values: FloatArray) -> Colour:
    red, green, blue = np.clip(values, 0, 255).astype(int).tolist()
    return red, green, blue
