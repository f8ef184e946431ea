"""Sensitivity checks: queued, found, and run under a lease like that of a repetition."""

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from hashlib import sha256
from typing import Any, TypeAlias

from sqlalchemy import ColumnElement, and_, case, func, select, update
from sqlalchemy.dialects import postgresql, sqlite
from sqlalchemy.orm import Session

from gaplab.schemas.events import EventKind
from gaplab.schemas.lifecycle import State
from gaplab.schemas.sensitivity import Checked, Sensitivity
from gaplab.services.core.errors import NotFound
from gaplab.services.core.sensitivity import VERSION, warning
from gaplab.services.store.clock import now
from gaplab.services.store.lease import CheckClaim
from gaplab.services.store.mapping import checked
from gaplab.services.store.models import ExperimentRow, SensitivityRow
from gaplab.services.store.queries.events import note
from gaplab.services.store.queries.leases import MAX_LOSSES, plain

_Insert: TypeAlias = Callable[..., postgresql.Insert | sqlite.Insert]
_INSERT: dict[str, _Insert] = {"sqlite": sqlite.insert, "postgresql": postgresql.insert}


@dataclass(frozen=True)
class Warned:
    """What an experiment's check says of its tunables.

    Attributes:
        check: its id; None if there is none.
        warnings: as sentences; none as long as it has not ended.
    """

    check: str | None = None
    warnings: tuple[str, ...] = ()


def id_of(spec: Checked, outside: Mapping[str, str]) -> str:
    """The id of the check: it follows from what is checked, and from the version of how.

    Args:
        spec: what is checked.
        outside: by kind and name, the files of plug-ins from outside; an edited one is checked anew.
    """
    names = (
        f"robot {spec.robot.name}",
        f"engine {spec.engine.name}",
        *(f"tunable {each.name}" for each in spec.tunables),
    )
    files = [outside[each] for each in names if each in outside]
    text = json.dumps([VERSION, spec.model_dump(mode="json"), *files], sort_keys=True)
    return sha256(text.encode()).hexdigest()[:16]


def queue(session: Session, spec: Checked, outside: Mapping[str, str]) -> SensitivityRow:
    """The check of this, QUEUED if there was none or it had FAILED; it does not end before the session's transaction.

    Else whoever ends it would not see, and not tell, the experiments that are submitted with it.
    """
    row, id_ = SensitivityRow, id_of(spec, outside)
    insert = _INSERT[session.get_bind().dialect.name]
    moment = session.execute(select(now())).scalar_one()
    values = {"id": id_, "spec": spec.model_dump(mode="json"), "created_at": moment}
    session.execute(insert(row).values(values).on_conflict_do_nothing(index_elements=[row.id]))
    again = {"state": State.QUEUED, "losses": 0, "error": None, "ended_at": None}
    session.execute(update(row).where(row.id == id_, row.state == State.FAILED).values(again))
    return session.get_one(row, id_, populate_existing=True, with_for_update={"read": True})


def queue_for(session: Session, experiments: Iterable[ExperimentRow], outside: Mapping[str, str]) -> None:
    """The check of what these experiments tune, as `queue` does; they have it in common, and may all tune nothing."""
    tuning = [row for row in experiments if row.iterations > 1]
    for each in tuning[:1]:
        check = queue(session, checked(each.spec), outside)
        for row in tuning:
            row.sensitivity_id = check.id
        session.flush()
        if check.state.ended:
            _tell(session, check, [row.id for row in tuning])


def get(session: Session, id_: str) -> SensitivityRow:
    """The check of that id.

    Raises:
        NotFound: there is none.
    """
    if (found := session.get(SensitivityRow, plain(id_), populate_existing=True)) is None:
        msg = f"there is no sensitivity check {id_!r}"
        raise NotFound(msg)
    return found


def warned(session: Session, experiments: Iterable[ExperimentRow]) -> dict[str, Warned]:
    """What the checks of these experiments say, by experiment; those that tune nothing have none.

    One whose row names no check, for it came in an archive, has that of the same tunables, if there is one.
    """
    ids = {each.id: each.sensitivity_id or id_of(checked(each.spec), {}) for each in experiments if each.iterations > 1}
    row = SensitivityRow
    found = {
        each.id: Warned(each.id, warnings(each))
        for each in session.scalars(select(row).where(row.id.in_(ids.values())))
    }
    return {experiment: found[check] for experiment, check in ids.items() if check in found}


def warnings(row: SensitivityRow) -> tuple[str, ...]:
    """What a person who tunes this should know."""
    if row.state is State.FAILED:
        return (f"the sensitivity check failed, so that nothing is known of the tunables: {row.error}",)
    return tuple(sentence for each in findings(row) if (sentence := warning(each)))


def findings(row: SensitivityRow) -> tuple[Sensitivity, ...]:
    """What the check found, a tunable each; nothing as long as it has not."""
    return tuple(map(Sensitivity.model_validate, row.found or ()))


def claim(session: Session, owner: str) -> CheckClaim | None:
    """The oldest queued check that nobody else claims now: RUNNING from now on, the owner's; None if there is none."""
    row = SensitivityRow
    oldest = select(row.id).where(row.state == State.QUEUED).order_by(row.created_at, row.id).limit(1)
    if (id_ := session.scalar(oldest.with_for_update(skip_locked=True))) is None:
        return None
    claimed = session.execute(
        update(row)
        .where(row.id == id_, row.state == State.QUEUED)
        .values(
            state=State.RUNNING,
            owner=owner,
            epoch=row.epoch + 1,
            attempts=row.attempts + 1,
            heartbeat_at=now(),
            started_at=func.coalesce(row.started_at, now()),
        )
        .returning(row.id, row.epoch, row.spec)
    ).first()
    return CheckClaim(claimed.id, claimed.epoch, Checked.model_validate(claimed.spec)) if claimed else None


def heartbeat(session: Session, claim: CheckClaim) -> bool:
    """The claim holds on from now; False if it holds no more."""
    return _move(session, _mine(claim), heartbeat_at=now()) == 1


def complete(session: Session, claim: CheckClaim, found: Sequence[Sensitivity]) -> bool:
    """The check COMPLETED; False if the claim holds no more."""
    rows = [each.model_dump(mode="json") for each in found]
    return _move(session, _mine(claim), state=State.COMPLETED, found=rows, error=None, ended_at=now()) == 1


def fail(session: Session, claim: CheckClaim, reason: str) -> bool:
    """The check FAILED for a reason; False if the claim holds no more."""
    return _move(session, _mine(claim), state=State.FAILED, error=plain(reason), ended_at=now()) == 1


def release(session: Session, claim: CheckClaim, reason: str) -> bool:
    """The check QUEUED again, for its worker was lost; False if the claim holds no more."""
    return _give_back(session, _mine(claim), plain(reason)) == 1


def hand_back(session: Session, claim: CheckClaim) -> bool:
    """The check QUEUED again as if it had not been claimed; False if the claim holds no more."""
    attempts = SensitivityRow.attempts - 1
    return _move(session, _mine(claim), state=State.QUEUED, owner=None, attempts=attempts) == 1


def requeue_lost(session: Session, stale_after: timedelta) -> int:
    """Every check whose holder was not heard of for so long QUEUED again; how many they were."""
    row = SensitivityRow
    before: datetime = session.execute(select(now())).scalar_one() - stale_after
    stale = (row.state == State.RUNNING) & (row.heartbeat_at < before)
    return _give_back(session, stale, f"its worker was not heard of for {stale_after.total_seconds():g} s")


def _mine(claim: CheckClaim) -> ColumnElement[bool]:
    row = SensitivityRow
    return and_(row.id == claim.id, row.epoch == claim.epoch, row.state == State.RUNNING)


def _give_back(session: Session, which: ColumnElement[bool], reason: str) -> int:
    """QUEUED again, or FAILED where it was lost too often."""
    row = SensitivityRow
    hopeless = row.losses + 1 >= MAX_LOSSES
    failed = f"lost {MAX_LOSSES} times; the last time {reason}"
    return _move(
        session,
        which,
        state=case((hopeless, State.FAILED), else_=State.QUEUED),
        error=case((hopeless, failed), else_=reason),
        ended_at=case((hopeless, now()), else_=None),
        losses=row.losses + 1,
        owner=None,
    )


def _move(session: Session, which: ColumnElement[bool], **values: Any) -> int:  # noqa: ANN401 - columns have many types
    row = SensitivityRow
    moved = session.execute(update(row).where(which).values(values).returning(row.id, row.state)).all()
    for id_, state in moved:
        if state.ended:
            of_it = select(ExperimentRow.id).where(ExperimentRow.sensitivity_id == id_).order_by(ExperimentRow.id)
            _tell(session, get(session, id_), session.scalars(of_it))
    return len(moved)


def _tell(session: Session, check: SensitivityRow, experiments: Iterable[str]) -> None:
    """These experiments that their check has ended, and what it found."""
    told = {"sensitivity": check.id, "state": check.state.value, "warnings": list(warnings(check))}
    for experiment in experiments:
        note(session, EventKind.SENSITIVITY_ENDED, experiment, **told)
