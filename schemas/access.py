"""Tokens and their roles."""

from datetime import datetime
from enum import StrEnum

from gaplab.schemas.base import Read


class Role(StrEnum):
    """What a token permits; each role includes the roles before it."""

    READER = "reader"
    """May read everything that is not hidden."""

    RUNNER = "runner"
    """May also submit, edit and control experiments."""

    ADMIN = "admin"
    """May also see the hidden reality of an experiment that has not ended."""

    def permits(self, other: "Role") -> bool:
        """Return whether this role includes the other."""
        order = tuple(Role)
        return order.index(self) >= order.index(other)


class TokenRead(Read):
    """A listed token, without its secret."""

    id: str
    name: str
    role: Role
    created_at: datetime
    last_used_at: datetime | None = None
    revoked_at: datetime | None = None
