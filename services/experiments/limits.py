"""Whether a submission is let in: within the limits, and once for each idempotency key."""

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import timedelta
from hashlib import sha256
from typing import Generic, TypeVar

from gaplab.schemas.base import Frozen
from gaplab.schemas.resolved import ResolvedSpec
from gaplab.services.core.errors import InvalidSpec, KeyReused, LimitReached, Violation
from gaplab.services.settings import Limits, variable_of
from gaplab.services.specs.resolution import expected_rollouts
from gaplab.services.store.queries import admission, idempotency
from gaplab.services.store.queries.admission import Load
from gaplab.services.store.session import Session, Store

KEYS_LIVE = timedelta(days=7)
"""How long an idempotency key stands for the request that it came with."""

RETRY_AFTER_S = 60
"""What is full of experiments is full for minutes at least."""

R = TypeVar("R", bound=Frozen)


@dataclass(frozen=True)
class Admission:
    """Who submits, and within which limits.

    Attributes:
        token: id of the token that was shown; None where none is needed.
        limits: None for none, as for programs that use the database directly.
        key: the idempotency key that came with the request.
    """

    token: str | None = None
    limits: Limits | None = None
    key: str | None = None


FREELY = Admission()


@dataclass(frozen=True)
class Once(Generic[R]):
    """The answer to a request that may have come before.

    Attributes:
        answer: the same each time.
        replayed: whether it was given before, and nothing was done now.
    """

    answer: R
    replayed: bool = False


def once(store: Store, admitted: Admission, asked: Frozen, kind: type[R], work: Callable[[Session], R]) -> Once[R]:
    """Do the work and keep its answer under the key, in one transaction; or give the answer that is kept.

    Args:
        store: of what is created.
        admitted: with the key; without one, the work is done.
        asked: the body; its class tells one endpoint from another.
        kind: of the answer.
        work: in a transaction.

    Raises:
        KeyReused: the key stands for another request.
    """
    key, caller = admitted.key, admitted.token or ""
    if key is None:
        return Once(store.write(work))
    digest = _digest(asked)

    def transaction(session: Session) -> Once[R]:
        idempotency.forget(session, KEYS_LIVE)
        if (known := idempotency.reserve(session, caller, key, digest)) is None:
            answer = work(session)
            idempotency.keep(session, caller, key, answer.model_dump(mode="json"))
            return Once(answer)
        if known.digest != digest:
            msg = f"the idempotency key {key!r} stands for another request already; a new request needs a new key"
            raise KeyReused(msg)
        return Once(kind.model_validate(known.answer), replayed=True)

    return store.write(transaction)


def check_extent(specs: Sequence[ResolvedSpec], limits: Limits | None) -> None:
    """Do nothing if one submission may ask for so much.

    Raises:
        InvalidSpec: it may not; the message names the limit.
    """
    if limits is None:
        return
    iterations = max(each.iterations for each in specs)
    repetitions = sum(each.repetitions for each in specs)
    asked = {"iterations": iterations, "repetitions": repetitions}
    violations = [
        Violation(f"/{name}", value, _too_much(name, value, getattr(limits, name)), f"at most {getattr(limits, name)}")
        for name, value in asked.items()
        if value > getattr(limits, name)
    ]
    if violations:
        raise InvalidSpec(violations)


def check_load(session: Session, specs: Sequence[ResolvedSpec], admitted: Admission, *, done: int = 0) -> None:
    """Do nothing if there is room for these, in the transaction that inserts them; `done` of their rollouts are over.

    Raises:
        LimitReached: there is none; the message names the limit.
    """
    if (limits := admitted.limits) is None:
        return
    admission.one_at_a_time(session)
    under_way = admission.load(session)
    own = under_way.get(admitted.token, Load(0, 0))
    rollouts = max(0, sum(expected_rollouts(each) * each.repetitions for each in specs) - done)
    _check("experiments_per_token", own.experiments, len(specs), limits)
    _check("rollouts_per_token", own.rollouts, rollouts, limits)
    _check("experiments", sum(each.experiments for each in under_way.values()), len(specs), limits)
    _check("rollouts", sum(each.rollouts for each in under_way.values()), rollouts, limits)


def _check(name: str, present: int, more: int, limits: Limits) -> None:
    if present + more > (limit := getattr(limits, name)):
        noun, _, per_token = name.partition("_")
        whose = "of this token " if per_token else ""
        msg = (
            f"{present:,} {noun} {whose}are under way, and with {more:,} more there would be over {limit:,} "
            f"({variable_of(name)})"
        )
        raise LimitReached(msg, RETRY_AFTER_S)


def _too_much(name: str, value: int, limit: int) -> str:
    return f"this service takes at most {limit:,} {name} in one submission ({variable_of(name)}), not {value:,}"


def _digest(asked: Frozen) -> str:
    text = json.dumps([type(asked).__name__, asked.model_dump(mode="json")], sort_keys=True)
    return sha256(text.encode()).hexdigest()
