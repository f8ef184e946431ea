"""The log of a repetition: its steps, which are its results."""

from datetime import datetime
from enum import StrEnum
from typing import Any

from sqlalchemy import BigInteger, ForeignKey, Index, String, text
from sqlalchemy.orm import Mapped, mapped_column

from gaplab.services.store.clock import now
from gaplab.services.store.models.base import Base, Reason, words

LOG = 0
"""The branch of the steps that count."""


class StepKind(StrEnum):
    """What a step did; in an iteration, steps have this order."""

    SELECTED = "selected"
    MEASURED = "measured"
    TUNED = "tuned"
    TRANSFERRED = "transferred"
    PROBED = "probed"


_PROBES = text("kind = 'probed'")
_CURVE = ("repetition_id", "branch", "kind", "iteration", "recorded")


class StepRow(Base):
    """One step of a log, or of a branch of it that a correction closed.

    Attributes:
        branch: `LOG`, or the number of the closed branch.
        place: its place in the log, from 0.
        fitness: fitness in reality of what was measured or probed, in simulation of what was transferred.
        recorded: what the curve shows, if it is a probe.
        measured_by: engine or operator of a measurement; NULL if nothing was measured.
        rollouts, failures, saved: its cost, as in `gaplab.services.core.types.Cost`.
        seconds: seconds of work.
        at: when it was recorded.
        body: vectors and simulators, as `gaplab.services.store.queries.logs` packs them; last, since it is long.
    """

    __tablename__ = "step"
    __table_args__ = (Index("ix_step_curve", *_CURVE, sqlite_where=_PROBES, postgresql_where=_PROBES),)

    repetition_id: Mapped[int] = mapped_column(ForeignKey("repetition.id"), primary_key=True)
    branch: Mapped[int] = mapped_column(primary_key=True, autoincrement=False, default=LOG)
    kind: Mapped[StepKind] = mapped_column(words(StepKind, "kind"), primary_key=True)
    iteration: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    place: Mapped[int]
    fitness: Mapped[float | None]
    recorded: Mapped[float | None]
    measured_by: Mapped[str | None] = mapped_column(String(200))
    rollouts: Mapped[int] = mapped_column(BigInteger, default=0)
    failures: Mapped[int] = mapped_column(BigInteger, default=0)
    saved: Mapped[int] = mapped_column(BigInteger, default=0)
    seconds: Mapped[float] = mapped_column(default=0.0)
    at: Mapped[datetime] = mapped_column(default=now())
    body: Mapped[dict[str, Any]]


class BranchRow(Base):
    """A branch that a correction closed: the steps with its number, which count nowhere.

    Attributes:
        number: from 1, within the repetition.
        iteration: iteration of the measurement that was corrected.
    """

    __tablename__ = "branch"

    repetition_id: Mapped[int] = mapped_column(ForeignKey("repetition.id"), primary_key=True, autoincrement=False)
    number: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    iteration: Mapped[int]
    reason: Mapped[str] = mapped_column(Reason)
    closed_at: Mapped[datetime] = mapped_column(default=now())
