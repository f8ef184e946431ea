"""Archives: their manifest, and the result of an import."""

from typing import Annotated, Literal

from pydantic import Field

from gaplab.schemas.base import Frozen, Id

FORMAT = 1
"""Version of the archive format: exports write it, and imports refuse a later one."""

MOST_BYTES_OF_IMPORT = 2**30
"""Size of an archive that an import reads."""

Digest = Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]
Extent = Annotated[int, Field(strict=True, ge=0)]


class Member(Frozen):
    """A file in an archive."""

    sha256: Digest
    bytes: Extent
    rows: Extent = Field(description="lines of JSON, or rows of Parquet")


class Manifest(Frozen):
    """`manifest.json`: origin and contents of an archive."""

    format: Annotated[int, Field(strict=True, ge=1)]
    gaplab: str = Field(max_length=100, description="version of gaplab that wrote the archive")
    revision: str = Field(max_length=32, description="revision of the database that the archive was written from")
    kind: Literal["study", "experiment"]
    id: str = Field(max_length=32)
    members: dict[str, Member]


class ImportRead(Frozen):
    """The result of an import."""

    study: Id | None = Field(default=None, description="id of the study; null for the archive of a single experiment")
    experiments: tuple[Id, ...] = Field(description="ids of the experiments in this service, in the order of the study")
    renamed: dict[str, str] = Field(
        default_factory=dict,
        description="new ids of experiments and studies whose id was taken, by their id in the archive",
        examples=[{"kx3t9vbm2q": "01f2e3d4c5"}],
    )
    called_off: tuple[str, ...] = Field(
        default=(), description="ids of experiments that had not ended: they are CANCELLED here, and never run"
    )
