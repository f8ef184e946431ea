"""Replays of controllers, as data and as videos."""

from pathlib import Path

from gaplab.api.clients.connection import Connection, Of, segment, written
from gaplab.api.clients.errors import format_of
from gaplab.schemas.replays import Replay

FORMATS = ("gif", "webp", "mp4")


class Replays:
    """Replays, which the service computes on request."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def replay(self, of: Of, /, **choice: int | str | None) -> Replay:
        """Return the motion of a controller of an experiment in its simulator and in reality.

        Its choice, as in the API: repetition, iteration (left out: the last that was measured), kind ("transfer" or
        "sample") and simulator.
        """
        return self._connection.get(Replay, f"/experiments/{segment(of)}/replay", **choice)

    def video(self, of: Of, file: str | Path, /, **choice: int | str | None) -> Path:
        """Write a replay into a file with the suffix .gif, .webp or .mp4; missing folders are created.

        The choice is that of `replay`, and `width` in pixels.
        """
        return self._connection.save(file, f"/experiments/{segment(of)}/video", FORMATS, **choice)

    def robot_picture(self, name: str, file: str | Path, *, theme: str = "light", width: int = 640) -> Path:
        """Write a picture of a robot of the catalogue, as it stands at the start, into a PNG file.

        The theme is `light` or `dark`. The height is three quarters of the width, in pixels. Missing folders are made.
        """
        format_of(file, ("png",))
        path = f"/catalogue/robots/{segment(name)}/picture"
        return written(file, self._connection.get_bytes(path, theme=theme, width=width))
