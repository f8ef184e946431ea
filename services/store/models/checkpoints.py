"""Checkpoints: answers of simulators in steps that are not recorded yet."""

from sqlalchemy import ForeignKey
from sqlalchemy.orm import Mapped, mapped_column

from gaplab.services.store.models.base import Base


class CheckpointRow(Base):
    """A part of one step. It is deleted once the step is recorded; without it, only time is lost.

    Attributes:
        step: place of the step in the log of its repetition.
        part: number of the part within the step.
        answers: digests and fitnesses, packed by `gaplab.services.core.answers`; no other module reads them.
        seconds: seconds of work that they took.
    """

    __tablename__ = "checkpoint"

    repetition_id: Mapped[int] = mapped_column(ForeignKey("repetition.id"), primary_key=True, autoincrement=False)
    step: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    part: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    answers: Mapped[bytes]
    seconds: Mapped[float]
