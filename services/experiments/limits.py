"""Limits of submissions: the size of one, and the work in progress."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from difflib import get_close_matches

from sqlalchemy import case, func, select

from gaplab.schemas.lifecycle import OPEN
from gaplab.schemas.resolved import ResolvedSpec
from gaplab.services.core.errors import InvalidSpec, LimitReached, Violation
from gaplab.services.settings import Limits, variable_of
from gaplab.services.store.models import ExperimentRow, RepetitionRow
from gaplab.services.store.queries.requests import bench_key, spellings
from gaplab.services.store.session import Session
from gaplab.services.store.statements import wait_for_others
from gaplab.services.world.robot_library import label_of

RETRY_AFTER_S = 60
"""A service at its limit stays there for minutes at least."""

_LOCK = 0x67617071  # among the advisory locks of a Postgres database


class CostUnconfirmed(InvalidSpec):
    """The cost is above the limit, or a name is unlikely, and the request does not confirm it."""

    kind, title = "cost-unconfirmed", "This needs a confirmation"


@dataclass(frozen=True)
class Admission:
    """The sender of a submission, and its limits.

    Attributes:
        token: id of the sender's token; None if no token is required.
        limits: limits to check; None for none, as for programs that use the database directly.
        key: idempotency key of the request.
        cost_known: whether the request confirms its cost, however high.
    """

    token: str | None = None
    limits: Limits | None = None
    key: str | None = None
    cost_known: bool = False


FREELY = Admission()


def check_extent(specs: Sequence[ResolvedSpec], limits: Limits | None) -> None:
    """Refuse a submission that is too large.

    Raises:
        InvalidSpec: it is; the message names the limit.
    """
    if limits is None:
        return
    asked = {
        "iterations": max(each.iterations for each in specs),
        "repetitions": sum(each.repetitions for each in specs),
    }
    violations = []
    for name, value in asked.items():
        if value > (limit := getattr(limits, name)):
            permitted = f"this service takes at most {limit:,} {name} in one submission ({variable_of(name)})"
            violations.append(Violation(f"/{name}", value, f"{permitted}, not {value:,}", f"at most {limit}"))
    if violations:
        raise InvalidSpec(violations)


def check_load(session: Session, admitted: Admission, *, experiments: int, rollouts: int) -> None:
    """Refuse a submission of so many experiments and rollouts if it would exceed the work in progress.

    The transaction is the one that inserts it.

    Raises:
        LimitReached: the message names the limit.
    """
    if (limits := admitted.limits) is None:
        return
    wait_for_others(session, _LOCK)
    present, left = _load(session)
    _check("experiments_per_token", present[admitted.token], experiments, limits)
    _check("rollouts_per_token", left[admitted.token], rollouts, limits)
    _check("experiments", present.total(), experiments, limits)
    _check("rollouts", left.total(), rollouts, limits)


def _load(session: Session) -> tuple[Counter[str | None], Counter[str | None]]:
    """Return the experiments that have not ended and their remaining rollouts, by the token that submitted them."""
    row, run = ExperimentRow, RepetitionRow
    left = row.rollouts - run.rollouts_done - run.rollouts_saved
    counts = select(row.token_id, func.count()).where(row.state.in_(OPEN)).group_by(row.token_id)
    sums = (
        select(row.token_id, func.sum(case((left > 0, left), else_=0)))
        .join(run, run.experiment_id == row.id)
        .where(row.state.in_(OPEN), run.state.in_(OPEN))
        .group_by(row.token_id)
    )
    rollouts = {token: int(total) for token, total in session.execute(sums)}
    return Counter(dict(session.execute(counts).all())), Counter(rollouts)


def _check(name: str, present: int, more: int, limits: Limits) -> None:
    if present + more > (limit := getattr(limits, name)):
        noun, _, per_token = name.partition("_")
        whose = "of this token " if per_token else ""
        msg = (
            f"{present:,} {noun} {whose}are in progress, and {more:,} more would exceed {limit:,} ({variable_of(name)})"
        )
        raise LimitReached(msg, RETRY_AFTER_S)


CLOSE = 0.8
"""Similarity of two names, from 0 to 1, from which one may be the other; names with other digits are others."""


def check_benches(session: Session, specs: Sequence[ResolvedSpec], admitted: Admission) -> None:
    """Refuse a bench that is new and nearly has the name of another, unless the request confirms it.

    Raises:
        CostUnconfirmed: the message has both names.
    """
    named = {each.reality.bench: None for each in specs if each.reality.bench not in (None, label_of(each.robot))}
    if not named or admitted.limits is None or admitted.cost_known:
        return
    known = {bench_key(each): each for each in spellings(session)}
    for bench in named:
        key = bench_key(bench)
        digits = list(filter(str.isdigit, key))
        alike = [each for each in known if list(filter(str.isdigit, each)) == digits]
        if key not in known and (close := get_close_matches(key, alike, n=1, cutoff=CLOSE)):
            message = (
                f"the bench {bench!r} is new, and {known[close[0]]!r} is known; if they are two robots, confirm it"
            )
            how = "confirm_cost=true, --yes, or yes=True in Python"
            raise CostUnconfirmed([Violation("confirm_cost", False, f"{message}: {how}", "true")])
