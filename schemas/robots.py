"""Robots that come from a file: where they come from."""

from typing import Any

from pydantic import Field

from gaplab.schemas.base import Frozen

MOST_LOSSES = 2_000
"""Largest number of lines in which a robot file says what its import lost or changed."""


class RobotSource(Frozen):
    """The file that a robot was imported from."""

    file: str = Field(min_length=1, max_length=200, description="name of the file, without folders")
    sha256: str = Field(pattern=r"^[0-9a-f]{64}$", description="hash of the file's content")
    options: dict[str, Any] = Field(
        default_factory=dict, description="options of the import; the same file with the same options gives the robot"
    )
