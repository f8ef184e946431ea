"""Requests that create something, executed once for each idempotency key."""

import json
from collections.abc import Callable
from dataclasses import dataclass
from datetime import timedelta
from hashlib import sha256
from typing import Generic, TypeVar

from sqlalchemy import delete, select, update

from gaplab.schemas.base import Frozen
from gaplab.services.core.errors import GaplabError
from gaplab.services.experiments.limits import Admission
from gaplab.services.store.clock import moment
from gaplab.services.store.models import IdempotencyRow
from gaplab.services.store.session import Session, Store
from gaplab.services.store.statements import insert_new

KEYS_LIVE = timedelta(days=7)
"""Time for which an idempotency key is kept."""

R = TypeVar("R", bound=Frozen)


class KeyReused(GaplabError):
    """The idempotency key was used for another request."""

    kind, title = "key-reused", "The idempotency key belongs to another request"


@dataclass(frozen=True)
class Once(Generic[R]):
    """The answer to a request that may be a repetition, and whether it was stored earlier, so that no work was done."""

    answer: R
    replayed: bool = False


def once(
    store: Store, admitted: Admission, asked: Frozen, kind: type[R], work: Callable[[Session], R], *, of: str = ""
) -> Once[R]:
    """Do the work and store its answer under the key, in one transaction; or return the stored answer.

    This waits for another transaction with the same key: in Postgres at the unique key, in SQLite for the one writer.
    Without a key, the work is always done. The class of what was asked identifies the endpoint; `of` is the id of what
    the request is about, so that a key fits this alone.

    Raises:
        KeyReused: the key was used for another request.
    """
    key, caller, row = admitted.key, admitted.token or "", IdempotencyRow
    if key is None:
        return Once(store.write(work))
    text = json.dumps([type(asked).__name__ + of, asked.model_dump(mode="json")], sort_keys=True)
    digest = sha256(text.encode()).hexdigest()
    ours = (row.caller == caller) & (row.key == key)

    def transaction(session: Session) -> Once[R]:
        session.execute(delete(row).where(row.created_at < moment(session) - KEYS_LIVE))
        values = {"caller": caller, "key": key, "digest": digest, "created_at": moment(session)}
        if session.execute(insert_new(session, row).values(values).returning(row.key)).first():
            answer = work(session)
            session.execute(update(row).where(ours).values(answer=answer.model_dump(mode="json")))
            return Once(answer)
        known = session.execute(select(row.digest, row.answer).where(ours)).one()
        if known.digest != digest:
            raise KeyReused(f"the idempotency key {key!r} was used for another request; a new request needs a new key")
        return Once(kind.model_validate(known.answer), replayed=True)

    return store.write(transaction)
