"""The lease of a supervisor on a piece of work: claim, heartbeat, complete, fail, release, hand back.

A holder sends a heartbeat every few seconds; without one for `STALE_AFTER_S`, it counts as lost. The next lease has
the next epoch. Every write carries the lease, and changes nothing once it has ended; the caller learns this from the
answer, and drops the work. Work that was lost is queued again, and fails after `MAX_LOSSES` losses without progress.

All use cases raise StoreUnavailable while the database cannot be used; each may then be tried again.
"""

from collections.abc import Iterable, Mapping, Sequence
from datetime import timedelta
from typing import Any, ClassVar, Generic, TypeVar

from sqlalchemy import ColumnElement, false, func, select, tuple_, update
from sqlalchemy.orm import Session

from gaplab.schemas.lifecycle import Ending, State
from gaplab.services.experiments.lease_ends import Change, Silences
from gaplab.services.experiments.states import move
from gaplab.services.store.clock import moment, now
from gaplab.services.store.lease import Lease
from gaplab.services.store.models import LeasedRow
from gaplab.services.store.session import Store
from gaplab.services.store.statements import storable

STALE_AFTER_S = 30.0

MAX_LOSSES = 5
"""Losses in a row, without progress, after which work is FAILED: it probably kills its workers."""

L = TypeVar("L", bound=Lease)


class Leases(Generic[L]):
    """Leases on the rows of one table; a subclass adds the consequences of an end.

    Attributes:
        table: table of the work.
    """

    table: ClassVar[type[LeasedRow]]

    def heartbeat(self, store: Store, leases: Iterable[L]) -> tuple[L, ...]:
        """Renew leases, and return those that are still valid."""
        held = tuple(leases)
        return store.write(self.renew, held) if held else ()

    def complete(self, store: Store, *leases: L, **results: Any) -> tuple[L, ...]:  # noqa: ANN401 - columns of any type
        """End work as COMPLETED, set columns of results, and return the leases that were valid."""
        if not leases:
            return ()
        change = Change(State.COMPLETED, Ending.COMPLETED, values={"error": None} | results)
        ended = store.write(self.end, self.of(leases), change)
        return tuple(lease for lease in leases if lease.id in ended)

    def fail(self, store: Store, lease: L, reason: str) -> bool:
        """End work as FAILED; return False if the lease is no longer valid."""
        why = storable(reason)
        change = Change(State.FAILED, Ending.FAILED, why, {"error": why})
        return bool(store.write(self.end, self.of([lease]), change))

    def release(self, store: Store, lease: L, reason: str) -> bool:
        """Queue work again whose worker was lost; return False if the lease is no longer valid."""
        return bool(store.write(self.lose, self.of([lease]), storable(reason)))

    def hand_back(self, store: Store, *leases: L) -> tuple[L, ...]:
        """Queue work again as if it had not been claimed, and return the leases that were valid."""
        given = store.write(self._hand_back, self.of(leases)) if leases else ()
        return tuple(lease for lease in leases if lease.id in given)

    def hand_back_unheard(self, store: Store, owner: str, known: Iterable[L]) -> int:
        """Hand back claims that an owner does not know, since no reply reached it, and return their number."""
        ids = [lease.id for lease in known]
        return len(store.write(self._hand_back, (self.table.owner == owner) & self.table.id.not_in(ids)))

    def requeue_lost(
        self, store: Store, *, stale_after_s: float = STALE_AFTER_S, silences: Silences[int] | None = None
    ) -> int:
        """Queue work again whose holder was silent for too long, and return the number of rows.

        A heartbeat from the future was sent before the clock was set back, and says nothing about the present. Without
        `silences` of the holders of hardware, the database's clock says how long those are too.
        """
        return len(store.write(self._requeue_lost, stale_after_s, silences))

    def release_all(self, store: Store, owner: str, reason: str) -> int:
        """Queue the work of a supervisor again whose process has ended, and return the number of rows."""
        return len(store.write(self.lose, (self.table.owner == owner) & ~self.drives(), storable(reason)))

    def drives(self) -> ColumnElement[bool]:
        """Return the SQL condition: the work holds hardware, which its worker may still drive; never by default."""
        return false()

    def take(self, session: Session, ids: Sequence[int | str], owner: str) -> list[Any]:
        """Begin a lease on each of these queued rows, and return the ids of those that were still free."""
        row = self.table
        return move(
            session,
            row,
            row.id.in_(ids) & (row.state == State.QUEUED),
            State.RUNNING,
            owner=owner,
            epoch=row.epoch + 1,
            attempts=row.attempts + 1,
            heartbeat_at=now(),
            started_at=func.coalesce(row.started_at, now()),
            **self.taken(),
        )

    def taken(self) -> Mapping[str, Any]:
        """Return further columns that a claim sets."""
        return {}

    def free_lost(self, session: Session, stale: ColumnElement[bool]) -> None:
        """Free what an ended lease still holds once its holder is silent; nothing by default."""

    def end(self, session: Session, which: ColumnElement[bool], change: Change) -> list[Any]:
        """End the valid leases of some rows, change these rows, and return their ids."""
        return move(session, self.table, which & (self.table.state == State.RUNNING), change.to, **change.values)

    def renew(self, session: Session, leases: Sequence[L], /, **values: Any) -> tuple[L, ...]:  # noqa: ANN401 - columns of any type
        """Renew leases, set further columns of their rows, and return those that are still valid."""
        row = self.table
        beaten = update(row).where(self.of(leases), row.state == State.RUNNING).values(heartbeat_at=now(), **values)
        held = {(id_, epoch) for id_, epoch in session.execute(beaten.returning(row.id, row.epoch))}
        return tuple(lease for lease in leases if (lease.id, lease.epoch) in held)

    def lose(self, session: Session, which: ColumnElement[bool], reason: str) -> list[Any]:
        """Queue work again whose worker was lost, or end it as FAILED after too many losses; return the ids."""
        losses = self.table.losses + 1
        values = {"losses": losses, "owner": None}
        last = f"lost {MAX_LOSSES} times without progress; the last time {reason}"
        give_up = Change(State.FAILED, Ending.LOST, reason, values | {"error": last})
        failed = self.end(session, which & (losses >= MAX_LOSSES), give_up)
        queued = self.end(session, which, Change(State.QUEUED, Ending.LOST, reason, values | {"error": reason}))
        return failed + queued

    def _hand_back(self, session: Session, which: ColumnElement[bool]) -> list[Any]:
        values = {"owner": None, "attempts": self.table.attempts - 1}
        return self.end(session, which, Change(State.QUEUED, Ending.HANDED_BACK, values=values))

    def _requeue_lost(self, session: Session, stale_after_s: float, silences: Silences[int] | None) -> list[Any]:
        beat, present, patience = self.table.heartbeat_at, moment(session), timedelta(seconds=stale_after_s)
        silent, ahead = beat < present - patience, beat > present + patience
        if silences is not None:
            drives = self.drives()
            held = session.execute(select(self.table.id, beat).where(drives, beat.is_not(None))).all()
            quiet = silences.longer_than_leases([(id_, at, stale_after_s) for id_, at in held])
            silent = (~drives & silent) | (drives & tuple_(self.table.id, beat).in_(quiet))
            ahead = ~drives & ahead
        self.free_lost(session, silent | ahead)
        lost = self.lose(session, silent, f"its worker was not heard of for {stale_after_s:g} s")
        return lost + self.lose(session, ahead, "the clock was set back since its heartbeat")

    def of(self, leases: Sequence[L]) -> ColumnElement[bool]:
        """Return the SQL condition: the row's lease is one of these; an ended lease may have no owner."""
        row, owners = self.table, {lease.owner for lease in leases}
        held = tuple_(row.id, row.epoch).in_([(lease.id, lease.epoch) for lease in leases])
        return held & (row.owner.is_(None) | row.owner.in_(owners))
