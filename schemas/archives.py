"""Archives: what one says about itself, and what an import answers."""

from typing import Annotated, Literal

from pydantic import Field

from gaplab.schemas.base import Frozen, Id

FORMAT = 1
"""Of the archives that are written now, and the latest that is read."""

Digest = Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]
Extent = Annotated[int, Field(strict=True, ge=0)]


class Member(Frozen):
    """A file in an archive."""

    sha256: Digest
    bytes: Extent
    rows: Extent = Field(description="lines of JSON, or rows of Parquet")


class Manifest(Frozen):
    """`manifest.json`: what wrote the archive, and what is in it."""

    format: Annotated[int, Field(strict=True, ge=1)]
    gaplab: str = Field(max_length=100, description="the version that wrote it")
    revision: str = Field(max_length=32, description="of the database that it was written from")
    kind: Literal["study", "experiment"]
    id: str = Field(max_length=32)
    members: dict[str, Member]


class ImportRead(Frozen):
    """What an import stored."""

    study: Id | None = Field(default=None, description="id of the study, if the archive is of one")
    experiments: tuple[Id, ...] = Field(description="their ids here, in the order of the study")
    renamed: dict[str, str] = Field(
        default_factory=dict,
        description="ids that were taken here, each with the one that it has now",
        examples=[{"kx3t9vbm2q": "01f2e3d4c5"}],
    )
    called_off: tuple[str, ...] = Field(
        default=(), description="ids of those that had not ended: they are CANCELLED here, and nothing of them is run"
    )
