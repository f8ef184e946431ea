"""Access: the caller of a request, by its token, and what its role permits. Each function is one transaction.

A token is `gaplab_ID_SECRET`. Only the SHA-256 of the secret is stored. The secret has 256 random bits, too many to try
out; the slow hash that chosen passwords need would only add its time to every request.
"""

import hmac
import re
from dataclasses import dataclass
from datetime import timedelta
from hashlib import sha256
from ipaddress import ip_address
from secrets import token_hex

from sqlalchemy import func, select, update

from gaplab.schemas.access import Role, TokenRead
from gaplab.services.core.errors import Forbidden, GaplabError
from gaplab.services.store.clock import moment, now
from gaplab.services.store.models import TokenRow
from gaplab.services.store.queries.experiments import new_id
from gaplab.services.store.session import Session, Store, snapshot, transaction
from gaplab.services.store.statements import existing, storable

MAKE_ONE = "`gaplab token create --role admin` makes one"

NOTED_EVERY = timedelta(minutes=1)
"""Precision of a token's last use; a write with every request would be too costly."""

_NO_DIGEST = "0" * 64
"""Digest to compare with if no such token exists, so that the answer takes as long."""

_TOKEN = re.compile(r"gaplab_([a-z0-9]{1,32})_([0-9a-f]{64})")


class Unauthenticated(GaplabError):
    """The request has no token, or an invalid one."""

    kind, title = "unauthenticated", "A valid token is needed"


@dataclass(frozen=True)
class Caller:
    """The sender of a request.

    Attributes:
        token: id of its token; None if no token is required.
        role: what it may do.
    """

    token: str | None
    role: Role


ANYONE = Caller(None, Role.RUNNER)
"""The caller of an open service on loopback, which sees no hidden values."""


@dataclass(frozen=True)
class NewToken:
    """A token with its secret, which is shown this once.

    Attributes:
        token: the token as lists show it.
        secret: text that a client sends.
    """

    token: TokenRead
    secret: str

    def __repr__(self) -> str:
        """Return a text without the secret."""
        return f"NewToken(token={self.token!r})"


@transaction
def create_token(session: Session, role: Role, name: str | None = None) -> NewToken:
    """Create a token; its secret cannot be read again."""
    id_, secret = new_id(), token_hex(32)
    row = TokenRow(
        id=id_, name=storable(name or role.value), role=role, digest=_digest(secret), created_at=moment(session)
    )
    session.add(row)
    session.flush()
    return NewToken(_view(row), f"gaplab_{id_}_{secret}")


@snapshot
def list_tokens(session: Session) -> tuple[TokenRead, ...]:
    """Return all tokens, revoked ones too, oldest first."""
    return tuple(map(_view, session.scalars(select(TokenRow).order_by(TokenRow.created_at, TokenRow.id))))


@transaction
def revoke_token(session: Session, token_id: str) -> TokenRead:
    """Revoke a token: it admits no request from now on. Revoking it twice changes nothing.

    Raises:
        NotFound: no such token.
    """
    row, id_ = TokenRow, storable(token_id)
    session.execute(update(row).where(row.id == id_).values(revoked_at=func.coalesce(row.revoked_at, now())))
    return _view(existing(session, row, token_id, "token", populate_existing=True))


def authenticate(store: Store, shown: str | None, *, required: bool) -> Caller:
    """Return the caller of a request with this token, or without a token.

    Without one, it is refused if one is `required`, or if any was ever created.

    Raises:
        Unauthenticated: a token is required, and is missing, unknown or revoked.
    """
    if shown is not None:
        return _known(store, shown)
    if not required:
        with store.reading() as session:
            required = session.scalar(select(TokenRow.id).limit(1)) is not None
    if required:
        msg = "this service requires a token: `Authorization: Bearer …`, or GAPLAB_TOKEN for the `gaplab` command"
        raise Unauthenticated(msg)
    return ANYONE


def demand(caller: Caller, role: Role, what: str) -> None:
    """Refuse a caller whose role does not permit an action.

    Raises:
        Forbidden: the message names the action and the required role.
    """
    if not caller.role.permits(role):
        held = f"this token is a {caller.role.value}'s" if caller.token else "none was shown"
        raise Forbidden(f"{what} requires the token of {'an' if role is Role.ADMIN else 'a'} {role.value}; {held}")


def demand_token_beyond_loopback(store: Store, host: str) -> None:
    """Refuse to serve an address beyond loopback as long as there is no valid token.

    Raises:
        Unauthenticated: no token is valid, so anyone who can reach the address could do anything.
    """
    if is_loopback(host):
        return
    with store.reading() as session:
        if session.scalar(select(TokenRow.id).where(TokenRow.revoked_at.is_(None)).limit(1)) is None:
            raise Unauthenticated(f"{host} is reachable from other machines, but no token is valid yet: {MAKE_ONE}")


def is_loopback(host: str) -> bool:
    """Return whether only this machine can reach the host; any name but `localhost` may belong to another machine."""
    if host == "localhost":
        return True
    try:
        return ip_address(host.strip("[]")).is_loopback
    except ValueError:
        return False


def _known(store: Store, shown: str) -> Caller:
    parts = _TOKEN.fullmatch(shown)
    with store.reading() as session:
        token, present = session.get(TokenRow, parts[1]) if parts else None, moment(session)
    genuine = hmac.compare_digest(_digest(parts[2] if parts else ""), token.digest if token else _NO_DIGEST)
    if token is None or not genuine or token.revoked_at is not None:
        raise Unauthenticated("this token is not valid: it is unknown here, or was revoked")
    if token.last_used_at is None or present - token.last_used_at > NOTED_EVERY:
        store.write_at_once(_note_use, token.id)  # the note of its use is welcome, but no reason to wait or to refuse
    return Caller(token.id, token.role)


def _note_use(session: Session, token_id: str) -> None:
    """Note that the token is used now, unless another transaction holds its row in Postgres."""
    free = select(TokenRow.id).where(TokenRow.id == token_id).with_for_update(skip_locked=True)
    if session.scalar(free) is None:
        return
    session.execute(update(TokenRow).where(TokenRow.id == token_id).values(last_used_at=now()))


def _digest(secret: str) -> str:
    return sha256(secret.encode()).hexdigest()


def _view(row: TokenRow) -> TokenRead:
    return TokenRead.model_validate(row, from_attributes=True)
