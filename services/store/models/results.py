"""The log of a repetition, whose steps are its results; and physical measurements: requests, answers, attachments."""

from datetime import datetime
from enum import StrEnum
from typing import Any

from sqlalchemy import BigInteger, ForeignKey, Index, LargeBinary, String, Text, UniqueConstraint, text
from sqlalchemy.orm import Mapped, mapped_column

from gaplab.schemas.measurements import AnswerState, RequestState
from gaplab.schemas.records import MeasurementKind
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


class RequestRow(Base):
    """A measurement that a repetition waits for, or waited for.

    Attributes:
        place: place of the measurement's step in the log of the repetition.
        bench: name of the physical robot.
        held: what the spellings of the bench share, until its holder ends the take, also if the request is withdrawn;
            else NULL. It is unique, so a bench has one holder at a time.
        takes: number of the latest take; it fences the answer of an earlier one.
        unanswered: takes in a row that ended without an answer.
        taken_until: time at which the take ends unless a heartbeat extends it, to be shown; it changes with each one.
        lease_s: seconds that a heartbeat extends it by.
        safety: what the latest tuned simulators expect of the controller.
        branch: number of the closed branch that it belongs to; NULL if it belongs to none.
        same_as: id of an earlier request with the same controller, whose answer is this one's too; NULL if none.
    """

    __tablename__ = "request"
    __table_args__ = (
        UniqueConstraint("held"),
        Index(None, "repetition_id", "place"),
        Index(None, "state", "created_at", "id"),
        Index(None, "state", "bench", "created_at", "id"),
        Index(None, "state", "taken_until"),
    )

    id: Mapped[str] = mapped_column(String(32), primary_key=True)
    repetition_id: Mapped[int] = mapped_column(ForeignKey("repetition.id"))
    place: Mapped[int]
    iteration: Mapped[int]
    kind: Mapped[MeasurementKind]
    genome: Mapped[list[float]]
    bench: Mapped[str] = mapped_column(String(200))
    state: Mapped[RequestState] = mapped_column(default=RequestState.OPEN)
    held: Mapped[str | None] = mapped_column(String(200))
    takes: Mapped[int] = mapped_column(default=0)
    unanswered: Mapped[int] = mapped_column(default=0)
    taken_by: Mapped[str | None] = mapped_column(String(200))
    taken_until: Mapped[datetime | None]
    lease_s: Mapped[float | None]
    safety: Mapped[dict[str, Any] | None]
    branch: Mapped[int | None]
    same_as: Mapped[str | None] = mapped_column(String(32))
    created_at: Mapped[datetime] = mapped_column(default=now())
    ended_at: Mapped[datetime | None]


class AnswerRow(Base):
    """An answer to a request; only its state and the reason for that ever change.

    Attributes:
        take: number of the take that it is of; NULL if nobody took the request.
        values: fitness of each repeat; NULL if the measurement failed.
        readings: of each repeat, a row for each time and a column for each sensor.
        traces: the traces that the values were computed from, with the lags of their clocks.
        doubts: what is unlikely about it; NULL if nothing is, or a person confirmed it.
        failed: why there are no values.
        reason: why it was corrected, voided or dismissed.
        replaces: id of the answer that it corrects.
        token_id: id of the token that sent it; NULL without a token.
    """

    __tablename__ = "answer"
    __table_args__ = (Index(None, "request_id", "at", "id"),)

    id: Mapped[str] = mapped_column(String(32), primary_key=True)
    repetition_id: Mapped[int] = mapped_column(ForeignKey("repetition.id"), index=True)
    request_id: Mapped[str] = mapped_column(ForeignKey("request.id"))
    take: Mapped[int | None]
    state: Mapped[AnswerState]
    values: Mapped[list[float] | None]
    readings: Mapped[list[list[list[float | None]]] | None]
    failed: Mapped[str | None] = mapped_column(Reason)
    operator: Mapped[str] = mapped_column(String(200))
    note: Mapped[str | None] = mapped_column(Text)
    attachments: Mapped[list[str] | None]
    traces: Mapped[list[dict[str, Any]] | None]
    doubts: Mapped[list[str] | None]
    replaces: Mapped[str | None] = mapped_column(String(32))
    reason: Mapped[str | None] = mapped_column(Reason)
    token_id: Mapped[str | None] = mapped_column(String(32))
    at: Mapped[datetime] = mapped_column(default=now())


class AttachmentRow(Base):
    """A file that belongs to answers.

    Attributes:
        id: SHA-256 of the content, in hexadecimal.
    """

    __tablename__ = "attachment"

    id: Mapped[str] = mapped_column(String(64), primary_key=True)
    name: Mapped[str] = mapped_column(String(200))
    media_type: Mapped[str] = mapped_column(String(100))
    content: Mapped[bytes] = mapped_column(LargeBinary)
    created_at: Mapped[datetime] = mapped_column(default=now())
