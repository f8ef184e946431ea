"""Videos: what they show, in every format."""

from io import BytesIO
from typing import Any

import numpy as np
import pytest
from PIL import Image

from gaplab.schemas.replays import Replay
from gaplab.services.replay.film import LIGHT, pictures
from gaplab.services.replay.painting import Camera, Solid, paint
from gaplab.services.replay.polyhedra import box
from gaplab.services.replay.video import VideoFormat, film

FRAMES = 9


def world(**changes: Any) -> dict[str, Any]:
    shapes = [
        {"body": None, "kind": "plane", "size_m": [], "role": "ground"},
        {"body": 0, "kind": "box", "size_m": [0.3, 0.2, 0.06], "role": "trunk"},
        {"body": 1, "kind": "capsule", "size_m": [0.02, 0.1], "role": "limb"},
        {"body": 1, "kind": "sphere", "size_m": [0.03], "role": "foot"},
    ]
    return {
        "engine": "mujoco",
        "fitness": 0.4,
        "recorded": None,
        "shapes": shapes,
        "positions_m": [[0.02 * frame, 0.0, 0.15, 0.02 * frame, 0.0, 0.03] for frame in range(FRAMES)],
        "orientations": [[0.0, 0.0, 0.0, 1.0] * 2] * FRAMES,
        "heights_m": [0.15] * FRAMES,
        "speeds_m_s": [1.0] * FRAMES,
        "contacts": [[[0.0, 0.08]]],
    } | changes


def replay(simulation: Any, reality: Any) -> Replay:
    return Replay.model_validate(
        {
            "experiment": "e",
            "repetition": 0,
            "iteration": 2,
            "kind": "transfer",
            "simulator": 2,
            "robot": "r",
            "unit": "m/s",
            "bodies": ["trunk", "leg"],
            "feet": ["leg"],
            "times_s": [0.02 * frame for frame in range(FRAMES)],
            "counted_s": [0.0, 0.16],
            "simulation": simulation,
            "reality": reality,
        }
    )


BOTH = replay(world(), world())


@pytest.mark.parametrize("kind", ["gif", "webp"])
def test_a_film_has_every_second_frame_at_25_a_second(kind: VideoFormat) -> None:
    content = film(BOTH.model_dump_json().encode(), kind, 240)

    with Image.open(BytesIO(content)) as shown:
        assert shown.n_frames == 5  # type: ignore[attr-defined]
        assert shown.width == 240
        shown.seek(1)
        shown.load()
        assert shown.info["duration"] == 40


def test_an_mp4_can_be_decoded() -> None:
    av = pytest.importorskip("av")

    content = film(BOTH.model_dump_json().encode(), "mp4", 240)

    with av.open(BytesIO(content)) as shown:
        frames = list(shown.decode(video=0))
    assert len(frames) == 5
    assert frames[0].width == 240


def test_what_is_on_the_ground_has_another_colour() -> None:
    def count(picture: Image.Image) -> int:
        rgb = np.asarray(picture).astype(int)
        near = np.abs(rgb - np.array(LIGHT.colours["foot on the ground"]) * 0.75).sum(axis=2) < 120
        return int(near.sum())

    first, *_, last = pictures(BOTH, every=1, width_px=480)

    assert count(first) > 2 * count(last)


def test_the_camera_follows_the_robot() -> None:
    first, *_, last = pictures(BOTH, every=1, width_px=480)

    def middle(picture: Image.Image) -> float:
        rgb = np.asarray(picture).astype(int)[40:, :240]
        blue = np.argwhere((rgb[..., 2] > 90) & (rgb[..., 0] < 40))
        return float(blue[:, 1].mean())

    assert abs(middle(first) - middle(last)) < 30


def test_a_world_that_failed_or_is_hardware_is_left_out() -> None:
    failed = world(positions_m=[], orientations=[], fitness=None)

    (alone, *_) = pictures(replay(world(), failed), every=1, width_px=240)

    assert alone.width == 240
    assert film(replay(failed, None).model_dump_json().encode(), "gif", 240) == b""


def test_a_nearer_solid_hides_a_farther_one() -> None:
    camera = Camera(np.array([0.0, -2.0, 0.3]), np.array([0.0, 0.0, 0.3]), (80, 60))
    far = Solid(box((0.4, 0.4, 0.4)), np.array([0.0, 1.0, 0.3]), np.eye(3), (0, 0, 250))
    near = Solid((0.2, 0.0), np.array([0.0, 0.0, 0.3]), np.eye(3), (250, 0, 0))

    red, _, blue = paint([near, far], camera).getpixel((40, 30))  # type: ignore[misc]

    assert red > 100 > blue
