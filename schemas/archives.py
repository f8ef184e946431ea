"""Archives: the result of an import, and what is the same when they are computed again."""

from typing import Literal

from pydantic import Field

from gaplab.schemas.base import Frozen, Id, Name, Read

MOST_BYTES_OF_IMPORT = 2**30
"""Size of an archive that an import reads."""


class ImportRead(Read):
    """The result of an import."""

    study: Id
    experiments: tuple[Id, ...] = Field(description="ids of the experiments in this service, in the order of the study")
    renamed: dict[str, str] = Field(
        default_factory=dict,
        description="new ids of experiments and studies whose id was taken, by their id in the archive",
        examples=[{"kx3t9vbm2q": "01f2e3d4c5"}],
    )
    called_off: tuple[str, ...] = Field(
        (), description="ids of experiments that had not ended: they are CANCELLED here, and never run"
    )


Outcome = Literal["same", "different", "not computed"]


class RepetitionRerun(Frozen):
    """One repetition of an archive, computed again."""

    experiment: Id
    name: Name
    repetition: int
    outcome: Outcome
    steps: int = Field(description="steps with the same bits, up to the first that differs")
    stored_steps: int = Field(description="steps in the archive")
    code: str | None = Field(
        None, description="processor's code that gives these bits, if it is not the usual one", examples=["AVX-512"]
    )
    reason: str | None = Field(None, description="first difference, or why it was not computed")


class RerunRead(Read):
    """The repetitions of an archive, computed again and compared with the stored numbers."""

    same: int
    different: int
    not_computed: int
    other_versions: tuple[str, ...] = Field(description="software and machines that differ from those of the archive")
    repetitions: tuple[RepetitionRerun, ...]
