"""Tables of tokens and of answered idempotent requests."""

from datetime import datetime
from typing import Any

from sqlalchemy import Enum, Index, String
from sqlalchemy.orm import Mapped, mapped_column

from gaplab.schemas.access import Role
from gaplab.services.store.models.base import Base


class TokenRow(Base):
    """A token; its secret is not stored.

    Attributes:
        id: the public part of the token, by which it is found, listed and revoked.
        digest: SHA-256 of the secret part, in hexadecimal.
        last_used_at: time of the last use, to the minute.
        revoked_at: time since which it is invalid; the row stays, so revoking the last token does not open the service.
    """

    __tablename__ = "token"

    id: Mapped[str] = mapped_column(String(32), primary_key=True)
    name: Mapped[str] = mapped_column(String(200))
    role: Mapped[Role] = mapped_column(
        Enum(
            Role,
            native_enum=False,
            create_constraint=True,
            length=16,
            name="role",
            values_callable=lambda roles: [each.value for each in roles],
        )
    )
    digest: Mapped[str] = mapped_column(String(64))
    created_at: Mapped[datetime]
    last_used_at: Mapped[datetime | None]
    revoked_at: Mapped[datetime | None]


class IdempotencyRow(Base):
    """A request that created something under an idempotency key, with its answer.

    Attributes:
        caller: id of the sender's token; empty if no token is required. Keys of different callers are independent.
        digest: SHA-256 of the endpoint and the body.
        answer: answer as it was sent; NULL only within the transaction that computes it.
    """

    __tablename__ = "idempotency"
    __table_args__ = (Index(None, "created_at"),)

    caller: Mapped[str] = mapped_column(String(32), primary_key=True)
    key: Mapped[str] = mapped_column(String(255), primary_key=True)
    digest: Mapped[str] = mapped_column(String(64))
    answer: Mapped[dict[str, Any] | None]
    created_at: Mapped[datetime]
