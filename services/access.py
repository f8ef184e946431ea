"""Access: who asks, by which token, and what that permits. Each function is one transaction.

A token is `gaplab_ID_SECRET`. The secret has 256 random bits, and only its SHA-256 is stored: nobody can try out so
many secrets, so that a slow hash, which passwords need because people choose them, would add nothing but its time to
every request.
"""

import hmac
import re
from contextlib import suppress
from dataclasses import dataclass
from hashlib import sha256
from ipaddress import ip_address
from secrets import token_hex

from gaplab.schemas.access import Role, TokenRead
from gaplab.services.core.errors import Forbidden, StoreUnavailable, Unauthenticated
from gaplab.services.store.models import TokenRow
from gaplab.services.store.queries import tokens
from gaplab.services.store.session import Store

MAKE_ONE = "`gaplab token create --role admin` makes one"

_NOBODY = "0" * 64
"""Compared with where there is no such token, so that the answer takes as long."""

_TOKEN = re.compile(r"gaplab_([a-z0-9]{1,32})_([0-9a-f]{64})")


@dataclass(frozen=True)
class Caller:
    """Who asks.

    Attributes:
        token: the id of the token that was shown; None where none is needed.
        role: what is permitted.
    """

    token: str | None
    role: Role


ANYONE = Caller(None, Role.RUNNER)
"""Whoever reaches an open service on loopback; what is hidden stays hidden from them."""


@dataclass(frozen=True)
class NewToken:
    """A token with its secret, which is shown this once.

    Attributes:
        token: as it is listed.
        secret: what a client sends.
    """

    token: TokenRead
    secret: str

    def __repr__(self) -> str:
        """Without the secret."""
        return f"NewToken(token={self.token!r})"


def create_token(store: Store, role: Role, name: str | None = None) -> NewToken:
    """A new token; its secret cannot be had again."""
    secret = token_hex(32)
    row = store.write(lambda session: tokens.insert(session, name or role.value, role, _digest(secret)))
    return NewToken(_read(row), f"gaplab_{row.id}_{secret}")


def list_tokens(store: Store) -> tuple[TokenRead, ...]:
    """All tokens, revoked ones too, the oldest first."""
    with store.reading() as session:
        return tuple(map(_read, tokens.listed(session)))


def revoke_token(store: Store, id: str) -> TokenRead:
    """The token, which admits nobody from now on.

    Raises:
        NotFound: no such token.
    """
    return _read(store.write(lambda session: tokens.revoke(session, id)))


def authenticate(store: Store, shown: str | None, *, required: bool) -> Caller:
    """Who shows this token, or shows none.

    Args:
        store: that knows the tokens.
        shown: the token; None for none.
        required: whether one is needed even where none was ever made.

    Raises:
        Unauthenticated: no token although one is needed, or one that admits nobody.
    """
    if shown is not None:
        return _known(store, shown)
    if not required:
        with store.reading() as session:
            required = tokens.any_ever(session)
    if required:
        msg = "this service wants a token, as in `Authorization: Bearer …`; the `gaplab` command sends GAPLAB_TOKEN"
        raise Unauthenticated(msg)
    return ANYONE


def demand(caller: Caller, role: Role, what: str) -> None:
    """Do nothing if the caller's role permits it.

    Raises:
        Forbidden: it does not; the message says what wants which role.
    """
    if not caller.role.permits(role):
        held = f"this token is a {caller.role.value}'s" if caller.token else "none was shown"
        msg = f"{what} wants the token of {_article(role)}; {held}"
        raise Forbidden(msg)


def demand_token_beyond_loopback(store: Store, host: str) -> None:
    """Do nothing if the host is loopback, or a token admits someone.

    Raises:
        Unauthenticated: neither; whoever reaches that address could do anything.
    """
    if is_loopback(host):
        return
    with store.reading() as session:
        if not tokens.any_valid(session):
            msg = f"{host} is more than loopback, and there is no token yet to let anyone in: {MAKE_ONE}"
            raise Unauthenticated(msg)


def is_loopback(host: str) -> bool:
    """Whether only this machine reaches the host; a name other than `localhost` may lead anywhere."""
    if host == "localhost":
        return True
    try:
        return ip_address(host.strip("[]")).is_loopback
    except ValueError:
        return False


def _known(store: Store, shown: str) -> Caller:
    parts = _TOKEN.fullmatch(shown)
    with store.reading() as session:
        known = tokens.find(session, parts[1]) if parts else None
    genuine = hmac.compare_digest(_digest(parts[2] if parts else ""), known.digest if known else _NOBODY)
    if known is None or not genuine or known.revoked:
        msg = "this token admits nobody: it is unknown here, or was revoked"
        raise Unauthenticated(msg)
    if known.stale:
        with suppress(StoreUnavailable):  # that it was used is good to know, and no reason to refuse
            store.write(lambda session: tokens.use(session, known.id))
    return Caller(known.id, known.role)


def _digest(secret: str) -> str:
    return sha256(secret.encode()).hexdigest()


def _article(role: Role) -> str:
    return f"an {role.value}" if role is Role.ADMIN else f"a {role.value}"


def _read(row: TokenRow) -> TokenRead:
    return TokenRead(
        id=row.id,
        name=row.name,
        role=row.role,
        created_at=row.created_at,
        last_used_at=row.last_used_at,
        revoked_at=row.revoked_at,
    )
