"""What simulators answered in steps that are under way."""

from sqlalchemy import ForeignKey
from sqlalchemy.orm import Mapped, mapped_column

from gaplab.services.store.models.base import Base


class CheckpointRow(Base):
    """A part of one step; it is gone once the step is recorded, and nothing but time is lost without it.

    Attributes:
        step: its place in the log of its repetition.
        part: its number within the step.
        answers: digests and fitnesses, as `gaplab.services.core.answers` packs them; no other module reads them.
        seconds: of work that they took.
    """

    __tablename__ = "checkpoint"

    repetition_id: Mapped[int] = mapped_column(ForeignKey("repetition.id"), primary_key=True, autoincrement=False)
    step: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    part: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    answers: Mapped[bytes]
    seconds: Mapped[float]
