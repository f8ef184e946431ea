"""Recomputed archives: which repetitions have the same bits, and what differs."""

from typing import Literal

from pydantic import Field

from gaplab.schemas.base import Frozen, Id, Name

Outcome = Literal["same", "different", "not computed"]


class RepetitionRerun(Frozen):
    """One repetition of an archive, computed again."""

    experiment: Id
    name: Name
    repetition: int
    outcome: Outcome
    steps: int = Field(description="steps with the same bits, up to the first that differs")
    stored_steps: int = Field(description="steps in the archive")
    reason: str | None = Field(default=None, description="first difference, or why it was not computed")


class RerunRead(Frozen):
    """An archive, computed again."""

    same: int
    different: int
    not_computed: int
    other_versions: tuple[str, ...] = Field(description="software and machines that differ from those of the archive")
    repetitions: tuple[RepetitionRerun, ...]
