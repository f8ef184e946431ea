"""Tokens: inserted, found, used, revoked; never removed."""

from dataclasses import dataclass
from datetime import timedelta

from sqlalchemy import func, select, update
from sqlalchemy.orm import Session

from gaplab.schemas.access import Role
from gaplab.services.core.errors import NotFound
from gaplab.services.store.clock import moment, now
from gaplab.services.store.models import TokenRow
from gaplab.services.store.queries.experiments import new_id
from gaplab.services.store.statements import storable

USED_EVERY = timedelta(minutes=1)
"""How exactly it is known when a token was last used; a write with every request would cost more than it tells."""


@dataclass(frozen=True)
class Known:
    """A token as it is checked.

    Attributes:
        id: its public part.
        role: what it permits.
        digest: of its secret part.
        revoked: whether it admits nobody any more.
        stale: whether its last use should be noted anew.
    """

    id: str
    role: Role
    digest: str
    revoked: bool
    stale: bool


def insert(session: Session, name: str, role: Role, digest: str) -> TokenRow:
    """A new token."""
    row = TokenRow(id=new_id(), name=storable(name), role=role, digest=digest, created_at=moment(session))
    session.add(row)
    session.flush()
    return row


def find(session: Session, id_: str) -> Known | None:
    """The token of that id, revoked or not; None if there is none."""
    found = session.execute(select(TokenRow, now()).where(TokenRow.id == storable(id_))).first()
    if found is None:
        return None
    row, present = found
    stale = row.last_used_at is None or present - row.last_used_at > USED_EVERY
    return Known(row.id, row.role, row.digest, revoked=row.revoked_at is not None, stale=stale)


def use(session: Session, id_: str) -> None:
    """Note that the token was used now."""
    session.execute(update(TokenRow).where(TokenRow.id == id_).values(last_used_at=now()))


def listed(session: Session) -> tuple[TokenRow, ...]:
    """All tokens, revoked ones too, the oldest first."""
    return tuple(session.scalars(select(TokenRow).order_by(TokenRow.created_at, TokenRow.id)))


def revoke(session: Session, id_: str) -> TokenRow:
    """The token, which admits nobody from now on; revoking it twice changes nothing.

    Raises:
        NotFound: there is no such token.
    """
    revoked = func.coalesce(TokenRow.revoked_at, now())
    session.execute(update(TokenRow).where(TokenRow.id == storable(id_)).values(revoked_at=revoked))
    if (row := session.get(TokenRow, storable(id_), populate_existing=True)) is None:
        msg = f"there is no token {id_!r}"
        raise NotFound(msg)
    return row


def any_ever(session: Session) -> bool:
    """Whether a token was ever made."""
    return session.scalar(select(TokenRow.id).limit(1)) is not None


def any_valid(session: Session) -> bool:
    """Whether a token admits anyone."""
    return session.scalar(select(TokenRow.id).where(TokenRow.revoked_at.is_(None)).limit(1)) is not None
