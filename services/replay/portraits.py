"""Pictures of robots: a robot as it stands at the start, painted as videos are."""

from hashlib import sha256
from io import BytesIO

import numpy as np

from gaplab.schemas.replays import Framing
from gaplab.services.core.errors import NotFound
from gaplab.services.core.kinematics import TOUCHING_M, body_poses, clearances_m
from gaplab.services.core.robot_files import stored_robot_file
from gaplab.services.core.robots import robots
from gaplab.services.core.world import World
from gaplab.services.experiments import stored_robots
from gaplab.services.replay.film import DARK, LIGHT, camera_at, solids
from gaplab.services.replay.painting import paint
from gaplab.services.replay.process import Key, RolloutProcess
from gaplab.services.replay.shapes import USUAL_SIZE_M, extent_of, feet_of, shapes_of
from gaplab.services.store.session import Store


def robot_picture(drawing: RolloutProcess, store: Store, name: str, *, dark: bool, width_px: int) -> bytes:
    """Return a picture of a robot, of the catalogue or from a file, by its name or the hash of its file, as PNG.

    Raises:
        NotFound: no usable robot has this name or hash, or it has no body.
        EngineInterrupted: drawing took too long.
        LimitReached: too many callers wait.
    """
    own = robots[name].example().world if name in robots else None
    world = own if own is not None else stored_robot_file(stored_robots.robot_text(store, name)).world
    if not world.bodies:
        raise NotFound(f"the robot {name!r} has no body, so there is no picture of it")
    key: Key = ("picture", sha256(repr(world).encode()).hexdigest(), dark, width_px)
    found: bytes | None = drawing.answers.get(key)
    if found is None:
        found = drawing.call(portrait, world, dark, width_px)
        drawing.answers.keep(key, found, len(found))
    return found


def portrait(world: World, dark: bool, width_px: int) -> bytes:
    """Return the picture of a world at its start as PNG."""
    pose = np.array([[0.0, 0.0, world.start_height_m, *world.start_turn]])
    angles = np.array([[joint.start for joint in world.joints]])
    positions, orientations = body_poses(world, pose, angles)
    feet = feet_of(world)
    clearances = [clearances_m(world.bodies[foot], positions[:, foot], orientations[:, foot])[0] for foot in feet]
    down = {foot for foot, clearance in zip(feet, clearances, strict=True) if clearance < TOUCHING_M}
    shapes, look = shapes_of(world), DARK if dark else LIGHT
    low, high = extent_of(shapes, positions[0], orientations[0])
    size = max(float(np.linalg.norm(high - low)), 1e-3)
    framing = Framing(scale=size / USUAL_SIZE_M, height_m=float(low[2] + high[2]) / 2)
    camera = camera_at([(low + high)[:2] / 2], (width_px, width_px * 3 // 4), framing, world.slope_rad)
    target, painted = BytesIO(), solids(shapes, positions[0], orientations[0], down, look)
    paint(painted, camera, look.scenery).quantize(128).save(target, "PNG", optimize=True)
    return target.getvalue()
