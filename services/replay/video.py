"""Replays as files: GIF, WebP and MP4."""

from collections.abc import Iterable
from fractions import Fraction
from hashlib import sha256
from io import BytesIO
from itertools import chain
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Literal

from PIL import Image

from gaplab.schemas.replays import Replay
from gaplab.services.core.errors import Conflict, EngineUnavailable
from gaplab.services.replay.film import pictures
from gaplab.services.replay.process import Key, RolloutProcess
from gaplab.services.replay.rollout import FRAMES_PER_S

VideoFormat = Literal["gif", "webp", "mp4"]

EVERY = 2
"""Frames of a replay for one picture: 25 pictures a second, which every format can time exactly."""

PICTURES_PER_S = FRAMES_PER_S // EVERY
LOOP = 0
"""Pillow's number for a film that repeats without end."""


def replay_video(drawing: RolloutProcess, replay: bytes, kind: VideoFormat, width_px: int) -> bytes:
    """Return a replay, given as JSON, as a film of an even width.

    Raises:
        Conflict: the physics failed, so there is no motion.
        EngineUnavailable: MP4 is requested, and its library is not installed.
        EngineInterrupted: drawing took too long.
        LimitReached: too many callers wait.
    """
    key: Key = ("video", sha256(replay).hexdigest(), kind, width_px)
    found: bytes | None = drawing.answers.get(key)
    if found is None:
        found = drawing.call(film, replay, kind, width_px)
        drawing.answers.keep(key, found, len(found))
    if not found:
        raise Conflict("the physics failed in this replay, so there is no motion to draw")
    return found


def film(replay: bytes, kind: VideoFormat, width_px: int) -> bytes:
    """Return a replay, given as JSON, as a film; empty if no world has a motion.

    Raises:
        EngineUnavailable: the library for MP4 is not installed.
    """
    drawn = iter(pictures(Replay.model_validate_json(replay), every=EVERY, width_px=width_px))
    first = next(drawn, None)
    if first is None:
        return b""
    if kind == "mp4":
        return _mp4(chain([first], drawn), first.size)
    target = BytesIO()
    timing = {"save_all": True, "duration": 1000 // PICTURES_PER_S, "loop": LOOP}
    if kind == "gif":
        palette = first.quantize(128, dither=Image.Dither.NONE)
        small = (each.quantize(palette=palette, dither=Image.Dither.NONE) for each in drawn)
        palette.save(target, "GIF", append_images=small, optimize=False, **timing)
    else:
        first.save(target, "WEBP", append_images=drawn, quality=80, method=2, **timing)
    return target.getvalue()


def _mp4(drawn: Iterable[Image.Image], size: tuple[int, int]) -> bytes:
    try:
        import av
    except ImportError as error:
        msg = "MP4 needs PyAV: pip install 'gaplab[video]'; GIF and WebP need nothing more"
        raise EngineUnavailable(msg) from error
    with TemporaryDirectory(prefix="gaplab-") as folder:
        file = Path(folder) / "film.mp4"  # its index moves to the front at the end, which needs a real file
        with av.open(file, "w", format="mp4", options={"movflags": "+faststart"}) as container:
            stream = container.add_stream("libx264", rate=Fraction(PICTURES_PER_S), options={"crf": "20"})
            stream.width, stream.height, stream.pix_fmt = *size, "yuv420p"
            for picture in drawn:
                container.mux(stream.encode(av.VideoFrame.from_image(picture)))
            container.mux(stream.encode())
        return file.read_bytes()
