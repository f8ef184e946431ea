"""Files that specs name, robots and pools: where they come from, and what lists say of them."""

from enum import StrEnum
from typing import Any

from pydantic import Field

from gaplab.schemas.base import Frozen, Moment, Read

EXAMPLE: dict[str, Any] = {
    "format_version": 1,
    "name": "hopper",
    "usual_controller": {"name": "square_pulses"},
    "usual_task": {"name": "walk"},
    "world": {
        "bodies": [
            {"name": "trunk", "mass_kg": 1.0, "shape": {"kind": "box", "size_m": [0.3, 0.2, 0.05]}},
            {
                "name": "leg",
                "mass_kg": 0.1,
                "shape": {"kind": "sphere", "radius_m": 0.03},
                "center_m": [0.0, 0.0, -0.12],
            },
        ],
        "joints": [
            {
                "name": "hip",
                "parent": "trunk",
                "child": "leg",
                "origin_m": [0.0, 0.0, 0.0],
                "axis": [0.0, 1.0, 0.0],
                "motor": {"position_gain": 0.1, "max_torque_nm": 4.0},
            }
        ],
        "start_height_m": 0.15,
    },
}
"""A robot file: a trunk on one leg."""

MOST_LOSSES = 2_000
"""Largest number of lines in which a robot file says what its import lost or changed."""


class FileKind(StrEnum):
    """What a stored file is."""

    ROBOT = "robot"
    POOL = "pool"


class RobotSource(Frozen):
    """The file that a robot was imported from."""

    file: str = Field(min_length=1, max_length=200, description="name of the file, without folders")
    sha256: str = Field(pattern=r"^[0-9a-f]{64}$", description="hash of the file's content")
    options: dict[str, Any] = Field(
        default_factory=dict, description="options of the import; the same file with the same options gives the robot"
    )


class FileRead(Read):
    """A file, as it is stored."""

    sha256: str = Field(description="hash of the file, which specs have", examples=["5f2c…"])
    name: str = Field(description="a spec means the newest file of this name", examples=["a1"])
    lost: tuple[str, ...] = Field(
        description="what its import lost, left out or changed", examples=[("transmission: hip",)]
    )
    created_at: Moment


class RobotRead(FileRead):
    """A robot from a file, as it is stored."""

    file: str | None = Field(description="file that it was imported from", examples=["a1.urdf"])
    bodies: int
    actuators: int
    mass_kg: float = Field(examples=[12.5])


class PoolRead(FileRead):
    """A stored pool: recordings of what a robot did."""

    origin: str = Field(description="where the recordings come from, in words", examples=["tosses.parquet"])
    recordings: int = Field(examples=[40])
    sensors: tuple[str, ...] = Field(description="what was read", examples=[("angle elbow",)])
    actuators: tuple[str, ...] = Field(description="what was commanded", examples=[("elbow",)])
    seconds: float = Field(description="time of the last reading", examples=[20.0])
