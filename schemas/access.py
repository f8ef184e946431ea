"""Who may do what: tokens and their roles."""

from datetime import datetime
from enum import StrEnum

from gaplab.schemas.base import Frozen


class Role(StrEnum):
    """What a token permits; each role permits what those before it do."""

    READER = "reader"
    """Looks at everything but what is hidden."""

    RUNNER = "runner"
    """Submits, cancels and changes as well."""

    ADMIN = "admin"
    """May see the hidden reality of an experiment that has not ended."""

    def permits(self, other: "Role") -> bool:
        """Whether it permits what the other does."""
        order = tuple(Role)
        return order.index(self) >= order.index(other)


class TokenRead(Frozen):
    """A token as it is listed, without its secret."""

    id: str
    name: str
    role: Role
    created_at: datetime
    last_used_at: datetime | None = None
    revoked_at: datetime | None = None
