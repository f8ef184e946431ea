"""Pictures of a replay: both worlds side by side, seen by one camera that follows the robot, as on the page."""

from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from gaplab.schemas.replays import Framing, Replay, ReplayWorld, Shape
from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.kinematics import product, rotated
from gaplab.services.replay.painting import Camera, Colour, Scenery, Solid, paint
from gaplab.services.replay.polyhedra import Polyhedron, box, cylinder, polyhedron

TURN_RAD, RISE_RAD, DISTANCE_M = -1.0, 0.35, 1.25
"""Where the page's camera begins."""

APART = 2.2
"""Metres of distance for each metre between a base and the point between both."""

SMOOTHING = 12
"""Frames to each side over which the path of the camera is averaged."""

BAR = 0.12
"""Height of the titles, as a share of the height of a world."""

INK, PAPER = (34, 34, 34), (255, 255, 255)


@dataclass(frozen=True)
class Look:
    """Light or dark colours of the page: by role, and those behind the robot."""

    colours: Mapping[str, Colour]
    scenery: Scenery


LIGHT = Look(
    {
        "trunk": (0, 114, 178),
        "limb": (123, 135, 148),
        "foot": (240, 196, 138),
        "foot on the ground": (213, 94, 0),
    },
    Scenery(),
)
DARK = Look(
    {
        "trunk": (86, 180, 233),
        "limb": (152, 164, 179),
        "foot": (138, 106, 60),
        "foot on the ground": (255, 154, 61),
    },
    Scenery(floor=(29.0, 36.0, 45.0), other=(39.0, 48.0, 59.0), sky=(18.0, 22.0, 28.0), shadow=0.45),
)


@dataclass(frozen=True)
class _Moving:
    """A world with its motion as arrays: `(frames, bodies, 3)` and `(frames, bodies, 4)`."""

    world: ReplayWorld
    title: str
    positions: FloatArray
    orientations: FloatArray

    @property
    def path(self) -> FloatArray:
        """The path of the base over the ground without its sway, `(frames, 2)`."""
        base = np.pad(self.positions[:, 0, :2], ((SMOOTHING, SMOOTHING), (0, 0)), mode="edge")
        kernel = np.ones(2 * SMOOTHING + 1) / (2 * SMOOTHING + 1)
        return np.stack([np.convolve(base[:, axis], kernel, mode="valid") for axis in (0, 1)], axis=1)


def pictures(replay: Replay, *, every: int, width_px: int) -> Iterator[Image.Image]:
    """Yield every n-th frame of the replay, from the start, as pictures of an even width, which its worlds share.

    A world whose physics failed, or that is hardware, is left out.
    """
    worlds = _worlds(replay)
    size = (width_px // max(1, len(worlds)), round(width_px / 3 / 2) * 2)
    paths = [world.path for world in worlds]
    for frame in range(0, len(replay.times_s) if worlds else 0, every):
        bases = [path[frame] for path in paths]
        whole = Image.new("RGB", (size[0] * len(worlds), size[1] + _bar(size)), PAPER)
        for place, world in enumerate(worlds):
            down = _down(world.world, replay.times_s[frame])
            painted = solids(world.world.shapes, world.positions[frame], world.orientations[frame], down)
            camera = camera_at(bases, size, replay.framing, world.world.slope_rad)
            whole.paste(paint(painted, camera), (place * size[0], _bar(size)))
            _write(whole, world.title, (place * size[0] + 8, 0), size)
        _write(whole, f"{replay.times_s[frame]:.2f} s", (8, size[1] - _bar(size) // 2), size)
        yield whole


def _worlds(replay: Replay) -> list[_Moving]:
    simulated = "In its simulator" if replay.simulator is None else f"In the simulator of iteration {replay.simulator}"
    named = ((replay.simulation, simulated), (replay.reality, "In reality"))
    return [
        _Moving(
            world,
            f"{title}: {world.fitness:.3f} {replay.unit}, {world.engine}",
            np.array(world.positions_m).reshape(len(world.positions_m), -1, 3),
            np.array(world.orientations).reshape(len(world.orientations), -1, 4),
        )
        for world, title in named
        if world is not None and world.positions_m
    ]


def camera_at(bases: list[FloatArray], size: tuple[int, int], framing: Framing, slope_rad: float) -> Camera:
    """Return the page's camera at its beginning, which sees all robots.

    Args:
        bases: `(2,)` each: where the robots are, in m.
        size: width and height of the picture in pixels.
        framing: how large the robots are.
        slope_rad: slope of the ground, in rad.
    """
    middle = np.mean(bases, axis=0)
    distance = DISTANCE_M * framing.scale + APART * max(float(np.linalg.norm(base - middle)) for base in bases)
    target = np.array([*middle, framing.height_m])
    level = distance * np.cos(RISE_RAD)
    away = np.array([level * np.cos(TURN_RAD), level * np.sin(TURN_RAD), distance * np.sin(RISE_RAD)])
    return Camera(target + away, target, size, scale=framing.scale, slope_rad=slope_rad)


def _down(world: ReplayWorld, time_s: float) -> set[int | None]:
    """Return the feet on the ground."""
    feet = dict.fromkeys(shape.body for shape in world.shapes if shape.role == "foot")
    spans = zip(feet, world.contacts, strict=False)  # contacts are unknown without joint angles
    return {foot for foot, intervals in spans if any(begin <= time_s < end for begin, end in intervals)}


def solids(
    shapes: Iterable[Shape],
    positions: FloatArray,
    orientations: FloatArray,
    down: Collection[int | None],
    look: Look = LIGHT,
) -> list[Solid]:
    """Return what is painted of shapes.

    Args:
        shapes: the shapes of a world.
        positions: `(bodies, 3)`: positions of the bodies.
        orientations: `(bodies, 4)`: orientations of the bodies.
        down: the feet on the ground.
        look: the colours.
    """
    found = []
    for shape in shapes:
        if shape.kind == "plane":
            continue
        position, turn = np.array(shape.position_m), np.array(shape.orientation)
        if shape.body is not None:
            body = orientations[shape.body]
            position, turn = positions[shape.body] + rotated(body, position), product(body, turn)
        colour = look.colours["foot on the ground" if shape.role == "foot" and shape.body in down else shape.role]
        found.append(Solid(_body(shape), position, np.stack([rotated(turn, axis) for axis in np.eye(3)]), colour))
    return found


def _body(shape: Shape) -> Polyhedron | tuple[float, float]:
    if shape.kind == "hull":
        return polyhedron(shape.vertices_m, shape.faces)
    if shape.kind == "box":
        return box((shape.size_m[0], shape.size_m[1], shape.size_m[2]))
    radius, length = (*shape.size_m, 0.0)[:2]
    return cylinder(radius, length) if shape.kind == "cylinder" else (radius, length)


def _bar(size: tuple[int, int]) -> int:
    return round(BAR * size[1] / 2) * 2


def _write(picture: Image.Image, words: str, at: tuple[int, int], size: tuple[int, int]) -> None:
    font = ImageFont.load_default(_bar(size) * 0.55)
    ImageDraw.Draw(picture).text((at[0], at[1] + _bar(size) * 0.15), words, fill=INK, font=font)
