"""The table of robot files."""

from datetime import datetime

from sqlalchemy import Index, String
from sqlalchemy.orm import Mapped, mapped_column

from gaplab.services.core.robot_files import MOST_BYTES
from gaplab.services.store.clock import now
from gaplab.services.store.models.base import Base


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
