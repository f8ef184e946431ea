"""Robots that come from a file: where they come from."""

from typing import Any

from pydantic import Field

from gaplab.schemas.base import Frozen, Moment

MOST_LOSSES = 2_000
"""Largest number of lines in which a robot file says what its import lost or changed."""


class RobotSource(Frozen):
    """The file that a robot was imported from."""

    file: str = Field(min_length=1, max_length=200, description="name of the file, without folders")
    sha256: str = Field(pattern=r"^[0-9a-f]{64}$", description="hash of the file's content")
    options: dict[str, Any] = Field(
        default_factory=dict, description="options of the import; the same file with the same options gives the robot"
    )


class RobotRead(Frozen):
    """A robot from a file, as it is stored."""

    sha256: str = Field(description="hash of the file, which specs have", examples=["5f2c…"])
    name: str = Field(description="a spec means the newest robot of this name", examples=["a1"])
    file: str | None = Field(description="file that it was imported from", examples=["a1.urdf"])
    bodies: int
    actuators: int
    mass_kg: float
    lost: tuple[str, ...] = Field(description="what its import lost or changed", examples=[("transmission: hip",)])
    created_at: Moment
