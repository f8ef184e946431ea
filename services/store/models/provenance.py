"""Provenances of experiments, and the running supervisors."""

from datetime import datetime
from typing import Any

from sqlalchemy import ForeignKey, String
from sqlalchemy.orm import Mapped, mapped_column

from gaplab.services.store.clock import now
from gaplab.services.store.models.base import Base


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
