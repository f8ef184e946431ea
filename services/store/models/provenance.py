"""What experiments share: provenances and robots; and the running supervisors."""

from datetime import datetime
from typing import Any

from sqlalchemy import ForeignKey, Index, String
from sqlalchemy.orm import Mapped, mapped_column

from gaplab.services.store.clock import now
from gaplab.services.store.models.base import Base
from gaplab.services.world.robot_files import MOST_BYTES


class ProvenanceRow(Base):
    """One distinct provenance; its id is a hash of its facts."""

    __tablename__ = "provenance"

    id: Mapped[str] = mapped_column(String(32), primary_key=True)
    facts: Mapped[dict[str, Any]]
    created_at: Mapped[datetime] = mapped_column(default=now())


class ExperimentProvenanceRow(Base):
    """A provenance that computed an experiment, and the time of the first claim under it."""

    __tablename__ = "experiment_provenance"

    experiment_id: Mapped[str] = mapped_column(ForeignKey("experiment.id"), primary_key=True)
    provenance_id: Mapped[str] = mapped_column(ForeignKey("provenance.id"), primary_key=True)
    since: Mapped[datetime] = mapped_column(default=now())


class SupervisorRow(Base):
    """A supervisor that works, or that ended without saying so."""

    __tablename__ = "supervisor"

    owner: Mapped[str] = mapped_column(String(200), primary_key=True)
    started_at: Mapped[datetime] = mapped_column(default=now())
    heartbeat_at: Mapped[datetime] = mapped_column(default=now())


class RobotRow(Base):
    """A robot file; it never changes, and specs name it by its hash.

    Attributes:
        sha256: of the canonical text, in hexadecimal.
        name: name of the robot; several files may have it, and the newest is meant by it.
        text: canonical text of the file.
    """

    __tablename__ = "robot"
    __table_args__ = (Index(None, "name", "created_at"),)

    sha256: Mapped[str] = mapped_column(String(64), primary_key=True)
    name: Mapped[str] = mapped_column(String(60))
    text: Mapped[str] = mapped_column(String(MOST_BYTES))
    created_at: Mapped[datetime] = mapped_column(default=now())
