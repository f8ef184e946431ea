"""Execution of sensitivity checks, oldest first, under the lease of `gaplab.services.running.leases`.

All functions raise StoreUnavailable while the database cannot be used; each may then be tried again.
"""

from collections.abc import Mapping, Sequence

from sqlalchemy import ColumnElement, select
from sqlalchemy.orm import Session

from gaplab.schemas.lifecycle import State
from gaplab.schemas.sensitivity import Checked, Sensitivity
from gaplab.services.experiments import checks
from gaplab.services.experiments.lease_ends import Change
from gaplab.services.plugins.external import text_of
from gaplab.services.running.leases import Leases
from gaplab.services.running.provenance import NONE, unusable
from gaplab.services.store.lease import CheckClaim as CheckClaim
from gaplab.services.store.models import ExperimentRow, SensitivityRow
from gaplab.services.store.session import Store, transaction
from gaplab.services.store.statements import storable


class _Checks(Leases[CheckClaim]):
    """Leases of sensitivity checks. When one ends, its experiments get an event."""

    table = SensitivityRow

    def end(self, session: Session, which: ColumnElement[bool], change: Change) -> list[str]:
        """End leases as the base does."""
        ended: list[str] = super().end(session, which, change)
        row = ExperimentRow
        for id_ in ended if change.to.ended else ():
            experiments = session.scalars(select(row.id).where(row.sensitivity_id == id_).order_by(row.id))
            checks.tell(session, session.get_one(SensitivityRow, id_, populate_existing=True), experiments)
        return ended


_LEASES = _Checks()

heartbeat = _LEASES.heartbeat
fail = _LEASES.fail
release = _LEASES.release
hand_back = _LEASES.hand_back
requeue_lost = _LEASES.requeue_lost
release_all = _LEASES.release_all


def complete(store: Store, lease: CheckClaim, found: Sequence[Sensitivity]) -> bool:
    """End the check as COMPLETED with its results; return False if the lease is no longer valid."""
    return bool(_LEASES.complete(store, lease, found=[each.model_dump(mode="json") for each in found]))


@transaction
def claim(session: Session, owner: str, refused: Mapping[str, str] = NONE) -> CheckClaim | None:
    """Claim the oldest queued check that no other supervisor is claiming; None if there is none.

    Checks that name a plug-in that the supervisor's processes refuse stay queued, and tell why.
    """
    row = SensitivityRow
    queued = session.execute(select(row.id, row.spec).where(row.state == State.QUEUED).order_by(row.created_at, row.id))
    for id_, spec in queued.all():
        free = select(row).where(row.id == id_, row.state == State.QUEUED).with_for_update(skip_locked=True)
        if (check := session.scalar(free.execution_options(populate_existing=True))) is None:
            continue
        if reasons := unusable(spec, refused):
            check.error = storable(text_of(reasons))
        elif _LEASES.take(session, [id_], owner):
            session.refresh(check)
            return CheckClaim(check.id, check.epoch, Checked.model_validate(check.spec), owner=owner)
    return None
