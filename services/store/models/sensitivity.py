"""Sensitivity checks."""

from datetime import datetime
from typing import Any

from sqlalchemy import Index, String
from sqlalchemy.orm import Mapped, mapped_column

from gaplab.services.store.models.leased import LeasedRow


class SensitivityRow(LeasedRow):
    """A sensitivity check, with its lease.

    Attributes:
        id: hash of the spec, so that equal subjects are checked once.
        spec: robot, engine and tunables, and the size of the check.
        found: effect of each tunable on fitness; NULL until it is known.
    """

    __tablename__ = "sensitivity"
    __table_args__ = (Index(None, "state", "created_at"),)

    id: Mapped[str] = mapped_column(String(32), primary_key=True)
    spec: Mapped[dict[str, Any]]
    found: Mapped[list[dict[str, Any]] | None]
    created_at: Mapped[datetime]
